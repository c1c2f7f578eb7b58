"""``nacre demo``: the built-in object, seen by a simulated camera, becomes a model."""

from __future__ import annotations

import collections.abc
import math
from pathlib import Path
from typing import Annotated, Any, overload

import typer

from nacre._internal.signals import interruptible
from nacre.cli.config import ConfigOption, PresetOption, SetOption, model_parameters
from nacre.cli.follow import Bars
from nacre.cli.outputs import file_rows, require_tracked, trajectory_rows, verdict_rows
from nacre.cli.terminal import Json, Quiet, Terminal, Verbose, table


def demo(
    out: Annotated[Path, typer.Option("--out", "-o", metavar="OUT", help="Folder for the results.")] = Path(
        "nacre-demo"
    ),
    views: Annotated[int, typer.Option(min=1, help="How many depth images.")] = 12,
    step: Annotated[
        float, typer.Option(min=-720, max=720, help="Turn of the camera from view to view (degrees).")
    ] = 30.0,
    noise: Annotated[
        float, typer.Option(min=0, help="Standard deviation of the depth noise (metres).")
    ] = 0.0005,
    edge_mixing: Annotated[
        bool, typer.Option("--edge-mixing/--no-edge-mixing", help="Mix depths at edges, as real sensors do.")
    ] = True,
    seed: Annotated[int, typer.Option(min=0, help="Of the noise.")] = 0,
    preset: PresetOption = None,
    config: ConfigOption = None,
    settings: SetOption = None,
    json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = 0,
) -> None:
    """
    Grow a model of the built-in object from twelve noisy simulated views, and measure it.

    Needs no data. Each view is registered to the model starting from the previous view's pose: the model is
    not told how the camera moves. OUT gets the model, its trajectory, pictures and a report.
    """
    terminal = Terminal(json, quiet, verbose)
    parameters, preset_name = model_parameters(preset, config, settings)
    import nacre
    from nacre import evaluation
    from nacre.cli.surfaces import evaluate_surface, transformed
    from nacre.io.json_files import to_json
    from nacre.io.writable_folder import writable_folder
    from nacre.reconstruction import Reconstruction
    from nacre.reconstruction.carry_out import follow
    from nacre.reconstruction.results import write_results
    from nacre.reconstruction.runner import Run

    mesh = nacre.built_in_object()
    camera = nacre.default_camera(mesh)
    poses = nacre.turntable_poses(mesh, views, math.radians(step), camera=camera)
    recording = SimulatedViews(mesh, camera, poses, noise=noise, edge_mixing=float(edge_mixing), seed=seed)
    done = Reconstruction(recording, nacre.Model(camera, parameters=parameters))
    writable_folder(out)
    words = (
        f"the built-in object, {views} views every {step:g} degrees, noise {1000 * noise:g} mm, "
        f"edge mixing {'on' if edge_mixing else 'off'}, "
        f"orthographic camera {camera.width} x {camera.height}, {1000 * camera.pixel_size:g} mm per pixel"
    )
    start, of_paper = "the previous pose", parameters.registration.method == "paper"
    if parameters.predict_motion:
        leads = "where the last motion leads"
        start = leads if of_paper else f"{start}, and from {leads}"
    alone = ": the algorithm of Blackburn, Kubacki and Stratton 2010, alone" if of_paper else ""
    terminal.say(f"{words}; preset {preset_name}{alone}\neach view is registered starting from {start}")
    run = Run(done, range(views), retry=False)
    with interruptible() as stop, Bars(terminal, run) as bars:
        follow(run, stop, [bars.show])
    done.evaluate_trajectory()
    figures: dict[str, Any] = {}
    cloud = done.cloud
    if len(cloud):
        samples = evaluation.sample_surface(mesh.vertices, mesh.triangles, 20_000)
        points, normals = transformed(poses[0], cloud.points, cloud.normals)
        seen = evaluation.seen_samples(mesh, samples, camera, poses)
        done.evaluation |= evaluate_surface(
            points, normals, mesh, samples=samples, seen=seen, tau=(0.002, 0.003, 0.005)
        )
        figures = {"part_of_the_surface_that_the_cameras_saw": float(seen.mean())}
    pose_error = _pose_error(done, mesh.bounds.mean(axis=0))
    document = {
        "simulation": {
            "object": "built-in", "views": views, "step_degrees": step, "noise": noise,
            "edge_mixing": edge_mixing, "seed": seed,
        },
        "preset": preset_name,
        "interrupted": stop.wanted,
        "pose_error": pose_error,
        **figures,
    }  # fmt: skip
    report = write_results(
        out,
        done,
        title="The built-in object",
        source=words,
        document=document,
        figures=figures,
        pictures=True,
    )
    if json:
        print(to_json(report))
    terminal.say()
    terminal.say(table([*verdict_rows(report), *_rows(done, pose_error)]))
    terminal.say()
    terminal.say(table([*file_rows(out), ("pictures", str(out / "pictures"))]))
    if stop.wanted:
        raise typer.Exit(stop.exit_code)
    require_tracked(done, 0.5)


def _pose_error(done: Any, center: Any) -> dict[str, Any] | None:
    """Return the errors of the poses at the object's centre, with the first camera in its place."""
    from nacre.evaluation import pose_error
    from nacre.evaluation.result import result_dict

    truths = done.truths
    if truths is None or not done.num_tracked:
        return None
    return result_dict(pose_error(done.poses, truths, center=center))


def _rows(done: Any, pose_error: dict[str, Any] | None) -> list[tuple[str, str]]:
    from nacre.run_data.text import quantity

    rows = [row for row in trajectory_rows(done) if row[0] in ("frames tracked", "model", "time per frame")]
    if pose_error is not None:
        worst = (
            f"{quantity(pose_error['translation_max'], 'm')}, {quantity(pose_error['rotation_max'], 'rad')}"
        )
        rows.insert(1, ("pose error", f"at most {worst} at the object's centre"))
    accuracy = done.evaluation.get("surface_accuracy")
    if accuracy is not None:
        covered, even = done.evaluation["completeness"], done.evaluation["uniformity"]
        parts = [
            f"{quantity(part, 'fraction')} within {quantity(tau, 'm')}"
            for tau, part in zip(covered.tau, covered.fraction, strict=True)
        ]
        rows[-1:-1] = [
            (
                "model to true surface",
                f"{quantity(accuracy.rms, 'm')} RMS (bias {quantity(accuracy.bias, 'm')})",
            ),
            ("completeness", f"{', '.join(parts)} of what the cameras saw"),
            (
                "uniformity",
                f"{even.coefficient_of_variation:.3f} (variation of spacing; random points: 0.52)",
            ),
        ]
    return rows


class SimulatedViews(collections.abc.Sequence[Any]):
    """Views of a mesh as a recording, rendered when asked for; their seeds count up."""

    def __init__(self, mesh: Any, camera: Any, poses: Any, *, seed: int = 0, **options: Any) -> None:
        self._mesh, self._camera, self._poses = mesh, camera, poses
        self._seed, self._options = seed, options

    def __len__(self) -> int:
        return len(self._poses)

    @overload
    def __getitem__(self, index: int) -> Any: ...
    @overload
    def __getitem__(self, index: slice) -> collections.abc.Sequence[Any]: ...
    def __getitem__(self, index: int | slice) -> Any:
        from nacre.datasets import SequenceFrame

        if isinstance(index, slice):
            return [self[i] for i in range(len(self))[index]]
        depth = self._mesh.simulate_depth(
            self._camera, self._poses[index], seed=self._seed + index, **self._options
        )
        return SequenceFrame(index, depth, self._camera, None, None, self._poses[index])
