"""The points of a cloud are sorted into the cubes of a grid, on disk."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from itertools import islice
from pathlib import Path
from threading import Lock
from typing import Any, BinaryIO, TypeVar

import numpy as np
import numpy.typing as npt

from nacre._internal.cubes import group_by_number, point_hashes
from nacre.out_of_core.grid import Grid, Keys, divide_into_cells
from nacre.out_of_core.hashes import LowestHashes
from nacre.out_of_core.rows import Rows, take
from nacre.out_of_core.store import Store
from nacre.out_of_core.survey import Source, Survey, finite_rows
from nacre.system import default_threads

Item = TypeVar("Item")

_MOST_UNMERGED = 64


def sort_into_cells(
    source: Source,
    survey: Survey,
    folder: Path,
    points_per_cell: int,
    num_rows: int,
    seed: int = 0,
    lowest: LowestHashes | None = None,
) -> Store:
    """
    Write the points of a cloud to a folder, sorted by cells.

    Parameters
    ----------
    source : Source
    survey : Survey
        What is known of it.
    folder : Path
        Where the store is made.
    points_per_cell : int
        The most points of a cell that can be divided.
    num_rows : int
        How many points are in memory at once, for each thread.
    seed : int
        Of the points' hashes.
    lowest : LowestHashes, optional
        Is shown the hashes of all points, twice.

    Returns
    -------
    Store
        Saved in the folder.
    """
    grid = Grid.of(survey)
    keys, counts = _count(source, survey, num_rows, grid, seed, lowest)
    cells = divide_into_cells(grid.places(keys), counts, points_per_cell)
    order = np.concatenate(cells)
    store = Store(
        folder,
        grid,
        survey.dtype,
        grid.places(keys[order]),
        np.concatenate([[0], np.cumsum(counts[order])]),
        np.concatenate([[0], np.cumsum([len(cell) for cell in cells])]),
        seed,
    )
    store.save()
    place_of_key = np.empty(len(keys), np.int64)
    place_of_key[order] = np.arange(len(order))
    with store.points_file.open("wb") as stream:
        writer = _Writer(stream, store, keys, place_of_key, lowest)
        _for_each(writer.write, finite_rows(source, survey, num_rows))
    return store


def _count(
    source: Source, survey: Survey, num_rows: int, grid: Grid, seed: int, lowest: LowestHashes | None
) -> tuple[Keys, npt.NDArray[np.int64]]:
    """Return the cubes that hold points, in ascending order, and how many each holds."""
    lock = Lock()
    found: list[tuple[Keys, npt.NDArray[np.int64]]] = []

    def count(rows: Rows) -> None:
        keys, counts, _ = group_by_number(grid.keys(rows["points"]))
        hashes = None if lowest is None else point_hashes(rows["points"], seed)
        with lock:
            found.append((keys, counts))
            if len(found) > _MOST_UNMERGED:
                found[:] = [_merged(found)]
            if lowest is not None and hashes is not None:
                lowest.count(hashes)

    _for_each(count, finite_rows(source, survey, num_rows))
    return _merged(found)


def _merged(found: list[tuple[Keys, npt.NDArray[np.int64]]]) -> tuple[Keys, npt.NDArray[np.int64]]:
    """Return the sums of counts by their keys, in ascending order."""
    keys, inverse = np.unique(np.concatenate([keys for keys, _ in found]), return_inverse=True)
    counts = np.zeros(len(keys), np.int64)
    np.add.at(counts, inverse, np.concatenate([counts for _, counts in found]))
    return keys, counts


class _Writer:
    """Writes points where those of their cube are; in which order is left to who reads them."""

    def __init__(
        self, stream: BinaryIO, store: Store, keys: Keys, place_of_key: Keys, lowest: LowestHashes | None
    ) -> None:
        self._stream = stream
        self._store = store
        self._keys = keys
        self._place_of_key = place_of_key
        self._lowest = lowest
        self._ends = store.starts[:-1].copy()  # up to where each cube has been written
        self._lock = Lock()

    def write(self, rows: Rows) -> None:
        """Write some points; several threads may."""
        if self._lowest is not None:
            self._lowest.keep(point_hashes(rows["points"], self._store.seed))
        keys, counts, by_cube = group_by_number(self._store.grid.keys(rows["points"]))
        cubes = self._place_of_key[np.searchsorted(self._keys, keys)]
        content = take(rows, by_cube).view(np.uint8).data
        itemsize = self._store.dtype.itemsize
        ends = np.cumsum(counts) * itemsize
        with self._lock:
            places = self._ends[cubes] * itemsize
            self._ends[cubes] += counts
            for begin, end, place in zip([0, *ends.tolist()], ends.tolist(), places.tolist(), strict=False):
                self._stream.seek(place)
                self._stream.write(content[begin:end])


def _for_each(work: Callable[[Item], Any], items: Iterable[Item]) -> None:
    """Work on pieces in threads, on few enough at once that memory holds them."""
    num_threads = default_threads()
    pieces: Iterator[Item] = iter(items)
    with ThreadPoolExecutor(num_threads) as pool:
        while batch := list(islice(pieces, num_threads)):
            for _ in pool.map(work, batch):
                pass
