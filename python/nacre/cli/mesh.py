"""``nacre mesh``: triangles over a model."""

from __future__ import annotations

import dataclasses
import enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from nacre.cli.source import reopen
from nacre.cli.surfaces import has_faces, mesh_suffixes
from nacre.cli.terminal import CommandError, Json, Quiet, Terminal, Verbose, writable_file, written_file

if TYPE_CHECKING:
    from nacre.io.cloud import Cloud
    from nacre.io.mesh_arrays import MeshArrays
    from nacre.meshing import TextureView

_UNSEEN = 128  # grey
_SEEN = 224  # light grey, of a model without colours


class Keep(str, enum.Enum):
    """Which parts of a mesh."""

    all = "all"
    largest = "largest"


def mesh(
    source: Annotated[
        Path,
        typer.Argument(
            metavar="OUT",
            help="What nacre reconstruct wrote, points with normals, or a mesh to simplify.",
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
            show_default="OUT/mesh.ply, with --texture OUT/mesh.glb",
        ),
    ] = None,
    closed: Annotated[
        bool,
        typer.Option(
            "--closed",
            help="Close the surface (screened Poisson); what was never seen is grey, and a guess.",
        ),
    ] = False,
    keep: Annotated[Keep, typer.Option(help="Which of the parts that nothing joins.")] = Keep.all,
    num_triangles: Annotated[
        int | None,
        typer.Option(
            "--simplify", min=1, metavar="N", help="Leave N triangles, where they matter.", show_default=False
        ),
    ] = None,
    texture: Annotated[
        bool,
        typer.Option("--texture", help="Paint it with the recording's sharpest images; .glb or .obj."),
    ] = False,
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
    from nacre.io.meshes import read_mesh_arrays, require_mesh_suffix
    from nacre.meshing import largest_part, part_sizes
    from nacre.run_data.text import count

    if not source.exists():
        raise CommandError(
            f"there is no {source}: give the folder that nacre reconstruct wrote to, or points", 2
        )
    path = written_file(source, "model.ply") if source.is_dir() else source
    target = writable_file(out or path.with_name("mesh.glb" if texture else "mesh.ply"))
    require_mesh_suffix(target, textured=texture)
    views = _views(source) if texture else []
    is_mesh = not closed and path.suffix.lower() in mesh_suffixes() and has_faces(path)
    steps = 3 - is_mesh + (keep is Keep.largest) + (num_triangles is not None) + texture
    left_out: list[int] = []
    with terminal.progress("steps", steps) as begin:
        begin("reading")
        if is_mesh:
            mesh = read_mesh_arrays(path)
            comments = mesh.comments
        else:
            cloud = read_points(path)
            comments = cloud.comments
            begin("closing the surface" if closed else "laying triangles")
            mesh = _surface(path, cloud, closed)
        if not len(mesh.triangles):
            raise CommandError(f"{path} has too few points for a surface, or normals that contradict it")
        if keep is Keep.largest:
            begin("choosing parts")
            left_out = part_sizes(mesh.triangles)[1:].tolist()
        if left_out:
            mesh = _used(dataclasses.replace(mesh, triangles=largest_part(mesh.triangles)))
        if num_triangles is not None:
            begin("simplifying")
            mesh = _simplified(mesh, num_triangles)
            if len(mesh.triangles) > num_triangles:
                terminal.say(
                    f"{count(len(mesh.triangles))} triangles are left, since parts and holes do not vanish "
                    "(--keep largest, --closed)"
                )
        if texture:
            begin("painting")
            mesh = _textured(mesh, views)
        begin("writing")
        write_mesh(
            target,
            mesh.vertices,
            mesh.triangles,
            normals=mesh.normals,
            colors=mesh.colors,
            attributes=_stored_attributes(target, mesh),
            texture=mesh.texture,
            comments=comments,
        )
    figures: dict[str, Any] = {
        "mesh": str(target),
        "vertices": len(mesh.vertices),
        "triangles": len(mesh.triangles),
    }
    if mesh.texture is not None:
        figures["images"] = len(views)
        figures["texture"] = list(mesh.texture.image.shape[1::-1])
    if left_out:
        figures["left_out"] = left_out
    if "seen" in mesh.attributes:
        figures["seen"] = _seen_area(mesh)
    if not quiet:
        terminal.answer(
            figures, [(name.replace("_", " "), _words(name, value)) for name, value in figures.items()]
        )


def _surface(path: Path, cloud: Cloud, closed: bool) -> MeshArrays:
    """Return the mesh that the points of a file make."""
    if cloud.normals is None:
        raise CommandError(f"{path} has no normals: nacre normals {path} OUT.ply estimates them")
    return _closed(cloud) if closed else _open(cloud)


def _stored_attributes(target: Path, mesh: MeshArrays) -> dict[str, Any]:
    """Return what is written of the vertices; where the format has colours, these tell what was seen."""
    from nacre.io.meshes import lost_in

    lost = lost_in(target, mesh)
    is_told = mesh.colors is not None and "colors" not in lost
    return {
        name: values
        for name, values in mesh.attributes.items()
        if not (name == "seen" and name in lost and is_told)
    }


def _words(name: str, value: Any) -> str:
    from nacre.run_data.text import count

    if name == "seen":
        return f"{value:.1%} of the area; the rest is a guess"
    if name == "left_out":
        return (
            f"{count(len(value))} parts, of {count(value[0])} triangles at most"
            if len(value) > 1
            else f"a part of {count(value[0])}"
        )
    if name == "texture":
        return " x ".join(map(str, value))
    return count(value) if isinstance(value, int) else str(value)


def _seen_area(mesh: MeshArrays) -> float:
    """Return the part of the surface whose corners were seen."""
    import numpy as np

    a, b, c = (mesh.vertices[mesh.triangles[:, i]] for i in range(3))
    areas = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    seen = mesh.attributes["seen"][mesh.triangles].mean(axis=1)
    return float(np.average(seen, weights=areas)) if areas.any() else 0.0


def _views(source: Path) -> list[TextureView]:
    """Choose the images to paint with, of frames whose pose is sure where there are some."""
    import numpy as np

    from nacre.meshing import texture_views
    from nacre.run_data.saved_run import SavedRun

    if source.is_file():
        raise CommandError(
            f"--texture needs the folder of nacre reconstruct, which knows the images: {source} is a file", 2
        )
    written_file(source, "report.json")
    run = SavedRun(source)
    sequence, poses = reopen(run)
    if not sequence.has_color:
        raise CommandError(f"{sequence.path} has no colour images, which --texture paints with")
    weak = [frame.index for frame in run.frames if frame.status == "WEAK"]
    if len(weak) < np.isfinite(poses[:, 0, 0]).sum():
        poses[weak] = np.nan  # they may lie beside their places
    return texture_views(sequence, poses)


def _textured(mesh: MeshArrays, views: list[TextureView]) -> MeshArrays:
    """Paint a mesh with images; what is a guess keeps its colour."""
    from nacre.meshing import texture_mesh

    texture = texture_mesh(
        mesh.vertices, mesh.triangles, views, colors=mesh.colors, is_seen=mesh.attributes.get("seen")
    )
    return dataclasses.replace(mesh, texture=texture)


def _open(cloud: Cloud) -> MeshArrays:
    """Join the points."""
    from nacre.io.mesh_arrays import MeshArrays
    from nacre.meshing import triangulate

    assert cloud.normals is not None
    return _used(
        MeshArrays(cloud.points, triangulate(cloud.points, cloud.normals), cloud.normals, cloud.colors)
    )


def _closed(cloud: Cloud) -> MeshArrays:
    """Lay a closed surface through the points; what was never seen is grey, else light without colours."""
    import numpy as np

    from nacre import KdTree
    from nacre.io.mesh_arrays import MeshArrays
    from nacre.meshing import close_surface

    assert cloud.normals is not None
    found = close_surface(cloud.points, cloud.normals)
    colors = np.full(found.vertices.shape, _SEEN, np.uint8)
    if cloud.colors is not None:
        colors = cloud.colors[KdTree(cloud.points).query(found.vertices, 1)[1]]
    colors[~found.is_seen] = _UNSEEN
    seen = {"seen": found.is_seen.astype(np.uint8)}
    return MeshArrays(found.vertices, found.triangles, found.normals, colors, seen)


def _used(mesh: MeshArrays) -> MeshArrays:
    """Leave out the vertices of no triangle."""
    from nacre.meshing import used_rows

    rows, triangles = used_rows(mesh.triangles)
    return _rows_of(mesh, rows, mesh.vertices[rows], triangles)


def _simplified(mesh: MeshArrays, num_triangles: int) -> MeshArrays:
    """Leave so many triangles; a corner has what its nearest one had."""
    from nacre import KdTree
    from nacre.meshing import simplify

    vertices, triangles = simplify(mesh.vertices, mesh.triangles, num_triangles)
    return _rows_of(mesh, KdTree(mesh.vertices).query(vertices, 1)[1], vertices, triangles)


def _rows_of(mesh: MeshArrays, rows: Any, vertices: Any, triangles: Any) -> MeshArrays:
    """Return a mesh whose vertices have what some of another's have."""
    return dataclasses.replace(
        mesh,
        vertices=vertices,
        triangles=triangles,
        normals=None if mesh.normals is None else mesh.normals[rows],
        colors=None if mesh.colors is None else mesh.colors[rows],
        attributes={name: values[rows] for name, values in mesh.attributes.items()},
    )
