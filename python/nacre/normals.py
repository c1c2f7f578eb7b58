"""Normals of unorganised points."""

from __future__ import annotations

import math

import numpy.typing as npt

from nacre import _core
from nacre._internal.arrays import FloatArray, as_count, as_length, as_points, as_vector
from nacre._internal.guided import guided


@guided(
    radius="max_radius",
    max_nn="k",
    knn="k",
    k_neighbors="k",
    num_neighbors="k",
    search_param="give k, and max_radius",
    camera_location="viewpoint",
)
def estimate_normals(
    points: npt.ArrayLike,
    *,
    k: int = 16,
    max_radius: float = math.inf,
    viewpoint: npt.ArrayLike = (0.0, 0.0, 0.0),
    num_threads: int = 0,
) -> FloatArray:
    """
    Estimate normals: the least-squares plane through each point's nearest neighbours.

    For points of a depth image :func:`nacre.depth_normals` is faster, because it knows the neighbours.

    Parameters
    ----------
    points : (N, 3) array_like of real numbers
        Points that are not finite are no neighbours and have no normal.
    k : int
        Neighbours of a plane, the point itself included; at least 3. More neighbours give smoother normals.
    max_radius : float
        Neighbours farther away are not used.
    viewpoint : (3,) array_like
        Normals point to this side.
    num_threads : int
        0 uses all; the result does not depend on it.

    Returns
    -------
    (N, 3) float
        Unit normals, float32 for float32 points, otherwise float64. NaN where no plane is known: fewer than
        three neighbours; neighbours on a line (their second variance is below 0.5 % of the first); neighbours
        that fill space (the variance along the normal is above 22 % of the sum, 33 % being isotropic).

    Notes
    -----
    Principal component analysis as in Hoppe et al., "Surface reconstruction from unorganized points", 1992;
    the measure of filled space is the surface variation of Pauly, Gross and Kobbelt, "Efficient
    simplification of point-sampled surfaces", 2002.

    Examples
    --------
    >>> corners = [[0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [0.0, 1.0, 1.0], [1.0, 1.0, 1.0]]
    >>> estimate_normals(corners, viewpoint=(0.0, 0.0, 5.0))[0]
    array([0., 0., 1.])
    """
    options = _core.NormalOptions()
    options.k = as_count("k", k, minimum=3)
    options.max_radius = as_length("max_radius", max_radius)
    options.num_threads = as_count("num_threads", num_threads)
    normals: FloatArray = _core.estimate_normals(
        as_points("points", points), options, as_vector("viewpoint", viewpoint, 3)
    )
    return normals
