"""TUM RGB-D recordings (Sturm et al. 2012): image lists with time stamps, motion-capture truth."""

from __future__ import annotations

import logging
import math
import re
from pathlib import Path

import numpy as np
import numpy.typing as npt

from nacre._core import Camera
from nacre.datasets.given import Given
from nacre.datasets.listing import describe
from nacre.datasets.sequence import FrameSource, Sequence
from nacre.errors import FileFormatError
from nacre.io.trajectories import Trajectory, associate, read_trajectory

FORMAT = "tum"
LAYOUT = "depth.txt with lines 'timestamp file', optionally rgb.txt and groundtruth.txt"
DEPTH_SCALE = 5000.0

_log = logging.getLogger(__name__)

# fx fy cx cy and distortion of the colour camera, to which the depth images are registered, as the
# benchmark's page gives them; the third camera's images come undistorted.
_NO_DISTORTION = (0.0, 0.0, 0.0, 0.0, 0.0)
_CALIBRATIONS = {
    "1": ((517.3, 516.5, 318.6, 255.3), (0.2624, -0.9531, -0.0054, 0.0026, 1.1633)),
    "2": ((520.9, 521.0, 325.1, 249.7), (0.2312, -0.7849, -0.0033, -0.0001, 0.9172)),
    "3": ((535.4, 539.2, 320.1, 247.6), _NO_DISTORTION),
}
_ROS_DEFAULT = ((525.0, 525.0, 319.5, 239.5), _NO_DISTORTION)


def recognise(folder: Path) -> bool:
    """Say whether a folder looks like this format."""
    return (folder / "depth.txt").is_file()


def read(folder: Path, given: Given) -> Sequence:
    """Open a folder of this format."""
    if not recognise(folder):
        raise FileFormatError(folder, f"a TUM recording needs depth.txt; the folder holds {describe(folder)}")
    if (folder / "camera.json").is_file():
        given = given.filled_from(folder / "camera.json")
    depth = read_list(folder / "depth.txt")
    if not any((folder / name).is_file() for _, name in depth):
        raise FileFormatError(
            folder / "depth.txt",
            f"none of the {len(depth)} files that it lists is there, {depth[0][1]!r} the first; "
            f"the folder holds {describe(folder)}",
        )
    times = np.array([time for time, _ in depth])
    colors: dict[int, Path] = {}
    if (folder / "rgb.txt").is_file():
        color = read_list(folder / "rgb.txt")
        pairs = associate(times, [time for time, _ in color], given.max_difference)
        colors = {int(i): folder / color[j][1] for i, j in zip(*pairs, strict=True)}
    truth, poses = read_truth(folder / "groundtruth.txt", times, given.max_difference)
    return Sequence(
        folder,
        format=FORMAT,
        camera=given.camera or _default_camera(folder),
        depth_scale=given.scale_or(DEPTH_SCALE),
        sources=[
            FrameSource(i, folder / name, colors.get(i), time, poses[i])
            for i, (time, name) in enumerate(depth)
        ],
        truth=truth,
    )


def read_list(path: Path) -> list[tuple[float, str]]:
    """Read lines of ``timestamp file``; ``#`` starts a comment line."""
    entries = []
    for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), start=1):
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        words = line.split(maxsplit=1)
        try:
            time = float(words[0])
        except ValueError:
            time = math.nan
        if len(words) != 2 or not math.isfinite(time):
            raise FileFormatError(path, f"expected 'timestamp file', got {line.strip()[:60]!r}", line=number)
        entries.append((time, words[1].strip()))
    if not entries:
        raise FileFormatError(path, "the list is empty")
    return entries


def read_truth(
    path: Path, times: npt.NDArray[np.float64], max_difference: float
) -> tuple[Trajectory | None, list[npt.NDArray[np.float64] | None]]:
    """Read a trajectory, if it is there, and its poses at the views' times, None where it has none."""
    if not path.is_file():
        return None, [None] * len(times)
    truth = read_trajectory(path)
    return truth, poses_at(truth, times, max_difference)


def poses_at(
    truth: Trajectory, times: npt.NDArray[np.float64], max_difference: float
) -> list[npt.NDArray[np.float64] | None]:
    """Return the poses at the views' times, None where there is none near enough."""
    return [pose if np.isfinite(pose).all() else None for pose in truth.at(times, max_difference)]


def _default_camera(folder: Path) -> Camera:
    number = _freiburg(folder)
    (fx, fy, cx, cy), distortion = _CALIBRATIONS[number] if number is not None else _ROS_DEFAULT
    camera = Camera(width=640, height=480, fx=fx, fy=fy, cx=cx, cy=cy, distortion=distortion)
    if number is None:
        _log.warning("%s: nothing says freiburg1, 2 or 3; assumed the driver's default, %r", folder, camera)
    return camera


def _freiburg(folder: Path) -> str | None:
    """Return which of the three cameras was used, as the lists' comments or the folder's name tell."""
    texts = []
    for name in ("groundtruth.txt", "depth.txt", "rgb.txt"):
        if (folder / name).is_file():
            with (folder / name).open(encoding="utf-8", errors="replace") as stream:
                texts += [line for _, line in zip(range(5), stream, strict=False) if line.startswith("#")]
    for text in (*texts, folder.resolve().name):
        match = re.search(r"(?<![a-z])fr(?:eiburg)?([123])(?!\d)", text.lower())
        if match:
            return match.group(1)
    return None
