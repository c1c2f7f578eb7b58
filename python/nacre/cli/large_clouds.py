"""What the commands over point files share that need not fit in memory."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from nacre.cli.terminal import Terminal, writable_file

if TYPE_CHECKING:
    from nacre.out_of_core import CloudResult

SourceArgument = Annotated[
    Path,
    typer.Argument(
        metavar="IN", help="A point file (PLY, PCD, LAS, LAZ, ...), or a folder of them.", show_default=False
    ),
]
OutArgument = Annotated[
    Path,
    typer.Argument(metavar="OUT", help="The file to write (PLY, PCD, LAS, LAZ).", show_default=False),
]
MemoryOption = Annotated[
    str | None,
    typer.Option(
        metavar="SIZE",
        help="Memory of all processes together, e.g. 2GB: larger clouds are worked on by pieces on disk.",
        show_default="half of the machine's",
    ),
]
WorkersOption = Annotated[
    int | None,
    typer.Option(
        min=1,
        metavar="N",
        help="So many processes on this machine, as far as memory allows.",
        show_default="one",
    ),
]
SchedulerOption = Annotated[
    str | None,
    typer.Option(
        metavar="ADDRESS",
        help="A Dask scheduler whose workers do it, e.g. tcp://10.0.0.1:8786; all see the same disk.",
        show_default=False,
    ),
]
PointsPerCellOption = Annotated[
    int,
    typer.Option(
        min=1,
        metavar="N",
        help="The most points of a piece; fewer need less memory, and change the result by rounding alone.",
    ),
]
POINTS_PER_CELL = 4_000_000

_BYTES_PER_BYTE = 10  # of memory, of a file that is worked on as a whole


@contextmanager
def _following(terminal: Terminal) -> Iterator[Callable[[int, int], None]]:
    """Show how many cells are done; how many there are is known with the first."""
    with ExitStack() as bar:
        advance: list[Callable[[str], None]] = []

        def told(_done: int, total: int) -> None:
            if not advance:
                advance.append(bar.enter_context(terminal.progress("cells", total)))
            advance[0]("")

        yield told


def is_large(source: Path, memory: str | None) -> bool:
    """Say whether a cloud is to be worked on by pieces: a folder, a bound, or more than fits in memory."""
    from nacre.out_of_core.memory import as_bytes

    if memory is not None or source.is_dir():
        return True
    return source.is_file() and source.stat().st_size * _BYTES_PER_BYTE > as_bytes("memory", None)


def write_cloud(
    terminal: Terminal, out: Path, method: Callable[[Callable[[int, int], None]], CloudResult]
) -> None:
    """Write what a method makes of a cloud, which tells its progress; say what became of the cloud."""
    from nacre.run_data.text import count

    writable_file(out)
    with _following(terminal) as progress:
        result = method(progress)
    figures = {
        "out": out, "num_input": result.num_input, "num_left_out": result.num_left_out,
        "num_points": result.num_points, "num_cells": result.num_cells, "radius": result.radius,
        "halo": result.halo,
    }  # fmt: skip
    rows = [
        ("points", f"{count(result.num_input)} to {count(result.num_points)} in {out}"),
        ("cells", f"{count(result.num_cells)}, each with a halo of {result.halo:.4g}"),
        ("radius", f"{result.radius:.4g}"),
    ]
    if result.num_left_out:
        rows.insert(1, ("left out", f"{count(result.num_left_out)} that are not finite"))
    terminal.answer(figures, rows)
