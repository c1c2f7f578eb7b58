"""``nacre evaluate``: a model against a surface, a trajectory against the truth."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from nacre.cli.align import format_matrix, read_matrix
from nacre.cli.large_clouds import MemoryOption, is_large
from nacre.cli.surfaces import evaluate_surface, mesh_suffixes, point_suffixes, read_surface, transformed
from nacre.cli.terminal import CommandError, Json, Quiet, Terminal, Verbose

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

    from nacre import Mesh, Trajectory
    from nacre.evaluation import SurfaceSamples
    from nacre.evaluation.result import Result
    from nacre.run_data.saved_run import SavedRun

    Matrix = npt.NDArray[np.float64]

Figures = dict[str, Any]
Rows = list[tuple[str, str]]


def evaluate(
    estimate: Annotated[
        Path,
        typer.Argument(
            metavar="ESTIMATE",
            help="A model (PLY, PCD, ...), a trajectory (TUM, Redwood, ...), or the OUT folder of a run.",
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
    memory: MemoryOption = None,
    json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = 0,
) -> None:
    """
    Measure a model against a reference surface, or a trajectory against the truth.

    A model: distance to the surface, completeness (of what the cameras saw, where true poses tell), F-score,
    uniformity, error of the normals. It must lie in the reference's frame: a reconstruction lies in its first
    camera's, so give its OUT folder (which moves it where the recording had true poses), --world-from-model
    or --align. One that is larger than memory, and any with --memory, is read in pieces, and must lie in the
    reference's frame; uniformity and normals are not measured then.

    A trajectory: absolute error (ATE, after a rigid alignment), relative error (RPE), coverage. Of an OUT
    folder also what became of its frames, and the errors of its poses at the middle of the object.
    """
    terminal = Terminal(json, quiet, verbose)
    if not estimate.exists():
        raise CommandError(f"no such file or folder: {estimate}", 2)
    if truth is not None and not truth.exists():
        raise CommandError(f"no such file or folder: {truth}", 2)
    is_surface = truth is not None and truth.suffix.lower() in mesh_suffixes() + point_suffixes()
    saved = None
    if is_surface and truth is not None and (memory is not None or _is_large_cloud(estimate)):
        if align or world_from_model is not None:
            raise CommandError("a model that is read in pieces cannot be moved: nacre align moves it", 2)
        terminal.answer(*_large_surface(estimate, truth, tau, scale, memory))
        return
    if estimate.is_dir():
        from nacre.run_data.saved_run import SavedRun

        if not (estimate / "report.json").is_file():
            raise CommandError(
                f"{estimate}: no report.json; give the OUT folder of a reconstruction, or a file", 2
            )
        saved = SavedRun(estimate)
    if is_surface or (estimate.suffix.lower() in point_suffixes() and saved is None):
        if truth is None or not is_surface:
            raise CommandError(f"{estimate} is a model: a mesh or a point file must follow it", 2)
        figures, rows = _surface(estimate, saved, truth, tau, world_from_model, align, scale)
    else:
        figures, rows = _trajectory(estimate, saved, truth, max_difference)
    terminal.answer(figures, rows)


def _surface(
    estimate: Path,
    saved: SavedRun | None,
    truth: Path,
    tau: list[float] | None,
    world_from_model: Path | None,
    align: bool,
    scale: float,
) -> tuple[Figures, Rows]:
    import numpy as np

    import nacre
    from nacre.evaluation import sample_surface

    cloud = nacre.read_points(estimate / "model.ply" if saved else estimate)
    if not np.isfinite(cloud.points).all(axis=1).any():
        raise CommandError(f"{estimate}: the model has no points")
    reference, reference_normals = read_surface(truth, scale)
    pose, how = np.eye(4), "the identity"
    if world_from_model is not None:
        pose, how = read_matrix(world_from_model), str(world_from_model)
    elif saved and (known := saved.truth_from_world) is not None:
        pose, how = known, "the first true pose in report.json"
    if align:
        pose = _aligned(cloud.points, cloud.normals, reference, reference_normals, pose)
        how = "ICP" if how == "the identity" else f"{how}, then ICP"
    points, normals = transformed(pose, cloud.points, cloud.normals)
    samples = seen = None
    figures: Figures = {"kind": "surface", "world_from_model": pose, "world_from_model_from": how}
    rows: Rows = [("model moved by", how)]
    if saved and isinstance(reference, nacre.Mesh):
        seen = _seen(saved, reference, samples := sample_surface(reference.vertices, reference.triangles))
    results = evaluate_surface(
        points,
        normals,
        reference,
        reference_normals,
        tau=tau or (0.002, 0.005, 0.01),
        samples=None if seen is None else samples,
        seen=seen,
    )
    if seen is not None:
        figures["seen"] = float(seen.mean())
        rows.append(("surface that the cameras saw", f"{100 * figures['seen']:.1f} %; completeness is of it"))
    if saved and saved.truths is not None:
        middle = (
            reference.bounds.mean(axis=0) if isinstance(reference, nacre.Mesh) else reference.mean(axis=0)
        )
        _add(figures, rows, _frame_results(saved, middle), saved)
    _add(figures, rows, results)
    if align:
        rows += [
            ("", ""),
            *zip(("world from model", "", "", ""), format_matrix(pose).splitlines(), strict=True),
        ]
    return figures, rows


def _is_large_cloud(path: Path) -> bool:
    """Say whether a model is to be read in pieces: more than fits in memory, or a folder that is no run."""
    return is_large(path, None) and not (path / "report.json").is_file()


def _large_surface(
    estimate: Path, truth: Path, tau: list[float] | None, scale: float, memory: str | None
) -> tuple[Figures, Rows]:
    from nacre import out_of_core

    reference, normals = read_surface(truth, scale)
    found = out_of_core.evaluate(
        estimate, reference, reference_normals=normals, tau=tau or (0.002, 0.005, 0.01), memory=memory
    )
    figures: Figures = {"kind": "surface"}
    rows: Rows = []
    results: dict[str, Result] = {
        "surface_accuracy": found.surface_accuracy,
        "completeness": found.completeness,
        "f_score": found.f_score,
    }
    _add(figures, rows, results)
    return figures, rows[1:]


def _add(figures: Figures, rows: Rows, results: Mapping[str, Result], saved: SavedRun | None = None) -> None:
    """Add results, and what became of the frames, to the figures and as rows for people."""
    from nacre.evaluation.result import result_dict
    from nacre.run_data.text import label, quantity

    if saved:
        figures["frames"] = saved.counts
        rows += [("", ""), ("FRAMES", "")]
        rows += [(label(name), quantity(number, "count")) for name, number in saved.counts.items()]
    for name, result in results.items():
        figures[name] = result_dict(result)
        units = result.units()
        rows += [("", ""), (label(name).upper(), "")]
        rows += [
            (label(field), quantity(value, units[field]))
            for field, value in figures[name].items()
            if field != "truth_from_estimated"
            and not (name == "f_score" and field in ("precision", "recall") and value is None)
        ]
        for field in ("translation_errors", "rotation_errors"):
            if name == "pose_error":
                figures[name][field] = result.as_dict()[field]


def _seen(saved: SavedRun, mesh: Mesh, samples: SurfaceSamples) -> Any:
    """Return which samples the cameras saw from their true poses; None where that is not known."""
    from nacre.evaluation import seen_samples

    if saved.truths is None or saved.camera is None:
        return None
    return seen_samples(mesh, samples, saved.camera, saved.truths)


def _frame_results(saved: SavedRun, middle: Any) -> dict[str, Result]:
    """Return the errors of the poses of a reconstruction whose recording had true ones."""
    from nacre.evaluation import absolute_trajectory_error, pose_error, relative_pose_error

    poses, truths = saved.poses, saved.truths
    assert truths is not None
    return {
        "pose_error": pose_error(poses, truths, center=middle),
        "absolute_trajectory_error": absolute_trajectory_error(poses, truths),
        "relative_pose_error": relative_pose_error(poses, truths),
    }


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


def _trajectory(
    estimate: Path, saved: SavedRun | None, truth: Path | None, max_difference: float
) -> tuple[Figures, Rows]:
    import nacre
    from nacre.evaluation import absolute_trajectory_error, relative_pose_error

    if truth is None:
        if not saved:
            raise CommandError(f"{estimate}: a true trajectory or a recording must follow it", 2)
        if saved.truths is None:
            raise CommandError(
                f"{estimate}: its recording had no true poses; give a trajectory or a mesh after it", 2
            )
        results = _frame_results(saved, _middle(saved))
    else:
        found = nacre.read_trajectory(estimate / "trajectory.txt" if saved else estimate)
        known = _true_trajectory(truth)
        options: dict[str, Any] = {
            "timestamps": found.timestamps,
            "truth_timestamps": known.timestamps,
            "max_time_difference": max_difference,
        }
        num_frames = len(saved.frames) if saved else None
        results = {
            "absolute_trajectory_error": absolute_trajectory_error(
                found.poses, known.poses, num_frames=num_frames, **options
            ),
            "relative_pose_error": relative_pose_error(found.poses, known.poses, **options),
        }
    absolute: Any = results["absolute_trajectory_error"]
    if not absolute.num_compared:
        raise CommandError(
            "no pose has a true pose near in time; are these of one recording? See --max-difference"
        )
    figures: Figures = {"kind": "trajectory"}
    rows: Rows = []
    _add(figures, rows, results, saved)
    return figures, rows[1:]


def _middle(saved: SavedRun) -> Any:
    """Return the middle of the model in the frame of the true poses; the median, since rooms have corners."""
    import numpy as np

    import nacre

    pose = saved.truth_from_world
    points = nacre.read_points(saved.folder / "model.ply").points
    if pose is None or not len(points):
        return np.zeros(3)
    return transformed(pose, np.median(points, axis=0, keepdims=True), None)[0][0]


def _true_trajectory(path: Path) -> Trajectory:
    import nacre

    if not path.is_dir():
        return nacre.read_trajectory(path)
    from nacre.cli.source import open_source

    sequence = open_source(path)
    if sequence.truth is None:
        raise CommandError(f"{path}: the recording has no true poses", 2)
    return sequence.truth
