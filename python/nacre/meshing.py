"""Triangles over a model, for those who need them; the points stay the product."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre._internal.arrays import as_points
from nacre.kdtree import KdTree
from nacre.mesh import Mesh

Array = npt.NDArray[np.float64]

_BLOCK = 24  # cells along an edge of a block
_NEIGHBORS = 12
_BAND = 2.5  # of the nearest point's spacing: farther from it nothing is known
_REACH = 1.5  # likewise, of vertices: the surface ends where the points do


def mesh_points(
    points: npt.ArrayLike, normals: npt.ArrayLike, *, cell: float | None = None, num_threads: int = 0
) -> Mesh:
    """
    Lay triangles over points with normals.

    Where no points are, the mesh is open: nothing is invented.

    Parameters
    ----------
    points, normals : (N, 3) array_like
        [m], and unit vectors that point out of the surface, as a model has them.
    cell : float, optional
        Edge of the grid's cells [m]; by default the median distance between neighbouring points.
    num_threads : int
        0 uses all.

    Returns
    -------
    Mesh
        Its triangles face where the normals point.

    Raises
    ------
    ImportError
        When scikit-image is missing, with the command that installs it.
    TypeError, ValueError
        Arrays of the wrong type or shape, fewer than 12 points, a cell that is not positive; and where the
        points are too sparse for the cell, so that there is no triangle.

    Notes
    -----
    The zero set of the signed distance to the points' tangent planes, averaged with Gaussian weights
    (implicit moving least squares: Kolluri 2008; Öztireli, Guennebaud and Gross 2009), by marching cubes
    (Lewiner et al. 2003) of scikit-image, block by block, so that memory grows with the surface.
    """
    try:
        from skimage.measure import marching_cubes
    except ImportError as error:
        raise ImportError('mesh_points needs scikit-image: pip install "nacre[mesh]"') from error
    positions = as_points("points", points).astype(np.float64)
    directions = as_points("normals", normals).astype(np.float64)
    if len(directions) != len(positions):
        raise ValueError(f"normals must have one row per point ({len(positions)}), got {len(directions)}")
    known = np.isfinite(positions).all(axis=1) & np.isfinite(directions).all(axis=1)
    positions, directions = positions[known], directions[known]
    if len(positions) < _NEIGHBORS:
        raise ValueError(f"points must be at least {_NEIGHBORS} finite ones, got {len(positions)}")
    field = _Field(positions, directions, num_threads)
    size = float(np.median(field.spacing)) if cell is None else cell
    if not (math.isfinite(size) and size > 0):
        raise ValueError(f"cell must be positive [m], got {cell!r}")

    vertices: list[Array] = []
    triangles: list[npt.NDArray[np.int64]] = []
    for corner, nodes in _blocks(positions, field.spacing, size):
        values = field.at(nodes.reshape(-1, 3)).reshape(nodes.shape[:-1])
        whole = np.isfinite(values)
        if not (np.nanmin(values, initial=np.inf) < 0 < np.nanmax(values, initial=-np.inf)):
            continue
        cells = np.ones(np.array(values.shape) - 1, dtype=bool)
        for step in itertools.product((slice(None, -1), slice(1, None)), repeat=3):
            cells &= whole[step]
        mask = np.zeros(values.shape, dtype=bool)
        mask[1:, 1:, 1:] = cells  # scikit-image looks at the last corner of a cell
        if not cells.any():
            continue
        try:
            found, faces, _, _ = marching_cubes(np.where(whole, values, 1.0), 0.0, mask=mask)
        except (RuntimeError, ValueError):  # no cell that the surface crosses
            continue
        triangles.append(faces.astype(np.int64) + sum(map(len, vertices)))
        vertices.append(corner + size * found.astype(np.float64))
    if not triangles:
        raise ValueError(f"points are too sparse for cells of {size:.3g} m: there is no triangle")
    return _joined(np.concatenate(vertices), np.concatenate(triangles), field, size)


class _Field:
    """The signed distance of the points' surface; NaN where no point is near."""

    def __init__(self, points: Array, normals: Array, num_threads: int) -> None:
        self._tree, self._points, self._normals, self._threads = KdTree(points), points, normals, num_threads
        distances, _ = self._tree.query(points, k=7, num_threads=num_threads)
        self.spacing: Array = distances[:, 1:].mean(axis=1)

    def at(self, places: Array) -> Array:
        values = np.full(len(places), np.nan)
        nearest, first = self._nearest(places)
        near = np.flatnonzero(nearest < _BAND * self.spacing[first])
        if not len(near):
            return values
        distances, indices = self._tree.query(places[near], k=_NEIGHBORS, num_threads=self._threads)
        facing = self._normals[indices]
        width = self.spacing[first[near], None]
        weights = np.exp(-((distances - distances[:, :1]) ** 2 + distances[:, :1] ** 2) / (2 * width**2))
        # The other side of something thin is another surface.
        weights *= np.einsum("nki,ni->nk", facing, facing[:, 0]) > 0
        weights /= weights.sum(axis=1, keepdims=True)
        mean = np.einsum("nk,nki->ni", weights, facing)
        mean /= np.maximum(np.linalg.norm(mean, axis=1, keepdims=True), 1e-300)
        # Halfway between the two normals, heights have no bias on a curved surface.
        halfway = 0.5 * (facing + mean[:, None])
        heights = np.einsum("nki,nki->nk", places[near, None] - self._points[indices], halfway)
        values[near] = (weights * heights).sum(axis=1)
        return values

    def is_near(self, places: Array) -> npt.NDArray[np.bool_]:
        """Return which places have a point as near as neighbouring points are."""
        nearest, first = self._nearest(places)
        return np.asarray(nearest < _REACH * self.spacing[first])

    def _nearest(self, places: Array) -> tuple[Array, npt.NDArray[np.int64]]:
        distances, indices = self._tree.query(places, k=1, num_threads=self._threads)
        return distances.reshape(-1), indices.reshape(-1)


def _blocks(points: Array, spacing: Array, cell: float) -> Iterator[tuple[Array, Array]]:
    """Yield the first corner and the nodes (B, B, B, 3) of every block of the grid that has points near."""
    origin = points.min(axis=0) - 0.37 * cell  # no node on a plane of points that lies along the grid
    edge = _BLOCK * cell
    reach = np.minimum(_BAND * spacing, edge)[:, None]
    corners = [
        np.floor((points + np.array(s) * reach - origin) / edge) for s in itertools.product((-1, 1), repeat=3)
    ]
    steps = np.stack(np.meshgrid(*[cell * np.arange(_BLOCK + 1)] * 3, indexing="ij"), axis=-1)
    for block in np.unique(np.concatenate(corners).astype(np.int64), axis=0):
        corner = origin + edge * block
        yield corner, corner + steps


def _joined(vertices: Array, triangles: npt.NDArray[Any], field: _Field, cell: float) -> Mesh:
    """Join what blocks share, and leave out what lies beyond the points."""
    keys = np.rint(vertices / (1e-3 * cell)).astype(np.int64)
    _, kept, inverse = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    vertices, triangles = vertices[kept], inverse.reshape(-1)[triangles]
    near = field.is_near(vertices)
    triangles = triangles[near[triangles].all(axis=1)]
    different = (triangles != np.roll(triangles, 1, axis=1)).all(axis=1)
    triangles = triangles[different]
    used, renumbered = np.unique(triangles, return_inverse=True)
    if not len(used):
        raise ValueError(f"points are too sparse for cells of {cell:.3g} m: there is no triangle")
    return Mesh(vertices[used], renumbered.reshape(-1, 3))
