"""A cloud is worked on cell by cell, in this process or in others, and written."""

from __future__ import annotations

import logging
import os
import shutil
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from nacre.io.points import STREAMED_SUFFIXES, needs_extremes, widen, write_chunks
from nacre.out_of_core.memory import PER_PROCESS
from nacre.out_of_core.rows import Rows, to_cloud
from nacre.out_of_core.store import Cell, Store, open_store

_log = logging.getLogger("nacre.out_of_core")

_CELLS_PER_TASK = 1
_ROWS_PER_CHUNK = 1 << 20


class Method(Protocol):
    """What is done with each cell."""

    @property
    def halo(self) -> float:
        """How far from a cell's box points may be that matter, in the unit of the points."""

    @property
    def bytes_per_point(self) -> int:
        """Of memory, for each point of a cell with its halo, beside the rows themselves."""

    def row_type(self, dtype: np.dtype[Any]) -> np.dtype[Any]:
        """Return the type of the rows that come out, of that of those that go in."""

    def work(self, cell: Cell) -> Rows:
        """Return what becomes of a cell."""


@dataclass(frozen=True)
class Machines:
    """
    Who works, and on how much at once.

    Attributes
    ----------
    memory : int
        Bytes, of all processes on this machine together.
    workers : int or None
        Processes on this machine; None or 1: this one.
    scheduler : str or None
        The address of a Dask scheduler, whose workers work in place of processes on this machine.
    cells_per_task : int
        How many cells are given to a worker at once; changes no result.
    """

    memory: int
    workers: int | None = None
    scheduler: str | None = None
    cells_per_task: int = _CELLS_PER_TASK

    def rows_at_once(self, dtype: np.dtype[Any]) -> int:
        """Return how many points are in memory at once while the cloud is sorted, for each thread."""
        per_row = 6 * dtype.itemsize + 150
        return int(np.clip((self.memory - PER_PROCESS) // (4 * per_row), 1 << 14, 1 << 20))


@contextmanager
def scratch_folder(output: Path) -> Iterator[Path]:
    """Make a folder beside a file for what is needed until it is written."""
    folder = Path(tempfile.mkdtemp(dir=output.parent, prefix=f".{output.name}.", suffix=".cells")).resolve()
    try:
        yield folder
    except OSError as error:
        if error.errno is not None and _is_within(error.filename, folder):
            raise OSError(
                error.errno, f"{error.strerror} (for cells beside the output)", str(output)
            ) from error
        raise
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _is_within(name: str | bytes | None, folder: Path) -> bool:
    """Say whether an error is about a file in the folder, or names none: then it was being written."""
    return name is None or Path(os.fsdecode(name)).resolve().is_relative_to(folder)


def require_streamed(output: Path) -> None:
    """Raise where a file cannot be written in pieces."""
    if output.suffix.lower() not in STREAMED_SUFFIXES:
        raise ValueError(f"output must end in {', '.join(STREAMED_SUFFIXES)}, got {str(output)!r}")


def work_on_cells(
    store: Store, method: Method, machines: Machines, progress: Callable[[int, int], Any] | None = None
) -> None:
    """
    Work on all cells of a store, and keep what comes out in its folder.

    Raises
    ------
    ValueError
        Memory does not hold a cell; the message has what is needed.
    ConnectionError
        The scheduler went away, or workers died again and again; nothing is lost but what they had done.
    """
    num_processes = _num_processes(store, method, machines)
    tasks = [
        range(first, min(first + machines.cells_per_task, store.num_cells))
        for first in range(0, store.num_cells, machines.cells_per_task)
    ]
    finished = (
        (_work_on(store.folder, method, task) for task in tasks)
        if machines.scheduler is None and num_processes == 1
        else _finished_by_cluster(store, method, tasks, machines.scheduler, num_processes)
    )
    num_done = 0
    for task in finished:
        num_done += len(task)
        if progress is not None:
            progress(num_done, store.num_cells)


def write_results(
    store: Store, dtype: np.dtype[Any], output: Path, select: Callable[[Rows], Rows] | None = None
) -> int:
    """Write what is selected of what came out of the cells as one file, in their order; return the number."""

    def selected() -> Iterator[Rows]:
        pieces = read_results(store, dtype)
        return pieces if select is None else map(select, pieces)

    extremes = np.array([np.full(3, np.inf), np.full(3, -np.inf)])
    if select is None:
        sizes = (_result_file(store.folder, cell).stat().st_size for cell in range(store.num_cells))
        num_points = sum(sizes) // dtype.itemsize
    else:
        num_points = sum(map(len, selected()))
    if needs_extremes(output):
        for rows in selected():
            widen(extremes, rows["points"])
    pieces = chain([np.zeros(0, dtype)], selected())  # one at least, for the header
    write_chunks(output, map(to_cloud, pieces), num_points, extremes)
    return num_points


def read_results(store: Store, dtype: np.dtype[Any]) -> Iterator[Rows]:
    """Yield what came out of the cells in their order, in pieces."""
    for cell in range(store.num_cells):
        with _result_file(store.folder, cell).open("rb") as stream:
            while len(rows := np.fromfile(stream, dtype, _ROWS_PER_CHUNK)):
                yield rows


def _work_on(folder: Path, method: Method, cells: range) -> range:
    """Work on some cells; done twice, the same comes out."""
    store = open_store(folder)
    for number in cells:
        rows = method.work(store.read(number, method.halo))
        path = _result_file(folder, number)
        with tempfile.NamedTemporaryFile(dir=folder, delete=False) as stream:
            rows.tofile(stream)
        Path(stream.name).replace(path)
    return cells


def _result_file(folder: Path, cell: int) -> Path:
    return folder / f"cell{cell:07d}.bin"


def _num_processes(store: Store, method: Method, machines: Machines) -> int:
    """Return how many processes memory is enough for, of those that are asked for."""
    largest = max(store.num_points(cell, method.halo) for cell in range(store.num_cells))
    needed = PER_PROCESS + largest * (3 * store.dtype.itemsize + 32 + method.bytes_per_point)
    if machines.scheduler is not None:
        return 1
    is_alone = machines.workers in (None, 1)
    most = (machines.memory - (0 if is_alone else PER_PROCESS)) // needed
    if most < 1:
        least = needed + (0 if is_alone else PER_PROCESS)
        raise ValueError(
            f"memory must be at least {least / 1e9:.2f}GB for the {largest} points of the largest cell with "
            f"its halo of {method.halo:.4g}, got {machines.memory / 1e9:.2f}GB; a smaller radius, or "
            "fewer points_per_cell, need less"
        )
    wanted = machines.workers or 1
    if most < wanted:
        _log.warning("memory holds %d of %d workers, which need %.2f GB each", most, wanted, needed / 1e9)
    return int(min(wanted, most))


def _finished_by_cluster(
    store: Store, method: Method, tasks: Sequence[range], scheduler: str | None, num_processes: int
) -> Iterator[range]:
    from nacre._internal.cluster import cluster_client, import_distributed

    distributed = import_distributed()
    with cluster_client(scheduler, num_processes, len(tasks)) as client:
        futures = client.map(
            _work_on, [store.folder] * len(tasks), [method] * len(tasks), tasks, pure=False, retries=2
        )
        for future in distributed.as_completed(futures):
            try:
                cells = future.result()
            except (distributed.CancelledError, distributed.KilledWorker) as error:
                reason = "the scheduler went away"
                if isinstance(error, distributed.KilledWorker):
                    reason = "a worker died, and so did those that tried again: is there enough memory?"
                raise ConnectionError(
                    f"{reason}; nothing was written, the same command starts anew"
                ) from None
            yield cells
            future.release()
