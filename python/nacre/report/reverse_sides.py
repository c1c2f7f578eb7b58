"""Which views show surfaces from behind."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from nacre._internal.arrays import as_matching_points, as_points
from nacre.rendering import View

_MOST_POINTS = 50_000  # tell it well enough


@dataclass(frozen=True)
class ReverseParts:
    """Which part of the nearest and which part of all points in a picture turn their back to it."""

    nearest: float
    all: float

    @property
    def from_behind(self) -> bool:
        """Whether the picture mostly shows reverse sides of surfaces."""
        return self.nearest > 0.5

    @property
    def inside_out(self) -> bool:
        """Whether hiding them would show the front: so a room is seen through one of its walls."""
        return self.from_behind and self.all < 0.75


def reverse_parts(points: npt.ArrayLike, normals: npt.ArrayLike | None, view: View) -> ReverseParts:
    """Return how much of a picture of a model shows reverse sides of surfaces; nothing without normals."""
    if normals is None:
        return ReverseParts(0.0, 0.0)
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
        return ReverseParts(0.0, 0.0)
    cell = (seen[:, :2] // 12).astype(np.int64) @ (1 << 20, 1)
    order = np.lexsort((seen[:, 2], cell))
    _, nearest = np.unique(cell[order], return_index=True)
    return ReverseParts(float(reverse[order[nearest]].mean()), float(reverse.mean()))
