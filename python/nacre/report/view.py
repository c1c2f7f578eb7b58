"""Projections of a model onto a picture."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre._internal.arrays import as_points, as_pose

Array = npt.NDArray[np.float64]
Float32 = npt.NDArray[np.float32]

#: For each named side: where the viewer is, seen from the model, and which way is down in the picture. The
#: model is in the first camera's frame (x right, y down, z forward), so that the front is what the first
#: camera saw.
SIDES: dict[str, tuple[tuple[float, float, float], tuple[float, float, float]]] = {
    "front": ((0, 0, -1), (0, 1, 0)),
    "right": ((1, 0, 0), (0, 1, 0)),
    "back": ((0, 0, 1), (0, 1, 0)),
    "left": ((-1, 0, 0), (0, 1, 0)),
    "top": ((0, -1, 0), (0, 0, -1)),
    "bottom": ((0, 1, 0), (0, 0, 1)),
}


@dataclass(frozen=True, eq=False)
class View:
    """A projection of the model onto a picture: parallel, or as seen from a point."""

    view_from_model: Array  #: (3, 3): picture right, picture down, away from the viewer
    center: Array  #: (3,): the point in the middle of the picture [m]
    metres_per_pixel: float  #: at the center
    size: tuple[int, int]  #: width, height [pixels]
    distance: float = math.inf  #: from the viewer to the center [m]; infinite: parallel

    @classmethod
    def fit(
        cls,
        points: npt.ArrayLike,
        view_from: str | Sequence[float] = "front",
        *,
        size: tuple[int, int] = (600, 600),
        metres_per_pixel: float | None = None,
        outliers: float = 0.001,
    ) -> View:
        """
        Return the parallel view that shows the whole model with a small margin.

        Parameters
        ----------
        points : array_like, shape (N, 3)
            The model [m].
        view_from : str or three numbers, optional
            "front", "right", "back", "left", "top", "bottom", or the direction from the model to the viewer.
        size : (int, int), optional
            Width and height of the picture [pixels].
        metres_per_pixel : float, optional
            Scale, where several views are to have the same.
        outliers : float, optional
            Part of the points that may lie outside, on each side.
        """
        _check_size(size)
        rotation = _rotation(view_from)
        array = as_points("points", points)
        array = array[np.isfinite(array).all(axis=1)]
        if not len(array):
            return cls(rotation, np.zeros(3), metres_per_pixel or 1.0, size)
        low, high = np.percentile(array @ rotation.T, (100 * outliers, 100 - 100 * outliers), axis=0)
        if metres_per_pixel is None:
            extent = float(((high - low)[:2] / (0.92 * np.asarray(size))).max())
            metres_per_pixel = extent if extent > 0 else 1.0
        return cls(rotation, rotation.T @ ((low + high) / 2), float(metres_per_pixel), size)

    @classmethod
    def from_camera(
        cls, points: npt.ArrayLike, world_from_camera: npt.ArrayLike, *, size: tuple[int, int] = (640, 480)
    ) -> View:
        """
        Return the perspective view of a camera, 20 to 75 degrees wide, as the model in front of it asks.

        Parameters
        ----------
        points : array_like, shape (N, 3)
            The model [m].
        world_from_camera : array_like, shape (4, 4)
            Where the camera is.
        size : (int, int), optional
            Width and height of the picture [pixels].
        """
        _check_size(size)
        pose = as_pose("world_from_camera", world_from_camera)
        array = as_points("points", points)
        seen = (array[np.isfinite(array).all(axis=1)] - pose[:3, 3]) @ pose[:3, :3]
        seen = seen[seen[:, 2] > 0]
        seen = seen[(np.abs(seen[:, :2]) < seen[:, 2:]).all(axis=1)]
        distance, tangent = 1.0, 1.0
        if len(seen):
            distance = float(np.median(seen[:, 2]))
            reach = np.percentile(np.abs(seen[:, :2] / seen[:, 2:]), 97, axis=0)
            tangent = float((reach * max(size) / np.asarray(size)).max())
        tangent = min(max(1.05 * tangent, math.tan(math.radians(10))), math.tan(math.radians(37.5)))
        center = pose[:3, 3] + distance * pose[:3, 2]
        return cls(pose[:3, :3].T, center, 2 * tangent * distance / max(size), size, distance)

    def project(self, points: npt.NDArray[np.floating[Any]]) -> tuple[Float32, Float32]:
        """
        Return where points appear, and the length that a pixel has there [m].

        Columns are right and down of the picture's middle and away from the viewer, all in pixels of the
        point's own scale: for a perspective that makes the third the logarithm of the depth. NaN for points
        behind the viewer.
        """
        with np.errstate(invalid="ignore"):  # points that are not finite
            local = (points - self.center) @ self.view_from_model.T
        if math.isinf(self.distance):
            scale = np.full(len(local), self.metres_per_pixel)
            return (local / self.metres_per_pixel).astype(np.float32), scale.astype(np.float32)
        ratio = 1 + local[:, 2] / self.distance
        ratio = np.where(ratio > 1e-3, ratio, np.nan)
        scale = self.metres_per_pixel * ratio
        depth = self.distance / self.metres_per_pixel * np.log(ratio)
        seen = np.column_stack([local[:, :2] / scale[:, None], depth])
        return seen.astype(np.float32), scale.astype(np.float32)

    def face(self, normals: npt.NDArray[np.floating[Any]], points: npt.NDArray[np.floating[Any]]) -> Float32:
        """
        Return normals in the picture: right, down, and along the ray to each point, of unit length.

        So the depth of a point's plane rises by -x / z per pixel to the right, also in a perspective. Zero
        and NaN normals face the viewer.
        """
        with np.errstate(invalid="ignore"):
            facing = normals @ self.view_from_model.T
            if not math.isinf(self.distance):
                local = (points - self.center) @ self.view_from_model.T
                ray = local[:, :2] / (local[:, 2:] + self.distance)
                facing[:, 2] += (facing[:, :2] * ray).sum(axis=1)
        length = np.linalg.norm(facing, axis=1, keepdims=True)
        known = length > 0  # False for NaN
        return np.where(known, facing / np.where(known, length, 1), (0, 0, -1)).astype(np.float32)


def _check_size(size: tuple[int, int]) -> None:
    if not (len(size) == 2 and all(side == int(side) and side >= 1 for side in size)):
        raise ValueError(f"size must be a width and a height of at least one pixel, got {size!r}")


def _rotation(view_from: str | Sequence[float]) -> Array:
    if isinstance(view_from, str):
        if view_from not in SIDES:
            raise ValueError(
                f"view_from must be one of {', '.join(SIDES)}, or a direction, got {view_from!r}"
            )
        toward, down = (np.array(axis, dtype=np.float64) for axis in SIDES[view_from])
    else:
        toward = np.asarray(view_from, dtype=np.float64)
        if toward.shape != (3,) or not np.isfinite(toward).all() or not toward.any():
            raise ValueError(
                f"view_from must be a side's name or three numbers that are not all 0, got {view_from!r}"
            )
        down = np.array([0.0, 1.0, 0.0])
    forward = -toward / np.linalg.norm(toward)
    right = np.cross(down, forward)
    if np.linalg.norm(right) < 1e-6:
        right = np.array([1.0, 0.0, 0.0])
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(forward, right), forward])
