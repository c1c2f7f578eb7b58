"""Triangles that join the points of a model."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from nacre import _core
from nacre._internal import arrays
from nacre._internal.guided import guided
from nacre.mesh import Mesh

NORMALS_OF_CLOUD = "a Cloud has cloud.normals, and nacre.estimate_normals(points) finds them"


@guided(NORMALS_OF_CLOUD)
def triangulate(
    points: npt.ArrayLike, normals: npt.ArrayLike, *, num_threads: int = 0
) -> npt.NDArray[np.int32]:
    """
    Join points with normals by triangles, as they are.

    Parameters
    ----------
    points, normals : (N, 3) array_like
        [m], and vectors of any length that point out of the surface, as a model has them. Points that are not
        finite have no triangle.
    num_threads : int
        0 uses all. The result does not depend on it.

    Returns
    -------
    (T, 3) int32
        Rows of ``points``, counter-clockwise seen from where the normals point. Each edge has one triangle on
        each side at most; where points are farther apart than their neighbours are, the surface is open.

    Raises
    ------
    TypeError, ValueError
        Arrays of the wrong type or shape.

    Notes
    -----
    Each point's neighbours in the Delaunay triangulation of its tangent plane make a fan of triangles (Gopi,
    Krishnan and Silva 2000). Triangles in the fans of all three corners are the surface, those in two fans
    where they leave room; holes of up to ten edges are closed.
    """
    positions = arrays.as_points("points", points)
    directions = arrays.as_unit_rows("normals", normals, "points", len(positions))
    triangles: npt.NDArray[np.int32] = _core.triangulate(
        arrays.localize(positions)[0], directions, arrays.as_count("num_threads", num_threads)
    )
    return triangles


@guided(NORMALS_OF_CLOUD)
def mesh_points(
    points: npt.ArrayLike,
    normals: npt.ArrayLike,
    *,
    colors: npt.ArrayLike | None = None,
    num_threads: int = 0,
) -> Mesh:
    """
    Lay triangles over points with normals: those of :func:`triangulate`, with the points that they use.

    Parameters
    ----------
    points, normals, num_threads
        As there.
    colors : (N, 3) array_like of integers from 0 to 255, or of floats from 0 to 1, optional
        Red, green, blue of the points.

    Returns
    -------
    Mesh
        With the normals and the colours of its vertices.

    Raises
    ------
    TypeError, ValueError
        Arrays of the wrong type or shape; and where the points are too few, or too uneven, for a triangle.
    """
    positions = arrays.as_points("points", points)
    painted = None if colors is None else arrays.as_colors("colors", colors, positions.shape)
    triangles = triangulate(positions, normals, num_threads=num_threads)
    if not len(triangles):
        raise ValueError("points are too few for a surface, or their normals contradict it: no triangle")
    rows, corners = used_rows(triangles)
    return Mesh(
        positions[rows],
        corners,
        normals=arrays.as_points("normals", normals)[rows],
        colors=None if painted is None else painted[rows],
    )


def used_rows(triangles: npt.NDArray[np.int32]) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int32]]:
    """Return the rows that triangles use, in order, and the triangles as indices of those."""
    is_used = np.zeros(int(triangles.max(initial=-1)) + 1, dtype=bool)
    is_used[triangles.reshape(-1)] = True
    renumbered = np.cumsum(is_used, dtype=np.int32) - 1
    return np.flatnonzero(is_used), renumbered[triangles].astype(np.int32)
