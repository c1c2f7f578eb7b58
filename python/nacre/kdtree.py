"""Exact nearest neighbours."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, overload

import numpy as np
import numpy.typing as npt

from nacre import _core
from nacre._internal.arrays import (
    FloatArray,
    as_array,
    as_count,
    as_flag,
    as_length,
    as_points,
    as_real,
)
from nacre._internal.guided import GuidedNames, guided
from nacre._internal.value_equality import Value

IndexArray = npt.NDArray[np.int64]

_SCIPY_SPEED = "it is fast without: leave it out"
_EUCLIDEAN = "distances are Euclidean: leave it out"
_EXACT = "neighbours are exact: leave it out"
_LARGEST_ROW = 1 << 16  # of neighbours, where there are fewer points


@dataclass(frozen=True, eq=False, repr=False)
class RadiusNeighbors(Value, Sequence[tuple[FloatArray, IndexArray]]):
    """
    All neighbours within a radius, each query's after the other's.

    ``result[q]`` is ``(distances, indices)`` of query ``q``, nearest first; both are views.

    Attributes
    ----------
    offsets : (Q + 1,) int64
        Query ``q`` owns the entries ``offsets[q]:offsets[q + 1]``.
    indices : (M,) int64
        Rows of the tree's points.
    distances : (M,) float
        In the dtype of the queries.
    """

    offsets: IndexArray
    indices: IndexArray
    distances: FloatArray

    def __len__(self) -> int:
        return len(self.offsets) - 1

    @overload
    def __getitem__(self, query: int) -> tuple[FloatArray, IndexArray]: ...
    @overload
    def __getitem__(self, query: slice) -> list[tuple[FloatArray, IndexArray]]: ...
    def __getitem__(self, query: Any) -> Any:
        if isinstance(query, slice):
            return [self[q] for q in range(*query.indices(len(self)))]
        row = range(len(self))[query]
        entries = slice(self.offsets[row], self.offsets[row + 1])
        return self.distances[entries], self.indices[entries]

    @property
    def counts(self) -> IndexArray:
        """The number of neighbours of each query, (Q,) int64."""
        return np.diff(self.offsets)

    def __repr__(self) -> str:
        return f"RadiusNeighbors({len(self)} queries, {len(self.indices)} neighbours)"


class KdTree(GuidedNames):
    """
    Nearest neighbours of 3D points, exactly.

    Distances are compared in double precision and equal distances by the smaller index, so the answer is
    unique and does not depend on the number of threads. Points that are not finite are never found. The tree
    is immutable, may be queried from any number of threads, and can be pickled.

    Parameters
    ----------
    points : (N, 3) array_like of real numbers
        Copied. float32 and float64 are kept as they are, other dtypes become float64. N may be 0.
    num_threads : int
        0 uses all.

    Examples
    --------
    >>> tree = KdTree([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 2.0, 0.0]])
    >>> tree.query([0.0, 0.5, 0.0], k=2)
    (array([0.5       , 1.11803399]), array([0, 1]))
    """

    @guided(
        leafsize=_SCIPY_SPEED, leaf_size=_SCIPY_SPEED, compact_nodes=_SCIPY_SPEED, balanced_tree=_SCIPY_SPEED,
        copy_data="the points are always copied: leave it out",
        metric=_EUCLIDEAN, boxsize="space is not periodic here: leave it out",
    )  # fmt: skip
    def __init__(self, points: npt.ArrayLike, *, num_threads: int = 0) -> None:
        self._points = as_points("points", points).copy()
        self._points.flags.writeable = False
        self._core = _core.KdTree(self._points, as_count("num_threads", num_threads))

    @property
    def points(self) -> FloatArray:
        """The points of the tree, (N, 3), read-only."""
        return self._points

    def __len__(self) -> int:
        return len(self._points)

    def __repr__(self) -> str:
        return f"KdTree({len(self)} points, {self._points.dtype})"

    def __reduce__(self) -> tuple[Any, ...]:
        return KdTree, (self._points,)

    @guided(p=_EUCLIDEAN, eps=_EXACT, return_distance="both are returned: leave it out", x="queries")
    def query(
        self,
        queries: npt.ArrayLike,
        k: int = 1,
        *,
        max_distance: float = math.inf,
        distance_upper_bound: float | None = None,
        num_threads: int = 0,
        workers: int | None = None,
    ) -> tuple[Any, Any]:
        """
        Find the ``k`` nearest points of each query.

        Queries are answered fastest in batches; their order does not matter.

        Parameters
        ----------
        queries : (..., 3) array_like of real numbers
            A query that is not finite finds nothing.
        k : int
            At least 1. More than there are points is as many as there are, in longer rows.
        max_distance : float
            Farther points are not found; a point at exactly this distance is.
        distance_upper_bound : float, optional
            The same as SciPy has it: a point at exactly this distance is not found.
        num_threads : int
            0 uses all.
        workers : int, optional
            The same as SciPy has it: -1 uses all.

        Returns
        -------
        distances : (..., k) float
            Nearest first, float32 for float32 queries, otherwise float64; ``inf`` where fewer were found.
        indices : (..., k) int64
            Rows of the tree's points; the tree's size where fewer were found.

        Raises
        ------
        TypeError, ValueError
            Naming the argument, what was expected and what came; ``k`` beyond 65536 and the number of points.

        Notes
        -----
        As in SciPy, the last axis is dropped for ``k = 1``.
        """
        array = _as_queries("queries", queries)
        if isinstance(k, Sequence) or (isinstance(k, np.ndarray) and k.ndim):
            raise TypeError(
                f"k must be an integer, got {k!r}; query(queries, max(k)) has a column for each neighbour"
            )
        k = as_count("k", k, minimum=1)
        if k > max(len(self), _LARGEST_ROW):
            raise ValueError(
                f"k must be at most the number of points ({len(self)}), or {_LARGEST_ROW}, got {k}"
            )
        gate = as_length("max_distance", max_distance)
        bound = math.inf
        if distance_upper_bound is not None:
            bound = as_length("distance_upper_bound", distance_upper_bound)
        threads = _threads(num_threads, workers)
        exact = array if bound == math.inf else array.astype(np.float64)
        distances, indices = self._core.query(exact.reshape(-1, 3), k, min(gate, bound), threads)
        if bound < math.inf:
            is_beyond = distances >= bound
            distances[is_beyond], indices[is_beyond] = math.inf, len(self)
            distances = distances.astype(array.dtype, copy=False)
        shape = array.shape[:-1] if k == 1 else (*array.shape[:-1], k)
        return distances.reshape(shape)[()], indices.reshape(shape)[()]

    @guided(r="radius", X="queries", x="queries", p=_EUCLIDEAN, eps=_EXACT)
    def query_radius(self, queries: npt.ArrayLike, radius: float, *, num_threads: int = 0) -> RadiusNeighbors:
        """
        Find all points within ``radius`` of each query.

        Parameters
        ----------
        queries : (Q, 3) or (3,) array_like of real numbers
            A query that is not finite finds nothing.
        radius : float
            A point at exactly this distance is found.
        num_threads : int
            0 uses all.

        Returns
        -------
        RadiusNeighbors
            Each query's neighbours, nearest first.
        """
        array = _as_queries("queries", queries)
        if array.ndim > 2:
            raise ValueError(f"queries must have shape (Q, 3) or (3,), got {array.shape}")
        offsets, indices, distances = self._core.query_radius(
            array.reshape(-1, 3), as_length("radius", radius), as_count("num_threads", num_threads)
        )
        return RadiusNeighbors(offsets, indices, distances.astype(array.dtype, copy=False))

    @guided(p=_EUCLIDEAN, eps=_EXACT, radius="r", queries="x")
    def query_ball_point(
        self,
        x: npt.ArrayLike,
        r: npt.ArrayLike,
        *,
        workers: int = -1,
        return_sorted: bool | None = None,
        return_length: bool = False,
    ) -> Any:
        """
        Find all points within ``r`` of each query, as SciPy's trees return them.

        :meth:`query_radius` has the distances, too, and arrays in place of lists, which take less memory.

        Parameters
        ----------
        x : (..., 3) array_like of real numbers
            A query that is not finite finds nothing.
        r : float, or (...) array_like
            A point at exactly this distance is found.
        workers : int
            -1 uses all.
        return_sorted : bool, optional
            False: nearest first. True, or None: by index.
        return_length : bool
            Return how many there are in their place.

        Returns
        -------
        list of int, or (...) array of such lists
            Rows of the tree's points; for ``return_length`` an int, or (...) int64.

        Raises
        ------
        TypeError, ValueError
            Naming the argument, what was expected and what came.
        """
        array = _as_queries("x", x)
        shape = array.shape[:-1]
        radii = as_real("r", r).astype(np.float64)
        try:
            radii = np.broadcast_to(radii, shape).reshape(-1)
        except ValueError:
            raise ValueError(
                f"r must be one number, or as many as queries {shape}, got {radii.shape}"
            ) from None
        if not (radii >= 0).all():
            raise ValueError(f"r must be at least 0, got {radii[~(radii >= 0)][0]}")
        is_sorted = return_sorted is None or as_flag("return_sorted", return_sorted)
        wants_length = as_flag("return_length", return_length)
        queries = array.reshape(-1, 3).astype(np.float64)
        found = self.query_radius(queries, radii.max(initial=0.0), num_threads=_threads(0, workers))
        is_near = found.distances <= np.repeat(radii, found.counts)
        owners = np.repeat(np.arange(len(radii)), found.counts)[is_near]
        counts = np.bincount(owners, minlength=len(radii))
        if wants_length:
            return counts.reshape(shape)[()]
        indices = found.indices[is_near]
        near = (indices[np.lexsort((indices, owners))] if is_sorted else indices).tolist()
        ends = np.cumsum(counts).tolist()
        rows = np.empty(len(radii), object)
        for query, (begin, end) in enumerate(itertools.pairwise([0, *ends])):
            rows[query] = near[begin:end]
        return rows.reshape(shape)[()]


def _threads(num_threads: int, workers: int | None) -> int:
    """Return the number of threads, which SciPy calls workers and has -1 for all."""
    if workers is None:
        return as_count("num_threads", num_threads)
    count = as_count("workers", workers, minimum=-1)
    if count == 0:
        raise ValueError("workers must be -1 (all) or at least 1, got 0")
    return max(count, 0)


def _as_queries(name: str, value: npt.ArrayLike) -> FloatArray:
    array = as_array(name, value)
    if array.ndim == 0 or array.shape[-1] != 3:
        raise ValueError(f"{name} must have shape (..., 3), got {array.shape}")
    return as_points(name, array.reshape(-1, 3)).reshape(array.shape)
