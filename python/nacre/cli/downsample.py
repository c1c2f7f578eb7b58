"""``nacre downsample``: one point for each cube of a grid."""

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


def downsample(
    source: SourceArgument,
    out: OutArgument,
    voxel_size: Annotated[
        float, typer.Option(help="Edge of a cube, in the unit of the points.", show_default=False)
    ],
    memory: MemoryOption = None,
    points_per_cell: PointsPerCellOption = POINTS_PER_CELL,
    workers: WorkersOption = None,
    scheduler: SchedulerOption = None,
    json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = 0,
) -> None:
    """
    Replace the points of each cube of a grid by their mean, of a cloud of any size.

    Normals and colours are means, too; all else is that of the point nearest to the mean.
    """
    terminal = Terminal(json, quiet, verbose)
    from nacre.out_of_core import voxel_downsample

    write_cloud(
        terminal,
        out,
        lambda progress: voxel_downsample(
            source,
            out,
            voxel_size,
            memory=memory,
            points_per_cell=points_per_cell,
            workers=workers,
            scheduler=scheduler,
            progress=progress,
        ),
    )
