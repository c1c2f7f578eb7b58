"""Fewer triangles."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from nacre._internal import arrays

_MISSING = 'fewer triangles need fast-simplification: pip install "nacre[simplify]"'

_EDGE = 10.0  # of the triangles, in the library's units: its thresholds begin well below one and grow slowly


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
        At least 1. Where there are no more, vertices and triangles come back as they are. A few more may be
        left where no edge can go without folding the surface.

    Returns
    -------
    vertices : (N, 3) float32 or float64
        [m], in the type of those given.
    triangles : (M, 3) int32

    Raises
    ------
    TypeError, ValueError
        Arguments of the wrong type or shape.
    ImportError
        When fast-simplification is missing, with the command that installs it.

    Notes
    -----
    M. Garland and P. S. Heckbert, "Surface Simplification Using Quadric Error Metrics", 1997.
    """
    points = arrays.as_points("vertices", vertices)
    corners = arrays.as_triangles("triangles", triangles, len(points))
    wanted = arrays.as_count("num_triangles", num_triangles, minimum=1)
    if len(corners) <= wanted:
        return points, corners
    try:
        import fast_simplification
    except ImportError as error:
        raise ImportError(_MISSING, name="fast_simplification") from error
    local, origin = arrays.localize(points)
    edges = np.linalg.norm(local[corners[:, 0]] - local[corners[:, 1]], axis=1)
    unit = float(np.median(edges)) / _EDGE or 1.0
    fewer, left = fast_simplification.simplify(local / np.float32(unit), corners, target_count=wanted)
    return (unit * fewer + origin).astype(points.dtype), np.ascontiguousarray(left, np.int32)
