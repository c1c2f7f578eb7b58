"""Which points of a model are a surface."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from nacre import _core
from nacre._internal import arrays
from nacre._internal.guided import guided
from nacre.meshing.triangulation import triangulate

_LEAST_OF_OBJECT = 0.01  # of the points of its largest part, tuned: smaller ones lie beside it


@guided("a Model has normals and confidence; model.cloud() has its points that are a surface")
def on_surface(
    points: npt.ArrayLike, normals: npt.ArrayLike, confidence: npt.ArrayLike, *, num_threads: int = 0
) -> npt.NDArray[np.bool_]:
    """
    Tell the points of a model that are a surface from litter, doubled layers, and normals that contradict.

    Parameters
    ----------
    points, normals : (N, 3) array_like
        [m], and vectors of any length that point out of the surface.
    confidence : (N,) array_like
        How sure each point is, in any unit.
    num_threads : int
        0 uses all. The result does not depend on it.

    Returns
    -------
    (N,) bool

    Raises
    ------
    TypeError, ValueError
        Arrays of the wrong type or shape.

    Notes
    -----
    A point is left out where surer ones cover it: points on the same side of the surface (normals within 60
    degrees) that lie above it, or below it, on all sides, since of two layers so near each other only one can
    be seen. Of the others those stay that :func:`triangulate` joins to a part of at least 30.
    """
    positions = arrays.as_points("points", points)
    directions = arrays.as_unit_rows("normals", normals, "points", len(positions))
    sure = arrays.as_rows(arrays.as_values("confidence", confidence, len(positions), "point"), np.float32)
    flags = _core.on_surface(
        arrays.localize(positions)[0], directions, sure, arrays.as_count("num_threads", num_threads)
    )
    return flags.astype(bool)


def on_main_parts(
    points: npt.NDArray[np.float32], normals: npt.NDArray[np.float32], *, num_threads: int = 0
) -> npt.NDArray[np.bool_]:
    """
    Tell the points of an object from small parts that no triangle joins to it.

    Parameters
    ----------
    points, normals : (N, 3) float32
        [m], and unit vectors.
    num_threads : int
        0 uses all. The result does not depend on it.

    Returns
    -------
    (N,) bool
    """
    if not len(points):
        return np.zeros(0, bool)
    parts = _core.connected_parts(triangulate(points, normals, num_threads=num_threads), len(points))
    sizes = np.bincount(parts)
    return np.asarray(sizes[parts] >= _LEAST_OF_OBJECT * sizes.max())


def surface_rows(
    points: npt.NDArray[np.float32],
    normals: npt.NDArray[np.float32],
    confidence: npt.ArrayLike,
    *,
    is_object: bool,
) -> npt.NDArray[np.int64]:
    """Return which points of a model are written: those on a surface, of an object without small parts."""
    rows = np.flatnonzero(on_surface(points, normals, confidence))
    return rows[on_main_parts(points[rows], normals[rows])] if is_object else rows
