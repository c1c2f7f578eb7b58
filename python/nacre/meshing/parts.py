"""The parts of a mesh that no edge joins."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from nacre import _core
from nacre._internal import arrays


def largest_part(triangles: npt.ArrayLike) -> npt.NDArray[np.int32]:
    """
    Return the triangles of the part that has most of them.

    Parameters
    ----------
    triangles : (T, 3) array_like of integers
        Vertex indices. Triangles with a common vertex are in one part.

    Returns
    -------
    (S, 3) int32
        In their order; of parts of one size that of the smallest vertex.

    Raises
    ------
    TypeError, ValueError
        Not triangles, or indices below 0.
    """
    given = arrays.as_array("triangles", triangles)
    if given.shape == (0, 3):
        return given.astype(np.int32)
    num_vertices = int(given.max(initial=-1)) + 1 if given.dtype.kind in "iu" else 0
    corners = arrays.as_triangles("triangles", given, num_vertices)
    parts = _core.connected_parts(corners, num_vertices)[corners[:, 0]]
    largest: npt.NDArray[np.int32] = corners[parts == np.bincount(parts).argmax()]
    return largest
