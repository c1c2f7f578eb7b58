"""Parallel projections of a model onto a picture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from nacre.arrays import as_points

Array = npt.NDArray[np.float64]

#: For each named side: where the viewer is, seen from the model, and which way is down in the picture. The model is in
#: the first camera's frame (x right, y down, z forward), so that the front is what the first camera saw.
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
    """A parallel projection of the model onto a picture."""

    view_from_model: Array  #: (3, 3): picture right, picture down, away from the viewer
    center: Array  #: (3,): the point in the middle of the picture [m]
    metres_per_pixel: float
    size: tuple[int, int]  #: width, height [pixels]

    @classmethod
    def fit(
        cls,
        points: npt.ArrayLike,
        view_from: str | Sequence[float] = "front",
        *,
        size: tuple[int, int] = (600, 600),
        metres_per_pixel: float | None = None,
    ) -> View:
        """
        Return the view that shows all points, up to a thousandth of outliers on each side, with a small margin.

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
        """
        if not (len(size) == 2 and all(side == int(side) and side >= 1 for side in size)):
            raise ValueError(f"size must be a width and a height of at least one pixel, got {size!r}")
        rotation = _rotation(view_from)
        array = as_points("points", points)
        array = array[np.isfinite(array).all(axis=1)]
        if not len(array):
            return cls(rotation, np.zeros(3), metres_per_pixel or 1.0, size)
        seen = array @ rotation.T
        low, high = np.percentile(seen, (0.1, 99.9), axis=0)
        middle = (low + high) / 2
        if metres_per_pixel is None:
            extent = float(((high - low)[:2] / (0.92 * np.asarray(size))).max())
            metres_per_pixel = extent if extent > 0 else 1.0
        return cls(rotation, rotation.T @ middle, float(metres_per_pixel), size)


def _rotation(view_from: str | Sequence[float]) -> Array:
    if isinstance(view_from, str):
        if view_from not in SIDES:
            raise ValueError(f"view_from must be one of {', '.join(SIDES)}, or a direction, got {view_from!r}")
        toward, down = (np.array(axis, dtype=np.float64) for axis in SIDES[view_from])
    else:
        toward = np.asarray(view_from, dtype=np.float64)
        if toward.shape != (3,) or not np.isfinite(toward).all() or not toward.any():
            raise ValueError(f"view_from must be a side's name or three numbers that are not all 0, got {view_from!r}")
        down = np.array([0.0, 1.0, 0.0])
    forward = -toward / np.linalg.norm(toward)
    right = np.cross(down, forward)
    if np.linalg.norm(right) < 1e-6:
        right = np.array([1.0, 0.0, 0.0])
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(forward, right), forward])
