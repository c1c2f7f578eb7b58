"""Pictures of point models, drawn in memory with numpy."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from nacre._internal.arrays import as_matching_points, as_points
from nacre.report.splat import Canvas
from nacre.report.view import View

Array = npt.NDArray[np.float64]


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
    colors : array_like of uint8, shape (N, 3), optional
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
        colors = np.asarray(colors)
        if colors.shape != cloud.shape or colors.dtype != np.uint8:
            raise ValueError(
                f"colors must be uint8 of shape {cloud.shape}, got {colors.dtype} {colors.shape}"
            )
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

    seen, scale = view.project(cloud)
    facing = view.face(normals, cloud)
    drawn = np.isfinite(seen).all(axis=1)
    if hide_reverse:
        drawn &= facing[:, 2] < 0
    canvas = Canvas(view.size)
    canvas.draw(
        seen[drawn],
        facing[drawn],
        radius[drawn].astype(np.float32) / scale[drawn],
        None if colors is None else colors[drawn],
    )
    return canvas.picture(background)


def reverse_part(points: npt.ArrayLike, normals: npt.ArrayLike, view: View) -> float:
    """Return which part of a picture of a model would show reverse sides of surfaces."""
    return _reverse_parts(points, normals, view)[0]


def is_inside_out(points: npt.ArrayLike, normals: npt.ArrayLike, view: View) -> bool:
    """
    Return whether a view shows a model from behind, and hiding its reverse sides would show its front.

    That is so for a room that is seen through one of its walls.
    """
    in_picture, in_model = _reverse_parts(points, normals, view)
    return in_picture > 0.5 and in_model < 0.75


def _reverse_parts(points: npt.ArrayLike, normals: npt.ArrayLike, view: View) -> tuple[float, float]:
    """Return which part of the nearest and which part of all points in a picture turn their back to it."""
    cloud = as_points("points", points)
    seen, _ = view.project(cloud)
    reverse = view.face(as_matching_points("normals", normals, "points", len(cloud)), cloud)[:, 2] > 0
    inside = (np.abs(seen[:, :2]) < np.asarray(view.size) / 2).all(axis=1)  # False for NaN
    seen, reverse = seen[inside], reverse[inside]
    if not len(seen):
        return 0.0, 0.0
    cell = (seen[:, :2] // 12).astype(np.int64) @ (1 << 20, 1)
    order = np.lexsort((seen[:, 2], cell))
    _, nearest = np.unique(cell[order], return_index=True)
    return float(reverse[order[nearest]].mean()), float(reverse.mean())


def measure_spacing(points: npt.ArrayLike, most: float = 2.0) -> Array:
    """
    Return how far each point's disk must reach to meet the disks around it.

    That is the distance to the fourth neighbour: on a regular lattice all of the ring, at a border still the
    half of it. None gets more than ``most`` medians: outliers stay small, or far walls become closed. Where
    points are spread evenly, none gets more than 19 of 20 ask for, so that thin strips are not drawn as wide.
    """
    from nacre import KdTree

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


def nearest_distances(points: npt.ArrayLike) -> Array:
    """Return how far each point is from the nearest other one; 0 for a lone point."""
    from nacre import KdTree

    cloud = as_points("points", points)
    if len(cloud) < 2:
        return np.zeros(len(cloud))
    return np.asarray(KdTree(cloud).query(cloud, k=2)[0], dtype=np.float64)[:, 1]


def _normals_towards(view: View, cloud: npt.NDArray[np.floating]) -> npt.NDArray[np.floating]:
    from nacre import estimate_normals

    viewer = view.center - 1e3 * view.metres_per_pixel * max(view.size) * view.view_from_model[2]
    return np.asarray(estimate_normals(cloud, viewpoint=tuple(viewer)))
