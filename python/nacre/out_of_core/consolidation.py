"""WLOP over clouds larger than memory."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from nacre._internal.arrays import as_count, as_length
from nacre._internal.guided import guided
from nacre.consolidation import SPACINGS_PER_RADIUS, project_samples
from nacre.consolidation import consolidate as consolidate_in_memory
from nacre.kdtree import KdTree
from nacre.out_of_core.cloud_work import POINTS_PER_CELL, CloudResult, CloudWork, Progress
from nacre.out_of_core.hashes import LowestHashes
from nacre.out_of_core.rows import Rows
from nacre.out_of_core.store import Cell
from nacre.out_of_core.survey import PathLike

_RADII_OF_A_STEP = 2.0  # of a sample's neighbours, and of theirs, which their density depends on
_BYTES_PER_POINT = 110


@guided("a point file or a folder of them, the file to write, and num_points")
def consolidate(
    source: PathLike | Iterable[PathLike],
    output: PathLike,
    *,
    num_points: int,
    radius: float | None = None,
    iterations: int = 10,
    mu: float = 0.4,
    method: str = "wlop",
    theta: str = "huang",
    seed: int = 0,
    memory: int | str | None = None,
    workers: int | None = None,
    scheduler: str | None = None,
    points_per_cell: int = POINTS_PER_CELL,
    cells_per_task: int = 1,
    progress: Progress | None = None,
) -> CloudResult:
    r"""
    Replace a cloud that may be larger than memory by fewer, evenly spread, denoised points (WLOP).

    As :func:`nacre.consolidate`, cell by cell, each with a halo around it. The file has the same bytes for
    any memory, workers, order of the points and division into files.

    Parameters
    ----------
    source : path-like, or iterable of path-like
        A point file, a folder of them, or several that are one cloud: binary PLY, binary PCD, LAS, LAZ (COPC,
        too) of any size; other kinds where memory holds them.
    output : path-like
        The file to write, ``.ply``, ``.pcd``, ``.las`` or ``.laz``. What is needed meanwhile is in a folder
        beside it, as large as the source uncompressed, and goes in the end.
    num_points : int
        Size of the result: those of the lowest hashes of their coordinates. Of points in the same place one
        is taken, so that there are fewer where such are among them.
    radius, iterations, mu, method, theta, seed
        As in :func:`nacre.consolidate`. The default radius is 2.5 times the spacing of the result, from
        the density of a random sample of the points.
    memory : int or str, optional
        Bytes, or a text such as ``"2GB"``, that all processes together may take; None: half of the machine's.
    workers : int, optional
        So many processes, fewer where memory is not enough for them; None: this one. More than one need Dask.
    scheduler : str, optional
        The address of a Dask scheduler, in place of processes on this machine; all see the same disk.
    points_per_cell : int
        The most points of a cell, before its halo. The result depends on it by rounding alone.
    cells_per_task : int
        How many cells are given to a worker at once; changes no result.
    progress : callable, optional
        Called after each cell with how many are done and how many there are.

    Returns
    -------
    CloudResult

    Raises
    ------
    TypeError, ValueError
        Naming the argument, what was expected and what came; a memory that does not hold the largest cell.
    FileFormatError, OSError
        A file is broken, or cannot be read or written; an earlier output stays as it was.
    ImportError
        Dask or laspy is missing, with the command that installs it.
    ConnectionError
        The scheduler went away, or workers died again and again.

    Notes
    -----
    Samples within :math:`2 h \sqrt T` of a cell's box move along in its T iterations, and points 2 h
    farther attract them: docs/large-clouds.md tells why that is enough. Normals, colours and attributes are
    those of the input point that is nearest to each result.

    Examples
    --------
    >>> consolidate("scan.las", "thin.las", num_points=25_000_000, memory="4GB")  # doctest: +SKIP
    """
    consolidate_in_memory(np.zeros((1, 3)), iterations=iterations, mu=mu, method=method, theta=theta)
    seed = as_count("seed", seed)
    lowest = LowestHashes(as_count("num_points", num_points, minimum=1))
    given = None if radius is None else as_length("radius", radius)
    cloud = CloudWork(source, output, memory, workers, scheduler, points_per_cell, cells_per_task, progress)
    of = cloud.survey
    if given is None:
        given = SPACINGS_PER_RADIUS * of.spacing * math.sqrt(max(of.num_points / lowest.k, 1.0))
        if not 0 < given < math.inf:
            raise ValueError("radius must be given, got None: the points lie on top of each other")
    wlop = Wlop(given, iterations, mu, method, theta, highest=0)
    wlop.check()
    with cloud.sorted(seed, lowest) as store:
        wlop = dataclasses.replace(wlop, highest=lowest.highest())
        cloud.work(store, wlop)
        return cloud.write(store, wlop, wlop.radius)


@dataclass(frozen=True)
class Wlop:
    """Samples of a cell, and those around it, move among the points."""

    radius: float
    iterations: int
    mu: float
    method: str
    theta: str
    highest: int  # hash of a sample

    bytes_per_point = _BYTES_PER_POINT

    def check(self) -> None:
        """Raise where the parameters are none that WLOP takes."""
        consolidate_in_memory(np.zeros((1, 3)), radius=self.radius, mu=self.mu, num_points=1)

    @property
    def sample_halo(self) -> float:
        """How far from a cell samples are that matter."""
        return _RADII_OF_A_STEP * self.radius * math.sqrt(self.iterations)

    @property
    def halo(self) -> float:
        """How far from a cell points are that matter."""
        return self.sample_halo + _RADII_OF_A_STEP * self.radius

    def row_type(self, dtype: np.dtype[Any]) -> np.dtype[Any]:
        """Return the type of the points that went in."""
        return dtype

    def work(self, cell: Cell) -> Rows:
        """Return the samples of a cell where they have come to."""
        points = np.ascontiguousarray(cell.rows["points"])
        is_sample = cell.hashes <= np.uint64(self.highest)
        is_sample[cell.num_own :] &= cell.distances <= self.sample_halo
        samples = np.flatnonzero(is_sample)
        is_alone = (points[samples] != points[samples - 1]).any(axis=1)  # points in one place are neighbours
        samples = samples[is_alone | (samples == 0)]
        num_own = int(np.searchsorted(samples, cell.num_own))
        if num_own == 0:
            return cell.rows[:0]
        moved = project_samples(
            points[samples],
            points,
            radius=self.radius,
            iterations=self.iterations,
            mu=self.mu,
            method=self.method,
            theta=self.theta,
        )[:num_own]
        result: Rows = cell.rows[samples[:num_own]]
        if len(cell.rows.dtype.names or ()) > 1:
            result = cell.rows[np.asarray(KdTree(points).query(moved, 1)[1])]
        result["points"] = moved
        return result
