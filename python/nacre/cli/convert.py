"""``nacre convert``: points, meshes, trajectories, and images with poses in another format."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from nacre.cli.conversions import CONVERSIONS, Job, Target
from nacre.cli.source import CameraOption, DepthScaleOption, FormatOption
from nacre.cli.surfaces import has_faces, mesh_suffixes, point_suffixes
from nacre.cli.terminal import CommandError, Json, Quiet, Terminal, Verbose, writable_file

_TRAJECTORY_SUFFIXES = (".txt", ".log")
_NAMES = {
    "points": "a point file",
    "mesh": "a mesh",
    "trajectory": "a trajectory",
    "run": "a run",
    "recording": "a recording",
}


def convert(
    source: Annotated[
        Path,
        typer.Argument(
            metavar="IN",
            help="Points, a mesh, a trajectory, a recording, or what nacre reconstruct wrote.",
            show_default=False,
        ),
    ],
    out: Annotated[
        Path,
        typer.Argument(
            metavar="OUT",
            help="The file to write, whose ending tells the format; with --to colmap or nerfstudio a folder.",
            show_default=False,
        ),
    ],
    to: Annotated[
        Target | None, typer.Option(help="The format, where no ending tells it.", show_default="as OUT ends")
    ] = None,
    format: FormatOption = None,
    camera: CameraOption = None,
    depth_scale: DepthScaleOption = None,
    json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = 0,
) -> None:
    """
    Write points, meshes, trajectories, and images with poses in another format.

    Points: .ply, .pcd, .las, .laz, .e57, .xyz, .npz. Meshes: .ply, .glb, .obj, .stl; .off is read, too.
    Trajectories: .txt (tum, kitti), .log (redwood). Images with poses: --to colmap, --to nerfstudio.

    Of a run it takes the model, the trajectory, or the recording's images with the poses that were found;
    of a recording the images with the true poses.
    """
    terminal = Terminal(json, quiet, verbose)
    if not source.exists():
        raise CommandError(f"no such file or folder: {source}", 2)
    given = _kind_of(source, is_recording=format is not None)
    wanted = _kind_wanted(given, out, to)
    write = CONVERSIONS.get((given, wanted))
    if write is None:
        raise CommandError(f"{source}: {_advice(given, wanted)}", 2)
    if wanted != "images":
        writable_file(out)
    figures = write(Job(source, out, to, format, camera, depth_scale))
    if not quiet:
        rows = [(name.replace("_", " "), _told(value)) for name, value in figures.items()]
        terminal.answer({"out": out, "kind": wanted, **figures}, [("out", str(out)), *rows])


def _told(value: int | list[str]) -> str:
    return str(value) if isinstance(value, int) else ", ".join(value) or "none"


def _kind_of(path: Path, is_recording: bool) -> str:
    """Return what a file or folder is: points, mesh, trajectory, run or recording."""
    from nacre.datasets.detect import FILE_SUFFIXES

    suffix = path.suffix.lower()
    if path.is_dir() and (path / "report.json").is_file() and not is_recording:
        return "run"
    if path.is_dir() or is_recording or suffix in FILE_SUFFIXES:
        return "recording"
    if suffix in mesh_suffixes() and has_faces(path):
        return "mesh"
    if suffix in point_suffixes():
        return "points"
    if suffix in _TRAJECTORY_SUFFIXES:
        return "trajectory"
    known = dict.fromkeys((*point_suffixes(), *mesh_suffixes(), *_TRAJECTORY_SUFFIXES, *FILE_SUFFIXES))
    raise CommandError(f"{path}: expected a folder or a file that ends in {', '.join(known)}", 2)


def _kind_wanted(given: str, out: Path, to: Target | None) -> str:
    """Return what is to be written: points, mesh, trajectory or images."""
    from nacre.io.meshes import WRITE_SUFFIXES

    if to is not None and out.suffix.lower() in (*point_suffixes(), *WRITE_SUFFIXES):
        raise CommandError(f"{out}: --to {to.value} writes no points or triangles, as the ending says", 2)
    if to is not None:
        return "images" if to in (Target.colmap, Target.nerfstudio) else "trajectory"
    suffix = out.suffix.lower()
    if suffix in WRITE_SUFFIXES and (given == "mesh" or suffix not in point_suffixes()):
        return "mesh"
    if suffix in point_suffixes():
        return "points"
    if suffix in _TRAJECTORY_SUFFIXES:
        return "trajectory"
    known = dict.fromkeys((*point_suffixes(), *WRITE_SUFFIXES, *_TRAJECTORY_SUFFIXES))
    raise CommandError(
        f"{out}: expected an ending of {', '.join(known)}, or a folder with --to colmap or --to nerfstudio", 2
    )


def _advice(given: str, wanted: str) -> str:
    """Say what to do where the one cannot be made of the other."""
    if wanted == "mesh":
        return f"{_NAMES[given]} has no triangles: nacre mesh lays some over a model, or points with normals"
    if wanted == "images":
        return "images with poses come from a recording, or from what nacre reconstruct wrote"
    if given == "recording":
        return "a recording has no points: nacre reconstruct makes a model of it"
    return f"{_NAMES[given]} cannot become {_NAMES[wanted]}"
