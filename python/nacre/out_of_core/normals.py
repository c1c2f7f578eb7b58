"""Normals of clouds larger than memory."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre._internal.arrays import as_count, as_length, as_vector
from nacre._internal.guided import guided
from nacre.normals import estimate_normals as estimate_in_memory
from nacre.out_of_core.cloud_work import POINTS_PER_CELL, CloudResult, CloudWork, Progress
from nacre.out_of_core.neighborhoods import default_radius
from nacre.out_of_core.rows import Rows, copy_fields, with_normals
from nacre.out_of_core.store import Cell
from nacre.out_of_core.survey import PathLike

_BYTES_PER_POINT = 130


@guided("a point file or a folder of them, and the file to write")
def estimate_normals(
    source: PathLike | Iterable[PathLike],
    output: PathLike,
    *,
    k: int = 16,
    max_radius: float | None = None,
    viewpoint: npt.ArrayLike = (0.0, 0.0, 0.0),
    memory: int | str | None = None,
    workers: int | None = None,
    scheduler: str | None = None,
    points_per_cell: int = POINTS_PER_CELL,
    cells_per_task: int = 1,
    progress: Progress | None = None,
) -> CloudResult:
    """
    Estimate the normals of a cloud that may be larger than memory.

    As :func:`nacre.estimate_normals`, cell by cell. All points and what they have are written, in the order
    of the cells, with their normals in float32. The file has the same bytes for any memory, workers, order of
    the points and division into files.

    Parameters
    ----------
    source, output, memory, workers, scheduler, points_per_cell, cells_per_task, progress
        As in :func:`nacre.out_of_core.consolidate`.
    k : int
        Neighbours of a plane, the point itself included; at least 3.
    max_radius : float, optional
        Neighbours farther away are not used; None: 16 times the radius within which k points of the cloud's
        median density lie. It is the halo: each point has all its neighbours within it.
    viewpoint : (3,) array_like
        Normals point to this side.

    Returns
    -------
    CloudResult

    Raises
    ------
    TypeError, ValueError, FileFormatError, OSError, ImportError, ConnectionError
        As :func:`nacre.out_of_core.consolidate` does.

    Examples
    --------
    >>> estimate_normals("scans", "normals.ply", viewpoint=(0, 0, 1e4), memory="2GB")  # doctest: +SKIP
    """
    k = as_count("k", k, minimum=3)
    eye = as_vector("viewpoint", viewpoint, 3)
    radius = None if max_radius is None else as_length("max_radius", max_radius)
    estimate_in_memory(np.zeros((1, 3)), max_radius=1.0 if radius is None else radius)
    cloud = CloudWork(source, output, memory, workers, scheduler, points_per_cell, cells_per_task, progress)
    method = Normals(k, default_radius(cloud.survey, k) if radius is None else radius, tuple(eye.tolist()))
    with cloud.sorted() as store:
        cloud.work(store, method)
        return cloud.write(store, method, method.halo)


@dataclass(frozen=True)
class Normals:
    """The points of a cell get normals."""

    k: int
    halo: float
    viewpoint: tuple[float, ...]

    bytes_per_point = _BYTES_PER_POINT

    def row_type(self, dtype: np.dtype[Any]) -> np.dtype[Any]:
        """Return the type of the points with normals."""
        return with_normals(dtype)

    def work(self, cell: Cell) -> Rows:
        """Return the points of a cell with their normals."""
        points = np.ascontiguousarray(cell.rows["points"])
        normals = estimate_in_memory(points, k=self.k, max_radius=self.halo, viewpoint=self.viewpoint)
        result = np.empty(cell.num_own, self.row_type(cell.rows.dtype))
        copy_fields(cell.rows[: cell.num_own], result, but=("normals",))
        result["normals"] = normals[: cell.num_own]
        return result
