"""``nacre outliers``: a cloud without the points that are far from all others."""

from __future__ import annotations

from typing import Annotated

import typer

from nacre.cli.large_clouds import (
    POINTS_PER_CELL,
    MemoryOption,
    OutArgument,
    PointsPerCellOption,
    SchedulerOption,
    SourceArgument,
    WorkersOption,
    write_cloud,
)
from nacre.cli.terminal import Json, Quiet, Terminal, Verbose


def outliers(
    source: SourceArgument,
    out: OutArgument,
    k: Annotated[int, typer.Option(min=1, help="Neighbours that are looked at.")] = 16,
    std_ratio: Annotated[
        float,
        typer.Option(min=0, help="Standard deviations by which a point may be farther from them than most."),
    ] = 2.0,
    max_radius: Annotated[
        float | None,
        typer.Option(
            help="Neighbours farther away count as so far, in the unit of the points.",
            show_default="from the points' density",
        ),
    ] = None,
    memory: MemoryOption = None,
    points_per_cell: PointsPerCellOption = POINTS_PER_CELL,
    workers: WorkersOption = None,
    scheduler: SchedulerOption = None,
    json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = 0,
) -> None:
    """
    Leave out the points of a cloud of any size that are far from their neighbours.

    What stays has all that it had; the points come in another order.
    """
    terminal = Terminal(json, quiet, verbose)
    from nacre.out_of_core import remove_outliers

    write_cloud(
        terminal,
        out,
        lambda progress: remove_outliers(
            source,
            out,
            k=k,
            std_ratio=std_ratio,
            max_radius=max_radius,
            memory=memory,
            points_per_cell=points_per_cell,
            workers=workers,
            scheduler=scheduler,
            progress=progress,
        ),
    )
