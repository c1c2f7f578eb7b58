"""Opening a recording as the command line's options say."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from nacre.cli.terminal import CommandError
from nacre.errors import FileFormatError, UnknownRecordingError

if TYPE_CHECKING:
    from nacre import Camera
    from nacre.datasets import Sequence


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

    try:
        return nacre.open_sequence(source, format=format, camera=camera, depth_scale=depth_scale)
    except FileFormatError as error:
        code = 2 if isinstance(error, UnknownRecordingError) else 1
        text, *layouts = str(error).split(" Known formats:")
        if layouts:
            names = ", ".join(line.split(":")[0].strip() for line in layouts[0].splitlines() if line)
            text += f" Known formats: {names}; see nacre reconstruct --help."
        text = text.replace("camera and depth_scale not known", "--camera and --depth-scale are needed")
        text = text.replace("Give camera= and depth_scale=", "Give --camera FILE.json and --depth-scale")
        for name in ("camera", "depth_scale"):
            option = name.replace("_", "-")
            text = text.replace(f"{name} not known", f"--{option} is needed").replace(
                f"{name}=", f"--{option} "
            )
        raise CommandError(text, code) from error


def describe_camera(camera: Camera) -> str:
    """Return a camera in words."""
    size = f"{camera.model} camera {camera.width} x {camera.height}"
    if camera.model == "orthographic":
        return f"{size}, {1000 * camera.pixel_size:g} mm per pixel"
    return f"{size}, fx {camera.fx:g}, fy {camera.fy:g}"
