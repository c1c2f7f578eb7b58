"""Fewer triangles."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from nacre import _core
from nacre._internal import arrays
from nacre._internal.guided import guided
from nacre._internal.mesh_library import gpytoolbox


@guided("it is simplify(mesh.vertices, mesh.triangles, num_triangles)")
def simplify(
    vertices: npt.ArrayLike, triangles: npt.ArrayLike, num_triangles: int
) -> tuple[arrays.FloatArray, npt.NDArray[np.int32]]:
    """
    Collapse the edges that matter least, until no more triangles are left than wanted.

    Parameters
    ----------
    vertices : (V, 3) array_like of real numbers
        [m].
    triangles : (T, 3) array_like of integers
        Vertex indices.
    num_triangles : int
        At least 1. Where there are no more, vertices and triangles come back as they are. More are left
        where no edge can go: parts and holes do not vanish.

    Returns
    -------
    vertices : (N, 3) float32 or float64
        [m], in the type of those given. Where parts touch in a vertex, each has its own.
    triangles : (M, 3) int32
        No edge has more than two, if each side of an edge had at most one.

    Raises
    ------
    TypeError, ValueError
        Arguments of the wrong type or shape.
    ImportError
        When gpytoolbox is missing, with the command that installs it.

    Notes
    -----
    M. Garland and P. S. Heckbert, "Surface Simplification Using Quadric Error Metrics", 1997.
    """
    points = arrays.as_points("vertices", vertices)
    corners = arrays.as_triangles("triangles", triangles, len(points))
    wanted = arrays.as_count("num_triangles", num_triangles, minimum=1)
    if len(corners) <= wanted:
        return points, corners
    library = gpytoolbox("fewer triangles", "simplify")
    local, origin = arrays.localize(points)
    rows, manifold = _split_where_parts_touch(corners)
    fewer, left, *_ = library.decimate(local[rows], manifold, num_faces=wanted, method="qslim")
    return (fewer + origin).astype(points.dtype), np.ascontiguousarray(left, np.int32)


def _split_where_parts_touch(
    triangles: npt.NDArray[np.int32],
) -> tuple[npt.NDArray[np.int32], npt.NDArray[np.int32]]:
    """Give each fan of triangles around a vertex its own; return their rows, and the triangles."""
    begins, ends = triangles.ravel(), triangles[:, [1, 2, 0]].ravel()
    corners = np.arange(triangles.size, dtype=np.int32)
    next_corners = corners.reshape(-1, 3)[:, [1, 2, 0]].ravel()
    # Two triangles that have an edge, one in each direction, have its ends in common.
    size = np.int64(triangles.max()) + 1
    _, there, back = np.intersect1d(begins * size + ends, ends * size + begins, return_indices=True)
    begin, end = next_corners[back], next_corners[there]
    same = np.concatenate([[there, begin, begin], [end, back, back]], axis=1)
    fans = _core.connected_parts(np.ascontiguousarray(same.T, np.int32), triangles.size)
    _, first, labels = np.unique(fans, return_index=True, return_inverse=True)
    return begins[first], labels.reshape(-1, 3).astype(np.int32)
