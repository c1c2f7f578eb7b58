"""Surfaces that a model has twice, one a little before the other, as frames that disagree leave them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre._internal.arrays import as_matching_points, as_points
from nacre.kdtree import KdTree
from nacre.report.limits import SHEET_COSINE

Array = npt.NDArray[np.float64]

_MAX_SAMPLES = 5_000  # points that are looked at: they tell a part of 0.5 % to a fifth of itself
_NEIGHBORS = 6  # of a point, on a surface that is evenly sampled
_FARTHEST = 10  # times the least distance of two sheets
_DIRECTIONS = 6
_STEEPEST = math.radians(85)  # a ray that is nearer to the surface passes over all of it


@dataclass(frozen=True)
class DoubledSurfaces:
    """How much of a model lies behind a surface of the same orientation that hides it from all cameras."""

    fraction: float  #: part of the points
    distance: float  #: median distance of the two surfaces [m]; NaN where none is found
    center: tuple[float, float, float]  #: the middle of such points, in the model's frame [m]; NaN likewise


def find_doubled_surfaces(
    points: npt.ArrayLike,
    normals: npt.ArrayLike,
    *,
    spacing: float = 0.0,
    max_slant: float = 1.3962634,
) -> DoubledSurfaces:
    """
    Look for points that no camera can have seen if the surface before them is there.

    The surface before such a point has its orientation, and reaches farther to all sides than a ray at the
    greatest slant that is measured passes over it: one of the two stands where it should not.

    Parameters
    ----------
    points, normals : (N, 3)
        Of the model [m]; rows that are not finite are left out.
    spacing : float
        Between points [m]: sheets within two of it are one.
    max_slant : float
        Greatest angle between the normal and the ray of a measurement that is used [rad].

    Returns
    -------
    DoubledSurfaces

    Raises
    ------
    TypeError, ValueError
        Arrays of the wrong type or shape.
    """
    cloud = as_points("points", points)
    facing = as_matching_points("normals", normals, "points", len(cloud)).astype(np.float64)
    known = np.flatnonzero(np.isfinite(cloud).all(axis=1) & np.isfinite(facing).all(axis=1))
    if len(known) <= _NEIGHBORS:
        return DoubledSurfaces(0.0, math.nan, (math.nan, math.nan, math.nan))
    surface = _Surface(cloud[known], facing[known])
    rows = np.arange(len(known))
    if len(rows) > _MAX_SAMPLES:
        rows = np.sort(np.random.default_rng(0).choice(rows, _MAX_SAMPLES, replace=False))
    reach = surface.reach(rows)
    least = np.maximum(2 * spacing, 1.5 * reach)
    heights = _heights_of_cover(surface, rows, reach, least, math.tan(min(max_slant, _STEEPEST)))
    found = ~np.isnan(heights)
    if not found.any():
        return DoubledSurfaces(0.0, math.nan, (math.nan, math.nan, math.nan))
    x, y, z = (float(value) for value in np.median(surface.tree.points[rows[found]], axis=0))
    return DoubledSurfaces(float(found.mean()), float(np.median(heights[found])), (x, y, z))


class _Surface:
    """Points that can be asked what lies before them."""

    def __init__(self, points: npt.NDArray[np.floating[Any]], normals: Array) -> None:
        self.tree = KdTree(points)
        self.normals = normals

    def reach(self, rows: npt.NDArray[np.intp]) -> Array:
        """Return how far the neighbours of points are."""
        distances, _ = self.tree.query(self.tree.points[rows], k=_NEIGHBORS + 1)
        return np.asarray(distances[:, -1], np.float64)

    def height(self, rows: npt.NDArray[np.intp], near: Array, aside: Array, reach: Array) -> Array:
        """Return how far before points a surface of their orientation lies, near a height; NaN where none."""
        facing = self.normals[rows]
        place = self.tree.points[rows].astype(np.float64) + aside
        _, nearest = self.tree.query(place + near[:, None] * facing)
        offset = self.tree.points[nearest] - place
        height = (offset * facing).sum(axis=1)
        beside = np.linalg.norm(offset - height[:, None] * facing, axis=1)
        agrees = (self.normals[nearest] * facing).sum(axis=1) > SHEET_COSINE
        return np.where(agrees & (beside < 1.5 * reach), height, np.nan)


def _heights_of_cover(
    surface: _Surface, rows: npt.NDArray[np.intp], reach: Array, least: Array, slope: float
) -> Array:
    """Return how far before points the surface is that hides them [m]; NaN where there is none."""
    heights = np.full(len(rows), np.nan)
    for step in range(1, _FARTHEST + 1):
        rest = np.flatnonzero(np.isnan(heights))
        height = surface.height(rows[rest], step * least[rest], np.zeros((len(rest), 3)), reach[rest])
        is_apart = height > least[rest]  # False for NaN
        rest, height = rest[is_apart], height[is_apart]
        hides = np.ones(len(rest), bool)
        for aside in _directions(surface.normals[rows[rest]]):
            beside = surface.height(rows[rest], height, (slope * height)[:, None] * aside, reach[rest])
            hides &= np.abs(beside - height) < 0.5 * height  # the same sheet, which may be bent
        heights[rest[hides]] = height[hides]
    return heights


def _directions(normals: Array) -> list[Array]:
    """Return unit vectors to all sides of each normal."""
    across = np.cross(normals, np.eye(3)[np.abs(normals).argmin(axis=1)])
    across /= np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-12)
    along = np.cross(normals, across)
    angles = 2 * math.pi * np.arange(_DIRECTIONS) / _DIRECTIONS
    return [math.cos(angle) * across + math.sin(angle) * along for angle in angles]
