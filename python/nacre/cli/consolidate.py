"""``nacre consolidate``: fewer, evenly spread points in place of many noisy ones."""

from __future__ import annotations

from enum import Enum
from pathlib import Path
from typing import Annotated, Any

import typer

from nacre.cli.large_clouds import (
    POINTS_PER_CELL,
    MemoryOption,
    PointsPerCellOption,
    SchedulerOption,
    SourceArgument,
    WorkersOption,
    is_large,
    write_cloud,
)
from nacre.cli.terminal import CommandError, Json, Quiet, Terminal, Verbose, writable_file


class Method(str, Enum):
    """Which form of WLOP."""

    wlop = "wlop"
    wlop_plus = "wlop+"
    cgal = "cgal"


def consolidate(
    source: SourceArgument,
    out: Annotated[
        Path, typer.Argument(metavar="OUT", help="The file to write, in one of these.", show_default=False)
    ],
    radius: Annotated[
        float | None,
        typer.Option(
            help="Support radius, in the unit of the points.", show_default="from the points' density"
        ),
    ] = None,
    num_points: Annotated[int, typer.Option(min=1, help="Points of the result.")] = 2000,
    iterations: Annotated[int, typer.Option(min=0, help="How often the points move.")] = 10,
    mu: Annotated[float, typer.Option(min=0, max=0.5, help="Weight of the repulsion.")] = 0.4,
    method: Annotated[
        Method, typer.Option(help="wlop: Huang et al. 2009; wlop+: repaired; cgal: with CGAL's kernel.")
    ] = Method.wlop,
    seed: Annotated[int, typer.Option(min=0, help="Of the choice of points.")] = 0,
    memory: MemoryOption = None,
    points_per_cell: PointsPerCellOption = POINTS_PER_CELL,
    workers: WorkersOption = None,
    scheduler: SchedulerOption = None,
    json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = 0,
) -> None:
    """
    Replace a noisy point set by fewer, evenly spread, denoised points (WLOP).

    Normals, colours and every other field of the file are carried along. With --memory, --workers or
    --scheduler, of a folder, and where the cloud is larger than memory, it is done by pieces on disk.
    """
    terminal = Terminal(json, quiet, verbose)
    if scheduler or workers or is_large(source, memory):
        from nacre.out_of_core import consolidate as consolidate_out_of_core

        write_cloud(
            terminal,
            out,
            lambda progress: consolidate_out_of_core(
                source,
                out,
                num_points=num_points,
                radius=radius,
                iterations=iterations,
                mu=mu,
                method=method.value,
                seed=seed,
                memory=memory,
                points_per_cell=points_per_cell,
                workers=workers,
                scheduler=scheduler,
                progress=progress,
            ),
        )
        return
    import numpy as np

    import nacre
    from nacre.evaluation import uniformity
    from nacre.io.points import require_point_suffix
    from nacre.run_data.text import count

    writable_file(out)
    require_point_suffix(out)
    cloud = nacre.read_points(source)
    finite = int(np.isfinite(cloud.points).all(axis=1).sum())
    if finite == 0:
        raise CommandError(f"{source}: no point of {len(cloud)} is finite")
    attributes = dict(cloud.attributes)
    left_out = [name for name, array in attributes.items() if array.dtype.kind not in "buif"]
    for name in left_out:
        del attributes[name]
    cargo = dict(attributes)
    own = {"normals": cloud.normals, "colors": cloud.colors}
    cargo |= {name: array for name, array in own.items() if array is not None}
    try:
        result = nacre.consolidate(
            cloud.points,
            radius=radius,
            num_points=num_points,
            iterations=iterations,
            mu=mu,
            method=method.value,
            attributes=cargo,
            seed=seed,
        )
    except ValueError as error:
        if radius is not None:
            raise
        raise CommandError(f"{error}; give --radius", 2) from None
    nacre.write_points(
        out,
        result.points,
        normals=result.attributes.get("normals") if cloud.normals is not None else None,
        colors=result.attributes.get("colors") if cloud.colors is not None else None,
        attributes={name: result.attributes[name] for name in attributes},
    )
    before, after = uniformity(cloud.points), uniformity(result.points)
    carried = [*(name for name, array in own.items() if array is not None), *attributes]
    origin = "from the density of the points" if radius is None else "given"
    terminal.say(f"radius {result.radius:.4g} ({origin})")
    terminal.say(f"{count(len(cloud))} points to {count(len(result))} in {out}")
    if len(result) > 1:
        terminal.say(
            f"uniformity {before.coefficient_of_variation:.3f} to {after.coefficient_of_variation:.3f} "
            "(variation of spacing; random points: 0.52)"
        )
    terminal.say(f"carried along: {', '.join(carried) or 'nothing else was there'}")
    if left_out:
        terminal.say(f"left out (not numbers): {', '.join(left_out)}")
    if json:
        figures: dict[str, Any] = {
            "out": out, "radius": result.radius, "radius_given": radius is not None,
            "num_input": len(cloud), "num_points": len(result),
            "uniformity": after.as_dict(), "uniformity_before": before.as_dict(), "carried": carried,
            "left_out": left_out,
        }  # fmt: skip
        from nacre.io.json_files import to_json

        print(to_json(figures))
