"""The parts of a mesh that no edge joins."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from nacre import _core
from nacre._internal import arrays
from nacre._internal.guided import guided


@guided()
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
    corners, parts = _labelled(triangles)
    largest: npt.NDArray[np.int32] = corners[parts == np.bincount(parts, minlength=1).argmax()]
    return largest


@guided()
def part_sizes(triangles: npt.ArrayLike) -> npt.NDArray[np.int64]:
    """
    Return of how many triangles each part consists, the largest first.

    Parameters
    ----------
    triangles : (T, 3) array_like of integers
        Vertex indices. Triangles with a common vertex are in one part.

    Returns
    -------
    (P,) int64

    Raises
    ------
    TypeError, ValueError
        Not triangles, or indices below 0.
    """
    return np.sort(np.unique(_labelled(triangles)[1], return_counts=True)[1])[::-1].astype(np.int64)


def _labelled(triangles: npt.ArrayLike) -> tuple[npt.NDArray[np.int32], npt.NDArray[np.integer]]:
    """Return triangles as an array, and the number of the part of each."""
    given = arrays.as_array("triangles", triangles)
    if given.shape == (0, 3):
        return given.astype(np.int32), np.zeros(0, np.int32)
    num_vertices = int(given.max(initial=-1)) + 1 if given.dtype.kind in "iu" else 0
    corners = arrays.as_triangles("triangles", given, num_vertices)
    return corners, _core.connected_parts(corners, num_vertices)[corners[:, 0]]
