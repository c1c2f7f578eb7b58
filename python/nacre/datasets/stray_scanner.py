"""Stray Scanner recordings (iPhone, iPad): depth/, confidence/, camera_matrix.csv, odometry.csv."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt

from nacre._internal.arrays import FARTHEST
from nacre._internal.quaternions import matrix_from_quaternion
from nacre.camera import Camera
from nacre.datasets.listing import describe, files, pair, require_order
from nacre.datasets.overrides import Overrides
from nacre.datasets.sequence import FrameSource, Sequence
from nacre.errors import FileFormatError
from nacre.io.cameras import check_lens
from nacre.io.images import DEPTH_SUFFIXES, read_depth
from nacre.io.raw import excerpt, number_of, read_text
from nacre.trajectory import Trajectory

FORMAT = "stray-scanner"
LAYOUT = "depth/, camera_matrix.csv, optionally confidence/ and odometry.csv"
DEPTH_SCALE = 1000.0

_COLOR_WIDTHS = np.array([640, 960, 1280, 1440, 1920, 3840, 4032])
_FIELDS = ("timestamp", "frame", "x", "y", "z", "qx", "qy", "qz", "qw")


def recognise(folder: Path) -> bool:
    """Say whether a folder looks like this format."""
    return (folder / "camera_matrix.csv").is_file() and (folder / "depth").is_dir()


def missing(folder: Path) -> str | None:
    """Say what a folder lacks that is almost such a recording."""
    if (folder / "odometry.csv").is_file() or (
        (folder / "confidence").is_dir() and (folder / "depth").is_dir()
    ):
        lacking = "depth/" if (folder / "camera_matrix.csv").is_file() else "camera_matrix.csv"
        return f"This is almost a Stray Scanner recording: {lacking} is missing."
    return None


def read(folder: Path, given: Overrides) -> Sequence:
    """
    Open a folder of this format.

    Pixels of the lowest confidence are not used, others by what it is worth. The odometry is the phone's
    estimate, not a truth; the colours are a video, which is not read.
    """
    depth = files(folder / "depth", DEPTH_SUFFIXES)
    if not depth:
        raise FileFormatError(
            folder,
            f"a Stray Scanner recording needs depth images in depth/; the folder holds {describe(folder)}",
        )
    confidence = pair(depth, files(folder / "confidence", DEPTH_SUFFIXES))
    times, estimate = _odometry(folder / "odometry.csv", len(depth))
    return Sequence(
        folder,
        format=FORMAT,
        camera=given.camera or _camera(folder / "camera_matrix.csv", depth[0]),
        depth_scale=given.scale_or(DEPTH_SCALE),
        sources=[
            FrameSource(i, path, timestamp=times[i], confidence=confidence[i]) for i, path in enumerate(depth)
        ],
        estimate=estimate,
    )


def _camera(path: Path, depth: Path) -> Camera:
    """Return the camera of the depth images; the file has that of the video, which is larger."""
    try:
        matrix = _numbers(read_text(path).splitlines())
    except FileFormatError:
        raise
    except (ValueError, OSError) as error:
        raise FileFormatError(path, f"three lines of three numbers were expected: {error}") from error
    if matrix.shape != (3, 3) or not np.isfinite(matrix).all() or not (matrix[[0, 1], [0, 1]] > 0).all():
        raise FileFormatError(path, "a camera matrix with positive focal lengths was expected")
    height, width = read_depth(depth).shape
    color_width = _COLOR_WIDTHS[np.abs(_COLOR_WIDTHS - 2 * matrix[0, 2]).argmin()]
    scale = width / color_width
    # Pixel centres are integers: the middle of a wider pixel moves.
    cx, cy = scale * (matrix[:2, 2] + 0.5) - 0.5
    try:
        camera = Camera(width, height, scale * matrix[0, 0], scale * matrix[1, 1], cx, cy)
        return check_lens(path, camera)
    except ValueError as error:
        raise FileFormatError(path, str(error)) from error


def _odometry(path: Path, num_frames: int) -> tuple[list[float | None], Trajectory | None]:
    times: list[float | None] = [None] * num_frames
    if not path.is_file():
        return times, None
    lines = read_text(path).splitlines()
    names = [name.strip() for name in lines[0].split(",")] if lines else []
    if names[: len(_FIELDS)] != list(_FIELDS):
        raise FileFormatError(path, f"the first line must name {', '.join(_FIELDS)}", line=1)
    stamps: list[float] = []
    poses = []
    for number, line in enumerate(lines[1:], start=2):
        if not line.strip():
            continue
        try:
            row = _numbers([line])[0]
            if len(row) < len(_FIELDS) or not np.isfinite(row).all() or np.abs(row[2:5]).max() > FARTHEST:
                raise ValueError(f"got {excerpt(line.encode())}")
            pose = np.eye(4)
            pose[:3, :3], pose[:3, 3] = matrix_from_quaternion(row[5:9]), row[2:5]
        except (ValueError, IndexError) as error:
            raise FileFormatError(path, f"nine numbers were expected: {error}", line=number) from error
        require_order(path, number, float(row[0]), stamps[-1] if stamps else None)
        frame = int(row[1])
        if 0 <= frame < num_frames:
            times[frame] = float(row[0])
        stamps.append(float(row[0]))
        poses.append(pose)
    return times, Trajectory(np.array(stamps), np.array(poses)) if stamps else None


def _numbers(lines: list[str]) -> npt.NDArray[np.float64]:
    rows = [[number_of(text.strip()) for text in line.split(",")] for line in lines if line.strip()]
    return np.array(rows, dtype=np.float64)
