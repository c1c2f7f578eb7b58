"""A closed surface through points with normals."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre import _core
from nacre._internal import arrays
from nacre._internal.guided import guided
from nacre._internal.mesh_library import gpytoolbox
from nacre._internal.value_equality import Value
from nacre._internal.warned import warn
from nacre.kdtree import KdTree
from nacre.meshing.triangulation import NORMALS_OF_CLOUD, triangulate, used_rows

_MOST_HALVINGS = 12  # of the box: no more are taken by it
_BOX = 3.2  # of the points' extent: gpytoolbox's, measured (test_meshing)
_SCREENED_NOISE = 0.17  # of the distance between points, tuned: with so much, points and normals weigh alike
_LEAST_PART = 30  # points: as of a surface, cpp/src/mesh/limits.hpp; parts through fewer are bubbles
_MOST_SCREENING = 10.0  # tuned (benchmarks/meshing.py, as the former): more follows stray points


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class ClosedSurface(Value):
    """
    A closed surface, and what of it was seen.

    Attributes
    ----------
    vertices : (V, 3) float64
        [m].
    triangles : (T, 3) int32
        Vertex indices, counter-clockwise seen from outside; each edge has two, but where a guess ends at the
        box of three times the points' extent.
    normals : (V, 3) float64
        Unit vectors that point outwards.
    is_seen : (V,) bool
        Whether a point lies within two spacings; elsewhere the surface is a guess.
    """

    vertices: npt.NDArray[np.float64]
    triangles: npt.NDArray[np.int32]
    normals: npt.NDArray[np.float64]
    is_seen: npt.NDArray[np.bool_]


@guided(NORMALS_OF_CLOUD)
def close_surface(points: npt.ArrayLike, normals: npt.ArrayLike) -> ClosedSurface:
    """
    Lay a closed surface through points with normals; where there are no points it is a smooth guess.

    A guess that goes on to the box of three times the points' extent ends there, with a warning.

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
    How much points weigh against their normals (their screening) follows from how far they lie from their
    neighbours' middle: exact points are kept, noisy ones averaged.
    Its finest cells are about half as large as the distance between points (0.35 to 0.71, as a box is
    halved), but no finer than 1/1280 of the extent.
    """
    positions = arrays.as_points("points", points)
    directions = arrays.as_unit_rows("normals", normals, "points", len(positions))
    usable = np.isfinite(positions).all(axis=1) & np.isfinite(directions).all(axis=1)
    if np.count_nonzero(usable) < 10:
        raise ValueError(f"points must be 10 or more for a surface, got {np.count_nonzero(usable)}")
    library = gpytoolbox("closed surfaces", "closed")
    local, origin = arrays.localize(positions[usable])
    tree = KdTree(local)
    apart, neighbors = tree.query(local, 7)
    spacings = apart[:, 1:].mean(axis=1)
    spacing, extent = float(np.median(spacings)), float(np.ptp(local, axis=0).max())
    if not 0 < spacing < extent:
        raise ValueError("points must be spread over a surface, but most of them are in one place")
    halvings = min(round(math.log2(_BOX * extent / spacing)) + 1, _MOST_HALVINGS)
    vertices, triangles = library.point_cloud_to_mesh(
        *_with_middles(local.astype(np.float64), directions[usable].astype(np.float64)),
        psr_depth=halvings,
        psr_screening_weight=_screening(local, directions[usable], neighbors[:, 1:], spacings),
    )
    triangles = np.ascontiguousarray(triangles, np.int32)
    if not len(triangles):
        raise ValueError("points and normals make no surface")
    distances, nearest = tree.query(vertices, 1)
    is_seen = distances <= 2 * np.maximum(spacings[nearest], spacing)
    rows, triangles = used_rows(_without_bubbles(triangles, np.where(is_seen, nearest, -1)))
    if _is_open(triangles):
        warn("the surface is open where its guess ends, at the box of three times the points' extent")
    return ClosedSurface(
        vertices[rows] + origin,
        triangles,
        _vertex_normals(vertices[rows], triangles),
        is_seen[rows],
    )


def _is_open(triangles: npt.NDArray[np.int32]) -> bool:
    """Tell whether an edge has one triangle alone."""
    edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    numbers = edges @ np.array([edges.max() + 1, 1], np.int64)
    return bool((np.unique(numbers, return_counts=True)[1] == 1).any())


def _without_bubbles(
    triangles: npt.NDArray[np.int32], nearest: npt.NDArray[np.integer[Any]]
) -> npt.NDArray[np.int32]:
    """Leave parts out that go through few points; each vertex has the row of its nearest one, or -1."""
    parts = _core.connected_parts(triangles, len(nearest))
    through = np.unique(np.stack([parts, nearest])[:, nearest >= 0], axis=1)[0]
    num_points = np.bincount(through, minlength=int(parts.max()) + 1)
    is_part = num_points >= min(_LEAST_PART, num_points.max())
    kept: npt.NDArray[np.int32] = triangles[is_part[parts[triangles[:, 0]]]]
    return kept


def _screening(
    points: npt.NDArray[np.float32],
    normals: npt.NDArray[np.floating[Any]],
    neighbors: npt.NDArray[np.integer[Any]],
    spacings: npt.NDArray[np.float32],
) -> float:
    """Return how much points weigh against their normals: by the square of how exact they show to be."""
    offsets = np.einsum("ij,ij->i", points[neighbors].mean(axis=1) - points, normals)
    noise = 1.4826 * np.median(np.abs(offsets) / np.maximum(spacings, np.finfo(np.float32).tiny))
    noise /= math.sqrt(1 + 1 / neighbors.shape[1])  # the neighbours' mean errs, too
    return float(min((_SCREENED_NOISE / max(noise, 1e-6)) ** 2, _MOST_SCREENING))


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
