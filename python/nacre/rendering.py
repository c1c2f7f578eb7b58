"""Pictures of point models: projections onto a picture, and what is seen there."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre import _core
from nacre._internal.arrays import as_colors, as_matching_points, as_points, as_pose
from nacre.kdtree import KdTree
from nacre.normals import estimate_normals

Array = npt.NDArray[np.float64]

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
#: Where the viewer is for a picture from the front, seen from the model: from above at an angle.
OBLIQUE = (-0.75, -0.55, -1.0)


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

    def project(self, points: npt.NDArray[np.floating[Any]]) -> Array:
        """Return where points are: right and down of the picture's middle [pixels], and their depth [m]."""
        with np.errstate(invalid="ignore"):  # points that are not finite
            local: Array = (points - self.center) @ self.view_from_model.T
        ratio = 1 + local[:, 2:] / self.distance
        local[:, :2] /= self.metres_per_pixel * np.where(ratio > 1e-3, ratio, np.nan)
        return local


def render_points(
    points: npt.ArrayLike,
    normals: npt.ArrayLike | None = None,
    colors: npt.ArrayLike | None = None,
    *,
    view_from: str | Sequence[float] = "front",
    size: tuple[int, int] = (600, 600),
    view: View | None = None,
    spacing: npt.ArrayLike | None = None,
    hide_reverse: bool = False,
    background: tuple[int, int, int] | None = (255, 255, 255),
) -> npt.NDArray[np.uint8]:
    """
    Draw a point model as a closed, shaded surface.

    Every point is a disk in the plane of its normal, as large as the distance to its neighbours asks for, so
    that no holes appear; disks that overlap at the same depth are blended. The light comes from the viewer,
    and places that lie behind their surroundings are a little darker.

    Parameters
    ----------
    points : array_like, shape (N, 3)
        The model [m]; rows that are not finite are left out.
    normals : array_like, shape (N, 3), optional
        Outward normals. Sides turned away from the viewer are drawn in brown. Without normals (or where they
        are not finite) the disks face the viewer.
    colors : array_like of integers from 0 to 255 or floats from 0 to 1, shape (N, 3), optional
        Colours of the points; they are shaded gently. Default: light grey.
    view_from : str or three numbers, optional
        "front" (what the first camera saw), "right", "back", "left", "top", "bottom", or the direction from
        the model to the viewer.
    size : (int, int), optional
        Width and height of the picture [pixels].
    view : View, optional
        A projection made before; ``view_from`` and ``size`` are then not used.
    spacing : float or array_like, shape (N,), optional
        Distance between neighbouring points [m]. Default: measured at every point.
    hide_reverse : bool, optional
        Leave out points whose normal turns away from the viewer: one looks into a room from outside.
    background : three ints or None, optional
        Colour behind the model; None makes it transparent.

    Returns
    -------
    numpy.ndarray of uint8, shape (H, W, 3), or (H, W, 4) where ``background`` is None

    Examples
    --------
    >>> import numpy as np
    >>> points = np.random.default_rng(0).normal(size=(500, 3))
    >>> points /= np.linalg.norm(points, axis=1, keepdims=True)
    >>> render_points(points, normals=points, view_from="top", size=(64, 48), spacing=0.1).shape
    (48, 64, 3)
    """
    cloud = as_points("points", points)
    finite = np.isfinite(cloud).all(axis=1)
    if colors is not None:
        colors = as_colors("colors", colors, cloud.shape)
    if view is None:
        view = View.fit(cloud, view_from, size=size)
    if normals is None:
        normals = _normals_towards(view, cloud)
    normals = as_matching_points("normals", normals, "points", len(cloud))
    if spacing is None:
        radius = measure_spacing(cloud)
    else:
        radius = np.broadcast_to(np.asarray(spacing, dtype=np.float64), (len(cloud),))
        if not (radius[finite] > 0).all():
            raise ValueError("spacing must be positive")

    with np.errstate(over="ignore"):
        normals = np.asarray(normals, dtype=np.float32)
    picture = _core.render_points(
        np.asarray(cloud, dtype=np.float64),
        normals,
        np.zeros((0, 3), np.uint8) if colors is None else colors,
        radius.astype(np.float32),
        view_from_model=view.view_from_model,
        center=view.center,
        metres_per_pixel=view.metres_per_pixel,
        distance=view.distance,
        width=view.size[0],
        height=view.size[1],
        hide_reverse=hide_reverse,
        num_threads=0,
    )
    return picture if background is None else _on_background(picture, background)


def _on_background(picture: npt.NDArray[np.uint8], color: tuple[int, int, int]) -> npt.NDArray[np.uint8]:
    opacity = picture[:, :, 3:] / np.float32(255)
    mixed = picture[:, :, :3] * opacity + (1 - opacity) * np.asarray(color, np.float32)
    return mixed.round().astype(np.uint8)


def measure_spacing(points: npt.ArrayLike, most: float = 2.0) -> Array:
    """
    Return how far each point's disk must reach to meet the disks around it.

    That is the distance to the fourth neighbour: on a regular lattice all of the ring, at a border still the
    half of it. None gets more than ``most`` medians: outliers stay small, or far walls become closed. Where
    points are spread evenly, none gets more than 19 of 20 ask for, so that thin strips are not drawn as wide.
    """
    cloud = as_points("points", points)
    spacing = np.ones(len(cloud))
    finite = np.isfinite(cloud).all(axis=1)
    usable = cloud[finite]
    if len(usable) > 1:
        distance = np.asarray(KdTree(usable).query(usable, k=min(5, len(usable)))[0], dtype=np.float64)[:, -1]
        typical = float(np.median(distance))
        widest = float(np.quantile(distance, 0.95))
        if typical > 0:
            limit = widest if widest < 2 * typical else most * typical
            spacing[finite] = np.clip(distance, 0.05 * typical, limit)
    return spacing


def _normals_towards(view: View, cloud: npt.NDArray[np.floating]) -> npt.NDArray[np.floating]:
    viewer = view.center - 1e3 * view.metres_per_pixel * max(view.size) * view.view_from_model[2]
    return np.asarray(estimate_normals(cloud, viewpoint=tuple(viewer)))


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
