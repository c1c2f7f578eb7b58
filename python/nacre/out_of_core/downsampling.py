"""One point for each cube of a grid, of clouds larger than memory."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from nacre._internal.arrays import as_length
from nacre._internal.guided import guided
from nacre.downsampling import voxel_downsample as downsample_in_memory
from nacre.out_of_core.cloud_work import POINTS_PER_CELL, CloudResult, CloudWork, Progress
from nacre.out_of_core.rows import Rows, to_cloud
from nacre.out_of_core.store import Cell
from nacre.out_of_core.survey import PathLike

_BYTES_PER_POINT = 300
_ROUNDING = 1.001


@guided("a point file or a folder of them, the file to write, and voxel_size")
def voxel_downsample(
    source: PathLike | Iterable[PathLike],
    output: PathLike,
    voxel_size: float,
    *,
    memory: int | str | None = None,
    workers: int | None = None,
    scheduler: str | None = None,
    points_per_cell: int = POINTS_PER_CELL,
    cells_per_task: int = 1,
    progress: Progress | None = None,
) -> CloudResult:
    """
    Replace the points of each cube of a grid by their mean, of a cloud that may be larger than memory.

    As :func:`nacre.voxel_downsample`: points, normals and colours are means; attributes are those of the
    input point that is nearest to the mean. The file has the same bytes for any memory, workers, order of the
    points and division into files.

    Parameters
    ----------
    source, output, memory, workers, scheduler, points_per_cell, cells_per_task, progress
        As in :func:`nacre.out_of_core.consolidate`.
    voxel_size : float
        Edge of a cube, in the unit of the points; the cubes have the origin for a corner.

    Returns
    -------
    CloudResult
        Its ``radius`` is the edge.

    Raises
    ------
    TypeError, ValueError, FileFormatError, OSError, ImportError, ConnectionError
        As :func:`nacre.out_of_core.consolidate` does.

    Examples
    --------
    >>> voxel_downsample("scans", "thin.laz", 0.05, memory="2GB")  # doctest: +SKIP
    """
    size = as_length("voxel_size", voxel_size)
    downsample_in_memory(np.zeros((0, 3)), size)
    cloud = CloudWork(source, output, memory, workers, scheduler, points_per_cell, cells_per_task, progress)
    extremes = np.array([cloud.survey.lower, cloud.survey.upper])
    downsample_in_memory(extremes, size)
    method = VoxelMeans(size)
    with cloud.sorted() as store:
        cloud.work(store, method)
        return cloud.write(store, method, size)


@dataclass(frozen=True)
class VoxelMeans:
    """The voxels of a cell; one that lies in several is of the cell that has its point of the lowest hash."""

    size: float

    bytes_per_point = _BYTES_PER_POINT

    @property
    def halo(self) -> float:
        """How far from a cell points of the same voxels are."""
        return _ROUNDING * self.size

    def row_type(self, dtype: np.dtype[Any]) -> np.dtype[Any]:
        """Return the type of the points that went in."""
        return dtype

    def work(self, cell: Cell) -> Rows:
        """Return a point for each voxel."""
        voxels = np.floor(cell.rows["points"].astype(np.float64) / self.size)
        order = np.lexsort((cell.hashes, *voxels.T[::-1]))
        begins = (np.diff(voxels[order], axis=0, prepend=np.inf) != 0).any(axis=1)
        is_own = order[begins] < cell.num_own
        voxel = np.cumsum(begins) - 1
        rows, voxel = cell.rows[order[is_own[voxel]]], voxel[is_own[voxel]]
        cloud = to_cloud(rows)
        means = downsample_in_memory(cloud.points, self.size, normals=cloud.normals, colors=cloud.colors)

        voxel = np.unique(voxel, return_inverse=True)[1]
        away = cloud.points.astype(np.float64) - means.points[voxel]
        nearest = np.lexsort((np.einsum("ij,ij->i", away, away), voxel))
        result: Rows = rows[nearest[np.flatnonzero(np.diff(voxel, prepend=-1))]]
        result["points"] = means.points
        if means.normals is not None:
            result["normals"] = means.normals
        if means.colors is not None:
            result["colors"] = means.colors
        return result
