"""Which views show surfaces from behind."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from nacre._internal.arrays import as_matching_points, as_points
from nacre.rendering import View

_MOST_POINTS = 50_000  # tell it well enough


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
    rows = slice(None, None, -(-len(cloud) // _MOST_POINTS) or 1)
    seen = view.project(cloud[rows])
    facing = as_matching_points("normals", normals, "points", len(cloud))[rows] @ view.view_from_model.T
    if math.isinf(view.distance):
        reverse = facing[:, 2] > 0
    else:
        focal_length = view.distance / view.metres_per_pixel
        reverse = (facing[:, :2] * seen[:, :2]).sum(axis=1) + facing[:, 2] * focal_length > 0
    inside = (np.abs(seen[:, :2]) < np.asarray(view.size) / 2).all(axis=1)  # False for NaN
    seen, reverse = seen[inside], reverse[inside]
    if not len(seen):
        return 0.0, 0.0
    cell = (seen[:, :2] // 12).astype(np.int64) @ (1 << 20, 1)
    order = np.lexsort((seen[:, 2], cell))
    _, nearest = np.unique(cell[order], return_index=True)
    return float(reverse[order[nearest]].mean()), float(reverse.mean())
