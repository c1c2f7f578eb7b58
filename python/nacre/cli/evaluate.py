"""``nacre evaluate``: a model against a surface, a trajectory against the truth."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from nacre.cli.align import format_matrix, read_matrix
from nacre.cli.surfaces import MESH_SUFFIXES, POINT_SUFFIXES, evaluate_surface, read_surface, transformed
from nacre.cli.terminal import CommandError, Json, Quiet, Terminal, Verbose

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

    from nacre import Trajectory

    Matrix = npt.NDArray[np.float64]


def evaluate(
    estimate: Annotated[
        Path,
        typer.Argument(
            metavar="ESTIMATE",
            help="A model (PLY, PCD), a trajectory (TUM, Redwood .log), or a reconstruction's OUT folder.",
            show_default=False,
        ),
    ],
    truth: Annotated[
        Path | None,
        typer.Argument(
            metavar="[TRUTH]",
            help="For a model: a mesh or a point file. For a trajectory: a trajectory, or its recording.",
            show_default="what OUT/report.json knows",
        ),
    ] = None,
    tau: Annotated[
        list[float] | None,
        typer.Option(
            help="Distance that counts as covered (metres). May be repeated.",
            show_default="0.002, 0.005, 0.01",
        ),
    ] = None,
    world_from_model: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="4x4 matrix that takes the model to the reference's frame.",
            show_default="from OUT's true poses, else the identity",
        ),
    ] = None,
    align: Annotated[
        bool, typer.Option("--align", help="First move the model onto the reference (ICP, rigid).")
    ] = False,
    scale: Annotated[
        float, typer.Option(help="Metres per unit of the reference: 0.001 for millimetres.")
    ] = 1.0,
    max_difference: Annotated[
        float, typer.Option(min=0, help="Poses farther apart in time are not compared (seconds).")
    ] = 0.02,
    json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = 0,
) -> None:
    """
    Measure a model against a reference surface, or a trajectory against the truth.

    A model: distance to the surface, completeness, F-score, uniformity, error of the normals. It must lie in
    the reference's frame: a reconstruction lies in its first camera's, so give its OUT folder (which moves it
    where the recording had true poses), --world-from-model or --align.

    A trajectory: absolute error (ATE, after a rigid alignment), relative error (RPE), coverage.
    """
    terminal = Terminal(json, quiet, verbose)
    if not estimate.exists():
        raise CommandError(f"no such file or folder: {estimate}", 2)
    if truth is not None and not truth.exists():
        raise CommandError(f"no such file or folder: {truth}", 2)
    is_surface = truth is not None and truth.suffix.lower() in MESH_SUFFIXES + POINT_SUFFIXES
    if estimate.is_dir() and not (estimate / "report.json").is_file():
        raise CommandError(
            f"{estimate}: no report.json; give the OUT folder of a reconstruction, or a file", 2
        )
    if is_surface or (estimate.suffix.lower() in POINT_SUFFIXES and estimate.is_file()):
        if truth is None or not is_surface:
            raise CommandError(f"{estimate} is a model: a mesh or a point file must follow it", 2)
        figures, rows = _surface(estimate, truth, tau, world_from_model, align, scale)
    else:
        figures, rows = _trajectory(estimate, truth, max_difference)
    terminal.answer(figures, rows)


def _surface(
    estimate: Path,
    truth: Path,
    tau: list[float] | None,
    world_from_model: Path | None,
    align: bool,
    scale: float,
) -> tuple[dict[str, Any], list[tuple[str, str]]]:
    import numpy as np

    import nacre
    from nacre.report.text import label, quantity

    cloud = nacre.read_points(estimate / "model.ply" if estimate.is_dir() else estimate)
    if not np.isfinite(cloud.points).all(axis=1).any():
        raise CommandError(f"{estimate}: the model has no points")
    reference, reference_normals = read_surface(truth, scale)
    pose, how = np.eye(4), "the identity"
    if world_from_model is not None:
        pose, how = read_matrix(world_from_model), str(world_from_model)
    elif estimate.is_dir() and (known := _world_from_model(estimate)) is not None:
        pose, how = known, "the first true pose in report.json"
    if align:
        pose = _aligned(cloud.points, cloud.normals, reference, reference_normals, pose)
        how = "ICP" if how == "the identity" else f"{how}, then ICP"
    points, normals = transformed(pose, cloud.points, cloud.normals)
    results = evaluate_surface(points, normals, reference, reference_normals, tau=tau or (0.002, 0.005, 0.01))
    figures: dict[str, Any] = {"kind": "surface", "world_from_model": pose, "world_from_model_from": how}
    rows = [("model moved by", how)]
    from nacre.reconstruction import result_dict

    for name, result in results.items():
        figures[name] = result_dict(result)
        units = result.units()
        rows.append(("", ""))
        rows.append((label(name).upper(), ""))
        rows += [
            (label(field), quantity(value, units[field]))
            for field, value in figures[name].items()
            if not (name == "f_score" and field in ("precision", "recall") and value is None)
        ]
    if align:
        rows += [
            ("", ""),
            *zip(("world from model", "", "", ""), format_matrix(pose).splitlines(), strict=True),
        ]
    return figures, rows


def _aligned(points: Any, normals: Any, reference: Any, reference_normals: Any, initial: Matrix) -> Matrix:
    import nacre
    from nacre.evaluation import sample_surface

    if isinstance(reference, nacre.Mesh):
        samples = sample_surface(reference.vertices, reference.triangles)
        reference, reference_normals = samples.points, samples.normals
    result = nacre.align(
        points, reference, source_normals=normals, target_normals=reference_normals, initial=initial
    )
    if not result.converged:
        raise CommandError(
            f"--align: {result.status.replace('_', ' ')}; give a first guess with --world-from-model"
        )
    pose: Matrix = result.target_from_source
    return pose


def _world_from_model(folder: Path) -> Matrix | None:
    import numpy as np

    for frame in _report(folder)["frames"]:
        if frame["truth"] is not None and frame["world_from_camera"] is not None:
            pose: Matrix = np.array(frame["truth"]) @ np.linalg.inv(frame["world_from_camera"])
            return pose
    return None


def _report(folder: Path) -> Any:
    import json

    from nacre.errors import FileFormatError

    path = folder / "report.json"
    try:
        report = json.loads(path.read_text(encoding="utf-8"))
        if isinstance(report["frames"], list):
            return report
    except (ValueError, KeyError, TypeError):
        pass
    raise FileFormatError(path, "not a report of nacre reconstruct")


def _trajectory(
    estimate: Path, truth: Path | None, max_difference: float
) -> tuple[dict[str, Any], list[tuple[str, str]]]:
    import numpy as np

    import nacre
    from nacre.evaluation import absolute_trajectory_error, relative_pose_error
    from nacre.reconstruction import result_dict
    from nacre.report.text import label, quantity

    num_frames = None
    if estimate.is_dir():
        frames = _report(estimate)["frames"]
        num_frames = len(frames)
    options: dict[str, Any] = {}
    if truth is None:
        if not estimate.is_dir():
            raise CommandError(f"{estimate}: a true trajectory or a recording must follow it", 2)
        missing = np.full((4, 4), np.nan)

        def stack(name: str) -> Any:
            return np.array([missing if f[name] is None else f[name] for f in frames], dtype=np.float64)

        poses, true_poses = stack("world_from_camera"), stack("truth")
        if not np.isfinite(true_poses).any():
            raise CommandError(
                f"{estimate}: its recording had no true poses; give a trajectory or a mesh after it", 2
            )
    else:
        found = nacre.read_trajectory(estimate / "trajectory.txt" if estimate.is_dir() else estimate)
        known = _true_trajectory(truth)
        poses, true_poses = found.poses, known.poses
        options = {
            "timestamps": found.timestamps,
            "truth_timestamps": known.timestamps,
            "max_time_difference": max_difference,
        }
    absolute = absolute_trajectory_error(poses, true_poses, num_frames=num_frames, **options)
    relative = relative_pose_error(poses, true_poses, **options)
    if not absolute.num_compared:
        raise CommandError(
            "no pose has a true pose near in time; are these of one recording? See --max-difference"
        )
    figures: dict[str, Any] = {"kind": "trajectory"}
    rows: list[tuple[str, str]] = []
    for name, result in (("absolute_trajectory_error", absolute), ("relative_pose_error", relative)):
        figures[name] = result_dict(result)
        units = result.units()
        rows += [("", "")] * bool(rows)
        rows.append((label(name).upper(), ""))
        rows += [
            (label(field), quantity(value, units[field]))
            for field, value in figures[name].items()
            if field != "truth_from_estimated"
        ]
    return figures, rows


def _true_trajectory(path: Path) -> Trajectory:
    import nacre

    if not path.is_dir():
        return nacre.read_trajectory(path)
    from nacre.cli.source import open_source

    sequence = open_source(path)
    if sequence.truth is None:
        raise CommandError(f"{path}: the recording has no true poses", 2)
    return sequence.truth
