"""``nacre align``: one cloud onto another."""

from __future__ import annotations

from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from nacre.cli.large_clouds import MemoryOption, is_large
from nacre.cli.terminal import CommandError, Json, Quiet, Terminal, Verbose, writable_file

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt


class Method(str, Enum):
    """What a pair of points costs."""

    symmetric = "symmetric"
    point_to_plane = "point_to_plane"
    point_to_point = "point_to_point"
    paper = "paper"


def align(
    source: Annotated[
        Path,
        typer.Argument(
            metavar="SOURCE",
            help="The points that move (PLY, PCD, LAS, ...), or a folder of such files.",
            show_default=False,
        ),
    ],
    target: Annotated[
        Path, typer.Argument(metavar="TARGET", help="The points that stay.", show_default=False)
    ],
    out: Annotated[
        Path | None,
        typer.Option("--out", "-o", metavar="OUT", help="Write the moved source.", show_default=False),
    ] = None,
    initial: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="First guess: a text file of 4x4 numbers.", show_default="identity"
        ),
    ] = None,
    everywhere: Annotated[
        bool, typer.Option("--global", help="Search all motions: no first guess is needed.")
    ] = False,
    seen_from_origin: Annotated[
        bool,
        typer.Option(
            "--seen-from-origin",
            help="With --global: each cloud was seen from (0, 0, 0), as points of one depth image are.",
        ),
    ] = False,
    method: Annotated[Method, typer.Option(help="What is minimised.")] = Method.symmetric,
    max_distance: Annotated[
        float,
        typer.Option(
            min=0, help="Pairs farther apart do not count at first (metres).", show_default="automatic"
        ),
    ] = 0.0,
    max_iterations: Annotated[int, typer.Option(min=1, help="Largest number of steps.")] = 40,
    memory: MemoryOption = None,
    json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = 0,
) -> None:
    """
    Find the motion that brings one cloud onto another (ICP), from a first guess or, with --global, from none.

    Of clouds larger than memory, and with --memory, a random sample of 100 000 points of each is aligned.
    Prints the 4x4 matrix that takes points of SOURCE to TARGET. Exit code 1 where the clouds did not come to
    rest on each other, or with --global where no motion, or more than one, explains them.
    """
    terminal = Terminal(json, quiet, verbose)
    import numpy as np

    import nacre
    from nacre.run_data.text import count, quantity

    if everywhere and initial is not None:
        raise CommandError("--initial is the first guess that --global does without; give one of them", 2)
    if seen_from_origin and not everywhere:
        raise CommandError("--seen-from-origin is only of use with --global", 2)
    if out is not None:
        writable_file(out)
    if everywhere and memory is not None:
        raise CommandError("--global needs both clouds in memory: nacre downsample makes smaller ones", 2)
    if everywhere:
        _align_globally(terminal, source, target, out, seen_from_origin)
        return
    options: dict[str, Any] = {
        "initial": None if initial is None else read_matrix(initial),
        "method": method.value,
        "max_distance": max_distance,
        "max_iterations": max_iterations,
    }
    moving = None
    if is_large(source, memory) or is_large(target, memory):
        from nacre.out_of_core import align as align_out_of_core

        result = align_out_of_core(source, target, out, memory=memory, **options)
    else:
        moving, still = nacre.read_points(source), nacre.read_points(target)
        result = nacre.align(
            moving.points,
            still.points,
            source_normals=moving.normals,
            target_normals=still.normals,
            **options,
        )
    pose = result.target_from_source
    angle = float(np.arccos(np.clip((np.trace(pose[:3, :3]) - 1) / 2, -1, 1)))
    figures = {
        "target_from_source": pose, "status": result.status, "converged": result.converged,
        "iterations": result.iterations, "num_inliers": result.num_inliers, "overlap": result.overlap,
        "rmse": result.rmse, "information": result.information, "weak_directions": result.weak_directions,
        "center": result.center,
    }  # fmt: skip
    weak = len(result.weak_directions)
    rows = [
        ("status", f"{result.status.replace('_', ' ')} after {result.iterations} steps"),
        ("overlap", f"{quantity(result.overlap, 'fraction')} ({count(result.num_inliers)} pairs)"),
        ("residual", f"{quantity(result.rmse, 'm')} RMS"),
        ("motion", f"{quantity(float(np.linalg.norm(pose[:3, 3])), 'm')}, {quantity(angle, 'rad')}"),
        (
            "weak directions",
            f"{weak}: the shapes can slide along them, the first guess was kept" if weak else "none",
        ),
        *zip(("matrix", "", "", ""), format_matrix(pose).splitlines(), strict=True),
    ]
    terminal.answer(figures, rows)
    if result.status == "too_few_pairs":
        raise CommandError("too little matched; give a better --initial or a larger --max-distance")
    if out is not None:
        if moving is not None:
            _write_moved(out, moving, pose)
        terminal.say(f"moved source  {out}")
    if not result.converged:
        raise CommandError("still moving after the last step; give more --max-iterations")


def _align_globally(terminal: Terminal, source: Path, target: Path, out: Path | None, seen: bool) -> None:
    import nacre
    from nacre.run_data.text import quantity

    moving, still = nacre.read_points(source), nacre.read_points(target)
    origin = (0.0, 0.0, 0.0) if seen else None
    result = nacre.align_global(
        moving.points,
        still.points,
        source_normals=moving.normals,
        target_normals=still.normals,
        source_viewpoint=origin,
        target_viewpoint=origin,
    )
    pose = result.target_from_source
    figures = {
        "target_from_source": pose, "status": result.status, "found": result.found,
        "overlap": result.overlap, "consistency": result.consistency, "rivalry": result.rivalry,
        "tolerance": result.tolerance, "rmse": result.rmse, "information": result.information,
        "weak_directions": result.weak_directions, "center": result.center,
    }  # fmt: skip
    rows = [
        ("status", result.status.replace("_", " ")),
        (
            "overlap",
            f"{quantity(result.overlap, 'fraction')} (agree within {quantity(result.tolerance, 'm')})",
        ),
        ("consistency", quantity(result.consistency, "fraction")),
        ("next best motion", f"{quantity(result.rivalry, 'fraction')} as good"),
        ("residual", f"{quantity(result.rmse, 'm')} RMS"),
        *zip(("matrix", "", "", ""), format_matrix(pose).splitlines(), strict=True),
    ]
    terminal.answer(figures, rows)
    if out is not None and result.status != "too_few_points":
        _write_moved(out, moving, pose)
        terminal.say(f"moved source  {out}")
    if not result.found:
        reasons = {
            "ambiguous": "several motions explain the clouds about as well; the best is shown",
            "not_found": "no motion explains the clouds; the best is shown",
            "too_few_points": "the clouds have too few points",
        }
        raise CommandError(reasons[result.status])


def read_matrix(path: Path) -> npt.NDArray[np.float64]:
    """Read a rigid 4x4 matrix from a text file."""
    import nacre

    poses = nacre.read_trajectory(path).poses
    if len(poses) != 1:
        raise nacre.FileFormatError(path, f"expected one 4x4 matrix, got {len(poses)} poses")
    matrix: npt.NDArray[np.float64] = poses[0]
    return matrix


def format_matrix(pose: npt.NDArray[np.float64]) -> str:
    """Return a matrix as four lines that :func:`read_matrix` reads."""
    return "\n".join(" ".join(f"{value:.12g}" for value in row) for row in pose)


def _write_moved(out: Path, cloud: Any, pose: npt.NDArray[np.float64]) -> None:
    import nacre

    rotation = pose[:3, :3].T
    normals = None if cloud.normals is None else (cloud.normals @ rotation).astype(cloud.normals.dtype)
    nacre.write_points(
        out,
        (cloud.points @ rotation + pose[:3, 3]).astype(cloud.points.dtype),
        normals=normals,
        colors=cloud.colors,
        attributes=cloud.attributes,
    )
