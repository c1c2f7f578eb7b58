"""Points far from all others, of clouds larger than memory."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from nacre._internal.arrays import as_count, as_length
from nacre._internal.guided import guided
from nacre.kdtree import KdTree
from nacre.out_of_core.cloud_work import POINTS_PER_CELL, CloudResult, CloudWork, Progress
from nacre.out_of_core.neighborhoods import default_radius
from nacre.out_of_core.rows import Rows, copy_fields
from nacre.out_of_core.run import read_results
from nacre.out_of_core.store import Cell
from nacre.out_of_core.survey import PathLike

_BYTES_PER_POINT = 400  # 17 neighbours of each
_DISTANCE = "mean distance"


@guided("a point file or a folder of them, and the file to write", nb_neighbors="k", mean_k="k")
def remove_outliers(
    source: PathLike | Iterable[PathLike],
    output: PathLike,
    *,
    k: int = 16,
    std_ratio: float = 2.0,
    max_radius: float | None = None,
    memory: int | str | None = None,
    workers: int | None = None,
    scheduler: str | None = None,
    points_per_cell: int = POINTS_PER_CELL,
    cells_per_task: int = 1,
    progress: Progress | None = None,
) -> CloudResult:
    """
    Leave out the points of a cloud that are far from their neighbours; it may be larger than memory.

    A point goes whose mean distance to its k nearest others exceeds the mean of all points' by more than
    ``std_ratio`` times their standard deviation. What stays has all that it had, in the order of the cells.
    The file has the same bytes for any memory, workers, order of the points and division into files.

    Parameters
    ----------
    source, output, memory, workers, scheduler, points_per_cell, cells_per_task, progress
        As in :func:`nacre.out_of_core.consolidate`.
    k : int
        Neighbours, the point itself not included.
    std_ratio : float
        Standard deviations that a point may be off.
    max_radius : float, optional
        Neighbours that are farther away count as so far; None: 16 times the radius within which k points of
        the cloud's median density lie.

    Returns
    -------
    CloudResult

    Raises
    ------
    TypeError, ValueError, FileFormatError, OSError, ImportError, ConnectionError
        As :func:`nacre.out_of_core.consolidate` does.

    References
    ----------
    Rusu, Marton, Blodow, Dolha, Beetz: Towards 3D point cloud based object maps for household environments.
    Robotics and Autonomous Systems 56(11), 2008.

    Examples
    --------
    >>> remove_outliers("scan.laz", "clean.laz", memory="2GB")  # doctest: +SKIP
    """
    k = as_count("k", k, minimum=1)
    ratio = as_length("std_ratio", std_ratio)
    radius = None if max_radius is None else as_length("max_radius", max_radius)
    if radius is not None and not 0 < radius < math.inf:
        raise ValueError(f"max_radius must be positive and finite, got {radius}")
    cloud = CloudWork(source, output, memory, workers, scheduler, points_per_cell, cells_per_task, progress)
    method = NeighborDistances(k, default_radius(cloud.survey, k) if radius is None else radius)
    with cloud.sorted() as store:
        cloud.work(store, method)
        dtype = method.row_type(store.dtype)
        sums = np.array(
            [
                (len(d), d.sum(), (d**2).sum())
                for d in (rows[_DISTANCE] for rows in read_results(store, dtype))
            ]
        )
        count, total, squares = map(math.fsum, sums.T)
        mean = total / count
        most = mean + ratio * math.sqrt(max(squares / count - mean**2, 0.0))
        return cloud.write(store, method, method.halo, select=lambda rows: rows[rows[_DISTANCE] <= most])


@dataclass(frozen=True)
class NeighborDistances:
    """The points of a cell with their mean distances to their neighbours."""

    k: int
    halo: float

    bytes_per_point = _BYTES_PER_POINT

    def row_type(self, dtype: np.dtype[Any]) -> np.dtype[Any]:
        """Return the type of the points with a distance."""
        return np.dtype([*((name, dtype[name]) for name in dtype.names or ()), (_DISTANCE, np.float64)])

    def work(self, cell: Cell) -> Rows:
        """Return the points of a cell with their distances."""
        points = np.ascontiguousarray(cell.rows["points"])
        found = KdTree(points).query(points[: cell.num_own], self.k + 1)[0]
        result = np.empty(cell.num_own, self.row_type(cell.rows.dtype))
        copy_fields(cell.rows[: cell.num_own], result)
        result[_DISTANCE] = np.minimum(found[:, 1:], self.halo).astype(np.float64).mean(axis=1)
        return result
