"""7-Scenes recordings (Shotton et al. 2013): frame-000000.depth.png, .color.png, .pose.txt."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt

from nacre._internal.warned import warn
from nacre.camera import Camera
from nacre.datasets.listing import describe, natural_key
from nacre.datasets.overrides import Overrides
from nacre.datasets.sequence import FrameSource, Sequence
from nacre.errors import FileFormatError
from nacre.io.trajectories import read_trajectory
from nacre.trajectory import Trajectory

FORMAT = "7-scenes"
LAYOUT = "frame-000000.depth.png, optionally frame-000000.color.png and frame-000000.pose.txt"
DEPTH_SCALE = 1000.0


def recognise(folder: Path) -> bool:
    """Say whether a folder looks like this format."""
    return any(folder.glob("frame-*.depth.png"))


def read(folder: Path, given: Overrides) -> Sequence:
    """Open a folder of this format."""
    depth = sorted(folder.glob("frame-*.depth.png"), key=natural_key)
    if not depth:
        raise FileFormatError(
            folder,
            f"a 7-Scenes recording needs frame-000000.depth.png, ...; the folder holds {describe(folder)}",
        )
    sources, damaged = [], []
    for index, path in enumerate(depth):
        stem = path.name.removesuffix(".depth.png")
        color = folder / f"{stem}.color.png"
        try:
            pose = _read_pose(folder / f"{stem}.pose.txt")
        except FileFormatError as error:
            pose = None
            damaged.append(error)
        sources.append(FrameSource(index, path, color if color.is_file() else None, None, pose))
    if damaged:
        warn(f"{folder}: {len(damaged)} of {len(depth)} views have no true pose; the first: {damaged[0]}")
    known = [(source.index, source.truth) for source in sources if source.truth is not None]
    truth = (
        Trajectory(np.array([i for i, _ in known]), np.array([pose for _, pose in known])) if known else None
    )
    return Sequence(
        folder,
        format=FORMAT,
        camera=given.camera or Camera(width=640, height=480, fx=585.0, fy=585.0, cx=320.0, cy=240.0),
        depth_scale=given.scale_or(DEPTH_SCALE),
        sources=sources,
        truth=truth,
    )


def _read_pose(path: Path) -> npt.NDArray[np.float64] | None:
    """Read a view's pose; a view whose pose is not known has no file, or numbers in it that are none."""
    if not path.is_file():
        return None
    pose: npt.NDArray[np.float64] = read_trajectory(path).poses[0]
    return pose
