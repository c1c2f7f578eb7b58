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
        typer.Option(
            "--out",
            "-o",
            metavar="MESH",
            help="The file to write: .ply, .glb, .obj or .stl.",
            show_default="OUT/mesh.ply",
        ),
    ] = None,
    json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = 0,
) -> None:
    """
    Lay triangles over a model, for programs that need them.

    Their corners are its points, with normals and colours. The mesh is open where the model has no points.
    """
    terminal = Terminal(json, quiet, verbose)
    from nacre import read_points, write_mesh
    from nacre.io.meshes import require_mesh_suffix
    from nacre.meshing import triangulate, used_rows

    path = written_file(source, "model.ply") if source.is_dir() else source
    target = writable_file(out or path.with_name("mesh.ply"))
    require_mesh_suffix(target)
    cloud = read_points(path)
    if cloud.normals is None:
        raise CommandError(f"{path} has no normals: give a model of nacre reconstruct")
    triangles = triangulate(cloud.points, cloud.normals)
    if not len(triangles):
        raise CommandError(f"{path} has too few points for a surface, or normals that contradict it")
    rows, corners = used_rows(triangles)
    colors = None if cloud.colors is None else cloud.colors[rows]
    write_mesh(target, cloud.points[rows], corners, normals=cloud.normals[rows], colors=colors)
    figures = {"mesh": str(target), "vertices": len(rows), "triangles": len(corners)}
    if not quiet:
        terminal.answer(figures, [(name, str(value)) for name, value in figures.items()])
