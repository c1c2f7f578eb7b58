"""What every function over clouds larger than memory does around its method."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from nacre._internal.arrays import as_count
from nacre._internal.value_equality import Value
from nacre.out_of_core.hashes import LowestHashes
from nacre.out_of_core.memory import as_bytes
from nacre.out_of_core.rows import Rows
from nacre.out_of_core.run import (
    Machines,
    Method,
    require_streamed,
    scratch_folder,
    work_on_cells,
    write_results,
)
from nacre.out_of_core.sorting import sort_into_cells
from nacre.out_of_core.store import Store
from nacre.out_of_core.survey import PathLike, Source, Survey, survey

Progress = Callable[[int, int], object]
POINTS_PER_CELL = 4_000_000
_ROWS_OF_A_SURVEY = 1 << 18


@dataclass(frozen=True, eq=False, repr=False)
class CloudResult(Value):
    """
    What was made of a cloud on disk.

    Attributes
    ----------
    num_input : int
        Points that were read.
    num_left_out : int
        Of these, points that are not finite.
    num_points : int
        Points that were written.
    num_cells : int
        Pieces that were worked on.
    radius : float
        Of the neighbourhoods, in the unit of the points: as given, or from the density of the points.
    halo : float
        How far from a piece's box points were looked at.
    """

    num_input: int
    num_left_out: int
    num_points: int
    num_cells: int
    radius: float
    halo: float


class CloudWork:
    """
    A cloud on disk, what is to be written, and who works on it.

    Its arguments are those of :func:`nacre.out_of_core.consolidate`, which are checked here.
    """

    def __init__(
        self,
        source: PathLike | Iterable[PathLike],
        output: PathLike,
        memory: int | str | None,
        workers: int | None,
        scheduler: str | None,
        points_per_cell: int,
        cells_per_task: int,
        progress: Progress | None,
    ) -> None:
        self.source = Source.of(source)
        self.output = Path(os.fspath(output))
        require_streamed(self.output)
        if not isinstance(scheduler, str | None):
            raise TypeError(f"scheduler must be an address, got {scheduler!r}")
        self._points_per_cell = as_count("points_per_cell", points_per_cell, minimum=1)
        self._machines = Machines(
            as_bytes("memory", memory),
            None if workers is None else as_count("workers", workers, minimum=1),
            scheduler,
            as_count("cells_per_task", cells_per_task, minimum=1),
        )
        self._progress = progress
        self.source.check_memory(self._machines.memory)
        self.survey: Survey = survey(self.source, _ROWS_OF_A_SURVEY)

    @contextmanager
    def sorted(self, seed: int = 0, lowest: LowestHashes | None = None) -> Iterator[Store]:
        """Sort the points into cells beside the output, for as long as this lasts."""
        rows_at_once = self._machines.rows_at_once(self.survey.dtype)
        with scratch_folder(self.output) as folder:
            yield sort_into_cells(
                self.source, self.survey, folder, self._points_per_cell, rows_at_once, seed, lowest
            )

    def work(self, store: Store, method: Method) -> None:
        """Work on all cells; what comes out stays in the folder of the store."""
        work_on_cells(store, method, self._machines, self._progress)

    def write(
        self,
        store: Store,
        method: Method,
        radius: float,
        select: Callable[[Rows], Rows] | None = None,
    ) -> CloudResult:
        """Write what came out, or what is selected of it."""
        num_points = write_results(store, method.row_type(store.dtype), self.output, select)
        of = self.survey
        return CloudResult(
            of.num_points + of.num_left_out,
            of.num_left_out,
            num_points,
            store.num_cells,
            radius,
            method.halo,
        )
