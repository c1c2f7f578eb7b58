"""``nacre normals``: the normals of a cloud."""

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


def normals(
    source: SourceArgument,
    out: OutArgument,
    k: Annotated[int, typer.Option(min=3, help="Neighbours of a plane, the point itself included.")] = 16,
    max_radius: Annotated[
        float | None,
        typer.Option(
            help="Neighbours farther away are not used, in the unit of the points.",
            show_default="from the points' density",
        ),
    ] = None,
    viewpoint: Annotated[
        tuple[float, float, float], typer.Option(metavar="X Y Z", help="Normals point to this side.")
    ] = (0.0, 0.0, 0.0),
    memory: MemoryOption = None,
    points_per_cell: PointsPerCellOption = POINTS_PER_CELL,
    workers: WorkersOption = None,
    scheduler: SchedulerOption = None,
    json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = 0,
) -> None:
    """
    Estimate the normals of a cloud of any size, from the planes through each point's nearest neighbours.

    Everything else that the points have is kept; they come in another order.
    """
    terminal = Terminal(json, quiet, verbose)
    from nacre.out_of_core import estimate_normals

    write_cloud(
        terminal,
        out,
        lambda progress: estimate_normals(
            source,
            out,
            k=k,
            max_radius=max_radius,
            viewpoint=viewpoint,
            memory=memory,
            points_per_cell=points_per_cell,
            workers=workers,
            scheduler=scheduler,
            progress=progress,
        ),
    )
