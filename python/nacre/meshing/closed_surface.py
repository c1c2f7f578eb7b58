"""A closed surface through points with normals."""

from __future__ import annotations

import dataclasses
import math
import warnings

import numpy as np
import numpy.typing as npt

from nacre._internal import arrays
from nacre._internal.value_equality import Value
from nacre.kdtree import KdTree
from nacre.meshing.triangulation import triangulate

_MISSING = 'closed surfaces need gpytoolbox: pip install "nacre[closed]"'
_MOST_HALVINGS = 12  # of the box, budget: more than 4096 cells a side would take hours
_BOX = 1.1  # of the points' extent: Kazhdan's
_SCREENING = 5.0  # tuned (benchmarks/meshing.py): more follows stray points, less rounds edges off


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class ClosedSurface(Value):
    """
    A closed surface, and what of it was seen.

    Attributes
    ----------
    vertices : (V, 3) float64
        [m].
    triangles : (T, 3) int32
        Vertex indices, counter-clockwise seen from outside; each edge has two.
    normals : (V, 3) float64
        Unit vectors that point outwards.
    is_seen : (V,) bool
        Whether a point lies within two spacings; elsewhere the surface is a guess.
    """

    vertices: npt.NDArray[np.float64]
    triangles: npt.NDArray[np.int32]
    normals: npt.NDArray[np.float64]
    is_seen: npt.NDArray[np.bool_]


def close_surface(points: npt.ArrayLike, normals: npt.ArrayLike) -> ClosedSurface:
    """
    Lay a closed surface through points with normals; where there are no points it is a smooth guess.

    Parameters
    ----------
    points, normals : (N, 3) array_like
        [m], and vectors of any length that point out of the surface, as a model has them. Rows that are not
        finite, or have no direction, are left out.

    Returns
    -------
    ClosedSurface

    Raises
    ------
    TypeError, ValueError
        Arrays of the wrong type or shape, or fewer than 10 points.
    ImportError
        When gpytoolbox is missing, with the command that installs it.

    Notes
    -----
    M. Kazhdan and H. Hoppe, "Screened Poisson Surface Reconstruction", 2013, by the authors' program, through
    the points and the middles of the triangles of :func:`triangulate`, so that it does not sag in between.
    Its finest cells are half as large as the distance between points, but no finer than 1/4096 of the extent.
    """
    positions = arrays.as_points("points", points)
    directions = arrays.as_unit_rows("normals", normals, "points", len(positions))
    usable = np.isfinite(positions).all(axis=1) & np.isfinite(directions).all(axis=1)
    if np.count_nonzero(usable) < 10:
        raise ValueError(f"points must be 10 or more for a surface, got {np.count_nonzero(usable)}")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DeprecationWarning)  # its own
            from gpytoolbox import point_cloud_to_mesh
    except ImportError as error:
        raise ImportError(_MISSING, name="gpytoolbox") from error
    local, origin = arrays.localize(positions[usable])
    tree = KdTree(local)
    spacings = tree.query(local, 7)[0][:, 1:].mean(axis=1)
    spacing, extent = float(np.median(spacings)), float(np.ptp(local, axis=0).max())
    if not 0 < spacing < extent:
        raise ValueError("points must be spread over a surface, but most of them are in one place")
    halvings = min(math.ceil(math.log2(_BOX * extent / spacing)) + 1, _MOST_HALVINGS)
    vertices, triangles = point_cloud_to_mesh(
        *_with_middles(local.astype(np.float64), directions[usable].astype(np.float64)),
        psr_depth=halvings,
        psr_screening_weight=_SCREENING,
    )
    if not len(triangles):
        raise ValueError("points and normals make no surface")
    distances, nearest = tree.query(vertices, 1)
    return ClosedSurface(
        vertices + origin,
        np.ascontiguousarray(triangles, np.int32),
        _vertex_normals(vertices, triangles),
        distances <= 2 * np.maximum(spacings[nearest], spacing),
    )


def _with_middles(
    points: npt.NDArray[np.float64], normals: npt.NDArray[np.float64]
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Return the points, then the middles of the triangles between them, with normals of any length."""
    triangles = triangulate(points, normals)
    return (
        np.concatenate([points, points[triangles].mean(axis=1)]),
        np.concatenate([normals, normals[triangles].mean(axis=1)]),
    )


def _vertex_normals(
    vertices: npt.NDArray[np.float64], triangles: npt.NDArray[np.integer]
) -> npt.NDArray[np.float64]:
    """Return the mean normals of the triangles around each vertex, by their areas."""
    a, b, c = (vertices[triangles[:, i]] for i in range(3))
    areas = np.cross(b - a, c - a)
    sums = np.stack(
        [np.bincount(triangles.ravel(), np.repeat(areas[:, i], 3), len(vertices)) for i in range(3)], axis=1
    )
    lengths = np.linalg.norm(sums, axis=1, keepdims=True)
    return np.where(lengths > 0, sums / np.where(lengths > 0, lengths, 1), (0.0, 0.0, 1.0))
