"""TUM RGB-D recordings (Sturm et al. 2012): image lists with time stamps, motion-capture truth."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from nacre._internal.warned import warn
from nacre.camera import Camera
from nacre.datasets.listing import describe, require_order
from nacre.datasets.overrides import Overrides
from nacre.datasets.sequence import FrameSource, Sequence
from nacre.errors import FileFormatError
from nacre.io.named_files import inside
from nacre.io.raw import excerpt, number_of, read_text
from nacre.io.trajectories import read_trajectory
from nacre.trajectory import Trajectory, associate

FORMAT = "tum"
LAYOUT = "depth.txt with lines 'timestamp file', optionally rgb.txt and groundtruth.txt"
DEPTH_SCALE = 5000.0

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


def read(folder: Path, given: Overrides) -> Sequence:
    """Open a folder of this format."""
    if not recognise(folder):
        raise FileFormatError(folder, f"a TUM recording needs depth.txt; the folder holds {describe(folder)}")
    if (folder / "camera.json").is_file():
        given = given.filled_from(folder / "camera.json")
    depth = read_list(folder / "depth.txt")
    for before, entry in pairwise(depth):
        require_order(folder / "depth.txt", entry.line, entry.time, before.time)
    if not any(entry.path.is_file() for entry in depth):
        first = depth[0].path.relative_to(folder).as_posix()
        raise FileFormatError(
            folder / "depth.txt",
            f"none of the {len(depth)} files that it lists is there, {first!r} the first; "
            f"the folder holds {describe(folder)}",
        )
    times = np.array([entry.time for entry in depth])
    colors: dict[int, Path] = {}
    if (folder / "rgb.txt").is_file():
        color = read_list(folder / "rgb.txt")
        pairs = associate(times, [entry.time for entry in color], given.max_difference)
        colors = {int(i): color[j].path for i, j in zip(*pairs, strict=True)}
    truth, poses = read_truth(folder / "groundtruth.txt", times, given.max_difference)
    return Sequence(
        folder,
        format=FORMAT,
        camera=given.camera or _default_camera(folder),
        depth_scale=given.scale_or(DEPTH_SCALE),
        sources=[
            FrameSource(i, entry.path, colors.get(i), entry.time, poses[i]) for i, entry in enumerate(depth)
        ],
        truth=truth,
    )


class Entry(NamedTuple):
    """A line of a list: when, and which file, in the list's folder."""

    line: int
    time: float
    path: Path


def read_list(path: Path) -> list[Entry]:
    """Read lines of ``timestamp file``; ``#`` starts a comment line."""
    entries = []
    for number, line in lines_of(path):
        words = line.split(maxsplit=1)
        time = time_of(words[0])
        if len(words) != 2 or not math.isfinite(time):
            reason = f"expected 'timestamp file', got {excerpt(line.encode())}"
            raise FileFormatError(path, reason, line=number)
        entries.append(Entry(number, time, inside(path.parent, words[1].strip(), path, number)))
    if not entries:
        raise FileFormatError(path, "the list is empty")
    return entries


def lines_of(path: Path) -> Iterator[tuple[int, str]]:
    """Yield the numbered lines of a list without those that are empty or comments."""
    for number, line in enumerate(read_text(path).splitlines(), start=1):
        if line.strip() and not line.lstrip().startswith("#"):
            yield number, line.strip()


def time_of(word: str) -> float:
    """Return a time [s], or NaN where it is none."""
    try:
        return number_of(word)
    except ValueError:
        return math.nan


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
        warn(f"{folder}: nothing says freiburg1, 2 or 3; assumed the driver's default, {camera!r}")
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
