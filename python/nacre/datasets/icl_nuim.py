"""
ICL-NUIM recordings (Handa et al. 2014) in the TUM-compatible PNG distribution.

The renderer's frame is left-handed: y points up, and the published camera matrix has a negative fy. With it,
points and model lie in the frame of the published poses, the mirror image of a right-handed one. With a
camera of positive fy (``camera=...``) the poses are mirrored too, so that they go with OpenCV's axes.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from nacre.camera import Camera
from nacre.datasets.listing import describe, files, pair, require_order
from nacre.datasets.overrides import Overrides
from nacre.datasets.sequence import FrameSource, Sequence
from nacre.datasets.tum import lines_of, poses_at, time_of
from nacre.errors import FileFormatError
from nacre.io.images import COLOR_SUFFIXES, DEPTH_SUFFIXES
from nacre.io.named_files import inside
from nacre.io.raw import excerpt
from nacre.io.trajectories import read_trajectory
from nacre.trajectory import Trajectory

FORMAT = "icl-nuim"
LAYOUT = "associations.txt or depth/ and rgb/ with numbered images, and *.gt.freiburg"
DEPTH_SCALE = 5000.0

_MIRROR = np.diag([1.0, -1.0, 1.0, 1.0])


def recognise(folder: Path) -> bool:
    """Say whether a folder looks like this format."""
    if re.search(r"frei_png|icl[-_]?nuim", folder.resolve().name.lower()) and (folder / "depth").is_dir():
        return True
    if any(folder.glob("*.gt.freiburg")):
        return True
    return (folder / "associations.txt").is_file() and not (folder / "depth.txt").is_file()


def read(folder: Path, given: Overrides) -> Sequence:
    """Open a folder of this format."""
    if (folder / "associations.txt").is_file():
        views = _read_associations(folder / "associations.txt")
    else:
        views = _numbered(folder)
    camera = given.camera or Camera(width=640, height=480, fx=481.2, fy=-480.0, cx=319.5, cy=239.5)
    times = np.array([time for time, _, _ in views])
    truth = _read_truth(folder, camera)
    poses = poses_at(truth, times, given.max_difference) if truth is not None else [None] * len(views)
    return Sequence(
        folder,
        format=FORMAT,
        camera=camera,
        depth_scale=given.scale_or(DEPTH_SCALE),
        sources=[
            FrameSource(i, depth, color, time, poses[i]) for i, (time, depth, color) in enumerate(views)
        ],
        truth=truth,
    )


def _read_associations(path: Path) -> list[tuple[float, Path, Path | None]]:
    views: list[tuple[float, Path, Path | None]] = []
    for number, line in lines_of(path):
        words = line.split()
        times = [time_of(word) for word in words[::2]]
        if len(words) != 4 or not np.isfinite(times).all():
            reason = f"expected 'number depth-file number rgb-file', got {excerpt(line.encode())}"
            raise FileFormatError(path, reason, line=number)
        first, second = (inside(path.parent, name, path, number) for name in words[1::2])
        # The dataset's own lists have depth first; lists made by TUM's associate.py mostly have colour first.
        if words[1].startswith("depth"):
            views.append((times[0], first, second))
        else:
            views.append((times[1], second, first))
        require_order(path, number, views[-1][0], views[-2][0] if len(views) > 1 else None)
    if not views:
        raise FileFormatError(path, "the list is empty")
    return views


def _numbered(folder: Path) -> list[tuple[float, Path, Path | None]]:
    depth = [path for path in files(folder / "depth", DEPTH_SUFFIXES) if path.stem.isdecimal()]
    if not depth:
        raise FileFormatError(
            folder,
            "an ICL-NUIM recording needs associations.txt or depth/0.png, depth/1.png, ... (the TUM-like "
            f"distribution); the folder holds {describe(folder)}",
        )
    colors = pair(depth, files(folder / "rgb", COLOR_SUFFIXES))
    return [(float(path.stem), path, color) for path, color in zip(depth, colors, strict=True)]


def _read_truth(folder: Path, camera: Camera) -> Trajectory | None:
    found = sorted(folder.glob("*.gt.freiburg")) or sorted(folder.glob("groundtruth.txt"))
    if not found:
        return None
    if len(found) > 1:
        names = ", ".join(path.name for path in found)
        raise FileFormatError(folder, f"more than one ground truth ({names}); keep the one of this recording")
    truth = read_trajectory(found[0])
    if camera.fy < 0:
        return truth
    return Trajectory(truth.timestamps, _MIRROR @ truth.poses @ _MIRROR)
