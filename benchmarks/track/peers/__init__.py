"""
The loops that users compose of other libraries, one module each.

A module has ``make(camera, voxel)``, which gets the camera and the grid of the model [m] and returns a
:class:`Loop`; the import of the library belongs into it.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[Any]

ANY_CAMERA = ("open3d_icp", "open3d_icp_eroded", "small_gicp_vgicp_eroded", "kiss_icp_eroded")
PINHOLE = ("open3d_odometry", "open3d_slam", "opencv_odometry", "opencv_tsdf")
NEAR = tuple(f"{name}_near" for name in ("open3d_icp", *PINHOLE))

TITLES = {
    "open3d_icp": "Open3D: ICP to a voxel model",
    "open3d_icp_eroded": "Open3D: the same, 2 px eroded at edges",
    "open3d_odometry": "Open3D: RGB-D odometry, depth only",
    "open3d_slam": "Open3D: TSDF and ray casting",
    "opencv_odometry": "OpenCV: Odometry, depth",
    "opencv_tsdf": "OpenCV: HashTSDF and ray casting",
    "small_gicp_vgicp_eroded": "small_gicp: VGICP to a voxel map, 2 px eroded",
    "kiss_icp_eroded": "KISS-ICP, 2 px eroded",
}
TITLES |= {name: f"{TITLES[name.removesuffix('_near')]}, cut at 1.5 m by hand" for name in NEAR}

FAR = 3.0
"""Farther measurements are not used by peers [m]: the default of Open3D's RGB-D images, odometry and SLAM."""
CUT = 1.5
"""Where it is cut for the loops that get it cut by hand [m]."""


class Loop(Protocol):
    """Tracks a camera frame by frame. The world is the first camera's frame."""

    def add(self, depth: Array) -> Array | None:
        """Return the pose (world_from_camera) of the next image; None where tracking failed."""

    def points(self) -> Array:
        """Return the model; (0, 3) where there is none."""


def make(name: str, camera: Any, depth: Array, voxel: float = 0.0) -> Loop:
    """Return a peer's loop for a camera; voxel 0 is twice a pixel of the first image."""
    ending = next((ending for ending in CHANGES if name.endswith(ending)), "")
    module = importlib.import_module(f"track.peers.{name.removesuffix(ending)}")
    loop: Loop = module.make(camera, voxel or voxel_size(camera, depth))
    return Changed(loop, CHANGES[ending]) if ending else loop


class Changed:
    """Gives a loop images that are changed first."""

    def __init__(self, loop: Loop, change: Callable[[Array], Array]) -> None:
        self._loop, self._change = loop, change

    def add(self, depth: Array) -> Array | None:
        """Change the image, then track."""
        return self._loop.add(self._change(depth))

    def points(self) -> Array:
        """Return the model."""
        return self._loop.points()


def erode(depth: Array, pixels: int = 2, jump: float = 0.02) -> Array:
    """Remove pixels near a jump of so much (relative to the depth) or near a missing pixel."""
    z = np.where(np.isfinite(depth), depth, np.inf)
    edge = np.isinf(z)
    for axis in (0, 1):
        with np.errstate(invalid="ignore"):
            step = np.abs(np.diff(z, axis=axis)) > jump * np.minimum(
                *(np.take(z, range(k, z.shape[axis] - 1 + k), axis=axis) for k in (0, 1))
            )
        before, after = [(0, 0), (0, 0)], [(0, 0), (0, 0)]
        before[axis], after[axis] = (1, 0), (0, 1)
        edge |= np.pad(step, before) | np.pad(step, after)
    for _ in range(pixels - 1):
        wide = np.pad(edge, 1)
        edge = wide[1:-1, 1:-1] | wide[:-2, 1:-1] | wide[2:, 1:-1] | wide[1:-1, :-2] | wide[1:-1, 2:]
    return np.where(edge, np.float32(np.nan), depth)


def cut_by_hand(depth: Array) -> Array:
    """Remove what is farther than 1.5 m."""
    return np.where(depth < CUT, depth, np.float32(np.nan))


CHANGES = {"_eroded": erode, "_near": cut_by_hand}
"""Of the images, by the ending of the loop's name."""


def voxel_size(camera: Any, depth: Array) -> float:
    """Return the grid of a peer's model: twice a pixel at the middle depth, as nacre's spacing [m]."""
    if camera.model == "orthographic":
        return float(2 * camera.pixel_size)
    return float(2 * np.nanmedian(np.where(depth < FAR, depth, np.nan)) / camera.fx)


def intrinsics(camera: Any) -> Array:
    """Return the matrix of a pinhole camera."""
    return np.array([[camera.fx, 0, camera.cx], [0, camera.fy, camera.cy], [0, 0, 1]])


def cut(camera: Any, depth: Array) -> Array:
    """Return the image without what is too far for peers; an orthographic camera has no far."""
    return depth if camera.model == "orthographic" else np.where(depth < FAR, depth, np.float32(np.nan))
