"""A cloud on disk, sorted by cells, from which each cell is read with the points around it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre._internal.cubes import Hashes, order_by_hash, point_hashes
from nacre.out_of_core.grid import Grid
from nacre.out_of_core.rows import Rows, take

_PLAN, _POINTS = "plan.npz", "points.bin"


@dataclass(frozen=True)
class Cell:
    """
    The points of a cell, then those of its halo, in an order that follows from the points alone.

    Attributes
    ----------
    rows : (N,) records
    hashes : (N,) uint64
        Of the points.
    num_own : int
        How many belong to the cell: the first.
    distances : (N - num_own,) float64
        How far points of the halo are from the cell's box, as the largest of the distances along the axes; 0
        within.
    """

    rows: Rows
    hashes: Hashes
    num_own: int
    distances: npt.NDArray[np.float64]


@dataclass(frozen=True)
class Store:
    """
    The points of a cloud in a file, cell after cell, and in a cell cube after cube.

    Attributes
    ----------
    folder : Path
        Where the file is.
    grid : Grid
    dtype : dtype
        Of a row.
    places : (B, 3) int64
        Where the cubes that hold points stand in the grid, in the order of the file.
    starts : (B + 1,) int64
        The first row of each cube, and the number of rows.
    cells : (C + 1,) int64
        The first cube of each cell, and the number of cubes.
    seed : int
        Of the points' hashes.
    """

    folder: Path
    grid: Grid
    dtype: np.dtype[Any]
    places: npt.NDArray[np.int64]
    starts: npt.NDArray[np.int64]
    cells: npt.NDArray[np.int64]
    seed: int

    @property
    def points_file(self) -> Path:
        """The file of the points."""
        return self.folder / _POINTS

    @property
    def num_cells(self) -> int:
        """How many cells there are."""
        return len(self.cells) - 1

    def save(self) -> None:
        """Write all but the points, for other processes to open."""
        np.savez(
            self.folder / _PLAN,
            origin=self.grid.origin, side=self.grid.side, shape=self.grid.shape,
            rows=np.zeros(0, self.dtype), places=self.places, starts=self.starts, cells=self.cells,
            seed=self.seed,
        )  # fmt: skip

    def num_points(self, cell: int, halo: float) -> int:
        """Return how many points are read of a cell with its halo, at most."""
        own = slice(self.cells[cell], self.cells[cell + 1])
        around = self._cubes_around(cell, halo)
        counts = np.diff(self.starts)
        return int(counts[own].sum() + counts[around].sum())

    def read(self, cell: int, halo: float) -> Cell:
        """Read a cell and the points that are not farther from its box than the halo."""
        own = np.arange(self.cells[cell], self.cells[cell + 1])
        around = self._cubes_around(cell, halo)
        own_counts, counts = (self.starts[cubes + 1] - self.starts[cubes] for cubes in (own, around))
        num_own = int(own_counts.sum())
        rows = self._load(np.concatenate([own, around]), num_own + int(counts.sum()))
        distances = _distances(rows["points"][num_own:], *self._box(cell))
        near = np.flatnonzero(distances <= halo)
        rows[num_own : num_own + len(near)] = take(rows[num_own:], near)
        rows = rows[: num_own + len(near)]
        near_counts = np.diff(np.searchsorted(near, np.concatenate([[0], np.cumsum(counts)])))
        starts = np.concatenate([[0], np.cumsum(np.concatenate([own_counts, near_counts]))])
        order, hashes = _canonical_order(rows, point_hashes(rows["points"], self.seed, num_threads=0), starts)
        return Cell(take(rows, order), hashes, num_own, distances[near][order[num_own:] - num_own])

    def _load(self, cubes: npt.NDArray[np.intp], num_points: int) -> Rows:
        """Return the points of cubes as they are in the file."""
        rows = np.empty(num_points, self.dtype)
        content, at = rows.view(np.uint8).data, 0
        with self.points_file.open("rb", buffering=0) as stream:
            for run in np.split(cubes, np.flatnonzero(np.diff(cubes) != 1) + 1) if num_points else []:
                first, last = int(self.starts[run[0]]), int(self.starts[run[-1] + 1])
                end = at + (last - first) * self.dtype.itemsize
                stream.seek(first * self.dtype.itemsize)
                while at < end:
                    num_read = stream.readinto(content[at:end])
                    if not num_read:
                        raise EOFError(f"{self.points_file} became shorter while it was read")
                    at += num_read
        return rows

    def _box(self, cell: int) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
        places = self.places[self.cells[cell] : self.cells[cell + 1]]
        corners = np.array([places.min(axis=0), places.max(axis=0) + 1])
        lower, upper = self.grid.origin + corners * self.grid.side
        return lower, upper

    def _cubes_around(self, cell: int, halo: float) -> npt.NDArray[np.intp]:
        begin, end = self.cells[cell], self.cells[cell + 1]
        places = self.places[begin:end]
        reach = int(min(np.ceil(halo / self.grid.side), self.grid.shape.max()))
        is_near = np.ones(len(self.places), bool)
        for axis in range(3):
            along = self.places[:, axis]
            is_near &= along >= places[:, axis].min() - reach
            is_near &= along <= places[:, axis].max() + reach
        is_near[begin:end] = False
        return np.flatnonzero(is_near)


@lru_cache(maxsize=1)
def open_store(folder: Path) -> Store:
    """Return a store that was saved."""
    with np.load(folder / _PLAN, allow_pickle=False) as plan:
        return _store_of(folder, plan)


def _store_of(folder: Path, plan: Mapping[str, npt.NDArray[Any]]) -> Store:
    return Store(
        folder,
        Grid(plan["origin"], float(plan["side"]), plan["shape"]),
        plan["rows"].dtype,
        plan["places"],
        plan["starts"],
        plan["cells"],
        int(plan["seed"]),
    )


def _canonical_order(
    rows: Rows, hashes: Hashes, starts: npt.NDArray[np.int64]
) -> tuple[npt.NDArray[np.intp], Hashes]:
    """
    Return the order of the hashes in each cube, and the hashes in it.

    Points in one place are in the order of the bytes of all that they have.
    """
    order, ordered = order_by_hash(starts, hashes)
    is_tied = np.zeros(len(order), bool)
    is_tied[1:] = ordered[1:] == ordered[:-1]
    if is_tied.any():
        is_tied[:-1] |= is_tied[1:]
        cubes = np.searchsorted(starts, np.flatnonzero(is_tied), side="right")
        tied = order[is_tied]
        contents = take(rows, tied).view(np.uint8).reshape(len(tied), -1)
        order[is_tied] = tied[np.lexsort((*contents.T[::-1], hashes[tied], cubes))]
    return order, ordered


def _distances(
    points: npt.NDArray[Any], lower: npt.NDArray[np.float64], upper: npt.NDArray[np.float64]
) -> npt.NDArray[np.float64]:
    farthest = np.zeros(len(points))
    for axis in range(3):
        along = points[:, axis].astype(np.float64)
        np.maximum(farthest, np.maximum(lower[axis] - along, along - upper[axis]), out=farthest)
    return farthest
