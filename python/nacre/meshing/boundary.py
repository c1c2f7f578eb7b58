"""Where a surface ends: its edges of one triangle, joined into loops."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from nacre._internal import arrays
from nacre._internal.guided import guided


@guided()
def boundary_loops(triangles: npt.ArrayLike) -> list[npt.NDArray[np.int32]]:
    """
    Return the loops of edges that have a triangle on one side alone.

    Parameters
    ----------
    triangles : (T, 3) array_like of integers
        Vertex indices; two triangles that share an edge run along it in opposite directions, as those of
        :func:`triangulate` do.

    Returns
    -------
    list of (L,) int32
        The vertices of each loop, the longest first, in the order in which the triangles run: seen from
        outside, the rim of a surface is counter-clockwise, and a hole in it clockwise. Surfaces that touch
        in one vertex have loops of their own; two holes that do are one loop, which passes it twice. A closed
        surface has none.

    Raises
    ------
    TypeError, ValueError
        Not triangles, indices below 0, or an edge that two triangles run along in the same direction.
    """
    given = arrays.as_array("triangles", triangles)
    if given.shape == (0, 3):
        return []
    num_vertices = int(given.max(initial=-1)) + 1 if given.dtype.kind in "iu" else 0
    corners = arrays.as_triangles("triangles", given, num_vertices)
    twins = _twins(corners, num_vertices)
    border = np.flatnonzero(twins < 0)
    following = _next_in_triangle(border)
    while (is_inside := twins[following] >= 0).any():  # turn about the vertex, triangle by triangle
        following[is_inside] = _next_in_triangle(twins[following[is_inside]])
    places = np.searchsorted(border, following).tolist()
    loops = [corners.reshape(-1)[border[cycle]] for cycle in _cycles(places)]
    return sorted(loops, key=len, reverse=True)


def _twins(corners: npt.NDArray[np.int32], num_vertices: int) -> npt.NDArray[np.int64]:
    """Return for each half-edge, 3 t + i from corner i of triangle t on, the one that runs back; -1: none."""
    starts = corners.reshape(-1).astype(np.int64)
    ends = np.roll(corners, -1, axis=1).reshape(-1).astype(np.int64)
    keys, back = starts * num_vertices + ends, ends * num_vertices + starts
    order = np.argsort(keys, kind="stable")
    ordered = keys[order]
    doubled = np.flatnonzero(ordered[1:] == ordered[:-1])
    if len(doubled):
        a, b = divmod(int(ordered[doubled[0]]), num_vertices)
        raise ValueError(
            f"triangles must run along each edge once in each direction, got two from vertex {a} to {b}"
        )
    places = np.minimum(np.searchsorted(ordered, back), len(order) - 1)
    return np.where(ordered[places] == back, order[places], -1)


def _next_in_triangle(half_edges: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
    return np.where(half_edges % 3 == 2, half_edges - 2, half_edges + 1)


def _cycles(following: list[int]) -> list[list[int]]:
    """Return the cycles of a permutation."""
    is_new, cycles = [True] * len(following), []
    for start in range(len(following)):
        cycle, at = [], start
        while is_new[at]:
            is_new[at] = False
            cycle.append(at)
            at = following[at]
        if cycle:
            cycles.append(cycle)
    return cycles
