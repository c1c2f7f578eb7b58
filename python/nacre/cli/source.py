"""Opening a recording as the command line's options say."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from nacre.cli.terminal import CommandError
from nacre.errors import CannotResumeError, FileFormatError, RunError, UnknownRecordingError

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

    from nacre import Camera
    from nacre.datasets import Sequence
    from nacre.run_data.saved_run import SavedRun


def complete_format(incomplete: str) -> list[str]:
    """Return the formats that begin so, for the shell."""
    from nacre.datasets.detect import READERS

    return [name for name in READERS if name.startswith(incomplete)]


FormatOption = Annotated[
    str | None,
    typer.Option(
        autocompletion=complete_format,
        help="tum, redwood, 7-scenes, icl-nuim, rosbag, record3d, stray-scanner, azure-kinect, plain, "
        "stanford or images.",
        show_default="recognised",
    ),
]
CameraOption = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE.json",
        help='The camera, e.g. {"model": "pinhole", "width": 640, "height": 480, "fx": 525, "fy": 525, '
        '"cx": 319.5, "cy": 239.5, "depth_scale": 1000}.',
        show_default="the recording's",
    ),
]
DepthScaleOption = Annotated[
    float | None,
    typer.Option(
        help="Stored depth units per metre: 1000 for millimetres, 5000 for TUM.",
        show_default="the recording's",
    ),
]


def open_source(
    source: Path,
    format: str | None = None,
    camera: Camera | Path | None = None,
    depth_scale: float | None = None,
) -> Sequence:
    """Open a recording, or say which option is missing."""
    import nacre

    with in_option_words():
        return nacre.open_sequence(source, format=format, camera=camera, depth_scale=depth_scale)


@contextmanager
def in_option_words() -> Iterator[None]:
    """Name the options where the library names the arguments that a recording needs."""
    try:
        yield
    except FileFormatError as error:
        code = 2 if isinstance(error, UnknownRecordingError) else 1
        raise CommandError(option_words(str(error)), code) from error
    except CannotResumeError as error:
        raise CommandError(f"{error}; run it again without --resume", error.code) from error
    except RunError as error:
        raise CommandError(option_words(str(error)), error.code) from error


def option_words(reason: str) -> str:
    """Return what is said of a recording with the command line's options in place of arguments."""
    text, *layouts = reason.split(" Known formats:")
    if layouts:
        names = ", ".join(line.split(":")[0].strip() for line in layouts[0].splitlines() if line)
        text += f" Known formats: {names}; see nacre reconstruct --help."
    text = text.replace("camera and depth_scale not known", "--camera and --depth-scale are needed")
    text = text.replace("check depth_scale,", "give --depth-scale,")
    text = text.replace("attribute needs", "--attribute needs")
    text = text.replace("overwrite begins", "--overwrite begins")
    text = text.replace("Give camera= and depth_scale=", "Give --camera FILE.json and --depth-scale")
    for name in ("camera", "depth_scale"):
        option = name.replace("_", "-")
        text = text.replace(f"{name} not known", f"--{option} is needed").replace(f"{name}=", f"--{option} ")
    return text


def reopen(
    run: SavedRun, open: Callable[..., Sequence] = open_source
) -> tuple[Sequence, npt.NDArray[np.float64]]:
    """
    Open the recording of a run, and return it with the poses that were found.

    Parameters
    ----------
    run : SavedRun
        What nacre reconstruct wrote.
    open : callable
        What opens a recording as :func:`open_source` does.

    Returns
    -------
    sequence : Sequence
    poses : (N, 4, 4) float64
        ``world_from_camera`` of its views; NaN where it is not known.
    """
    import numpy as np

    recording = run.report.get("recording") or {}
    if not recording.get("path"):
        raise CommandError(f"{run.folder} is not of a recording, which would have the images", 2)
    path = Path(recording["path"])
    if not path.exists():
        raise CommandError(f"{run.folder}: its recording, which has the images, is no longer at {path}")
    sequence = open(path, recording.get("format"), run.camera, recording.get("depth_scale"))
    poses = np.full((len(sequence), 4, 4), np.nan)
    for frame, pose in zip(run.frames, run.poses, strict=True):
        if frame.index >= len(sequence):
            raise CommandError(f"{run.folder}: its recording {path} has only {len(sequence)} views by now")
        poses[frame.index] = pose
    return sequence, poses
