"""Which points of a model are a surface."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from nacre import _core
from nacre._internal import arrays


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
