"""``nacre mesh``: triangles over a model."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from nacre.cli.terminal import CommandError, Json, Quiet, Terminal, Verbose, writable_file, written_file


def mesh(
    source: Annotated[
        Path,
        typer.Argument(
            metavar="OUT",
            help="What nacre reconstruct wrote, or points with normals.",
            show_default=False,
        ),
    ],
    out: Annotated[
        Path | None,
        typer.Option("--out", "-o", metavar="MESH", help="The file to write.", show_default="OUT/mesh.ply"),
    ] = None,
    cell: Annotated[
        float | None,
        typer.Option(help="Edge of the grid's cells (metres).", show_default="the points' distance"),
    ] = None,
    json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = 0,
) -> None:
    """
    Lay triangles over a model, for programs that need them.

    The mesh is open where the model has no points. It needs the extra "mesh".
    """
    terminal = Terminal(json, quiet, verbose)
    from nacre import read_points, write_mesh
    from nacre.meshing import mesh_points

    path = written_file(source, "model.ply") if source.is_dir() else source
    target = writable_file(out or path.with_name("mesh.ply"))
    if target.suffix.lower() != ".ply":
        raise CommandError(f"meshes are written to .ply files, got {target}", 2)
    cloud = read_points(path)
    if cloud.normals is None:
        raise CommandError(f"{path} has no normals: give a model of nacre reconstruct")
    made = mesh_points(cloud.points, cloud.normals, cell=cell)
    write_mesh(target, made.vertices, made.triangles)
    figures = {"mesh": str(target), "vertices": len(made.vertices), "triangles": len(made.triangles)}
    if not quiet:
        terminal.answer(figures, [(name, str(value)) for name, value in figures.items()])
