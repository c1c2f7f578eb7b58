"""Redwood and Open3D recordings: depth/, image/ or color/ or rgb/, an intrinsics JSON, a trajectory .log."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from nacre._internal.warned import warn
from nacre.camera import Camera
from nacre.datasets.listing import describe, files, pair
from nacre.datasets.overrides import Overrides
from nacre.datasets.sequence import FrameSource, Sequence
from nacre.datasets.tum import poses_at
from nacre.errors import FileFormatError
from nacre.io.images import COLOR_SUFFIXES, DEPTH_SUFFIXES
from nacre.io.trajectories import read_trajectory
from nacre.trajectory import Trajectory

FORMAT = "redwood"
LAYOUT = "depth/ and image/, color/ or rgb/, optionally an Open3D intrinsics .json and a trajectory .log"
DEPTH_SCALE = 1000.0

_COLOR_FOLDERS = ("image", "color", "rgb")
_TRUTH_PATTERNS = ("*groundtruth*.log", "trajectory.log", "*-traj.txt")


def recognise(folder: Path) -> bool:
    """Say whether a folder looks like this format."""
    depth = files(folder / "depth", DEPTH_SUFFIXES)
    if not depth or (folder / "groundtruth.txt").is_file() or has_time_names(depth):
        return False
    has_color = any(files(folder / name, COLOR_SUFFIXES) for name in _COLOR_FOLDERS)
    return has_color or any(folder.glob("*.log")) or _intrinsics(folder) is not None


def read(folder: Path, given: Overrides) -> Sequence:
    """Open a folder of this format."""
    depth = files(folder / "depth", DEPTH_SUFFIXES)
    if not depth:
        raise FileFormatError(
            folder, f"a Redwood recording needs depth images in depth/; the folder holds {describe(folder)}"
        )
    intrinsics = _intrinsics(folder)
    if intrinsics is not None:
        given = given.filled_from(intrinsics)
    camera = given.camera
    if camera is None:
        camera = Camera(width=640, height=480, fx=525.0, fy=525.0, cx=319.5, cy=239.5)
        warn(f"{folder}: no intrinsics .json; assumed a PrimeSense camera, {camera!r}")
    colors: list[Path | None] = [None] * len(depth)
    for name in _COLOR_FOLDERS:
        if files(folder / name, COLOR_SUFFIXES):
            colors = pair(depth, files(folder / name, COLOR_SUFFIXES))
            break
    truth = _first(folder, _TRUTH_PATTERNS)
    numbers = np.arange(len(depth), dtype=np.float64)
    poses = poses_at(truth, numbers, 0.0) if truth is not None else [None] * len(depth)
    return Sequence(
        folder,
        format=FORMAT,
        camera=camera,
        depth_scale=given.scale_or(DEPTH_SCALE),
        sources=[FrameSource(i, path, colors[i], None, poses[i]) for i, path in enumerate(depth)],
        truth=truth,
        estimate=None if truth is not None else _first(folder, ("*trajectory*.log",)),
    )


def has_time_names(images: list[Path]) -> bool:
    """Say whether images are named after times, as TUM's are; their depth scale is another one."""
    return all("." in path.stem for path in images)


def _intrinsics(folder: Path) -> Path | None:
    """Return the folder's camera file, if there is one; such recordings hold other JSON files too."""
    named = [path for path in files(folder, (".json",)) if re.search("cam|intrinsic", path.name.lower())]
    return named[0] if named else None


def _first(folder: Path, patterns: tuple[str, ...]) -> Trajectory | None:
    for pattern in patterns:
        for path in sorted(folder.glob(pattern)):
            return read_trajectory(path)
    return None
