"""What the package shows: its public functions and classes, and one object of each class."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import nacre
import nacre.evaluation
import nacre.reconstruction

MODULES = (nacre, nacre.evaluation, nacre.reconstruction)


def members() -> dict[str, Any]:
    """Return every public function and class by its full name."""
    found = {}
    for module in MODULES:
        for name in getattr(module, "__all__", [n for n in vars(module) if not n.startswith("_")]):
            value = getattr(module, name)
            own = (getattr(value, "__module__", None) or "").startswith(module.__name__)
            if own and (inspect.isclass(value) or inspect.isroutine(value)):
                found.setdefault(f"{value.__module__}.{name}", value)
    return found


def classes() -> dict[str, type]:
    """Return every public class by its name."""
    return {value.__name__: value for value in members().values() if inspect.isclass(value)}


def functions() -> dict[str, Callable[..., Any]]:
    """Return every public function, and the public methods of public classes."""
    found: dict[str, Callable[..., Any]] = {}
    for name, value in members().items():
        if not inspect.isclass(value):
            found[name] = value
            continue
        for method in vars(value):
            if not method.startswith("_") and callable(inspect.unwrap(getattr(value, method))):
                found[f"{name}.{method}"] = getattr(value, method)
    return found


def open_recording(frames: list[nacre.SequenceFrame], folder: Path) -> nacre.Sequence:
    """Write frames, and open them."""
    nacre.write_recording(folder, frames[0].camera, (f.depth for f in frames), depth_scale=5000)
    return nacre.open_sequence(folder)


def objects(folder: Path) -> dict[str, Any]:
    """Return an object of every public class, by the class's name."""
    mesh = nacre.built_in_object()
    camera = nacre.Camera(160, 120, 131, 131, 79.5, 59.5)
    poses = nacre.turntable_poses(mesh, 3, 0.1, camera=camera, distance=0.3)
    frames = [
        nacre.SequenceFrame(i, mesh.simulate_depth(camera, pose, seed=i), camera, None, None, pose)
        for i, pose in enumerate(poses)
    ]
    done = nacre.reconstruct(frames)
    points = done.model.points
    tree = nacre.KdTree(points)
    evaluation = nacre.evaluation
    samples = evaluation.sample_surface(mesh.vertices, mesh.triangles, 500)
    in_world = points @ poses[0][:3, :3].T + poses[0][:3, 3]
    truth = np.stack(poses)
    made = [
        camera, mesh, frames[0], done, done.model, done.model.parameters, done.model.noise, tree,
        nacre.reconstruction.BatchResult("teddy", "scans/teddy", Path("models/teddy")),
        done.frames[0], done.frames[0].report, done.trajectory, samples, nacre.CameraFile(camera, 1000.0),
        mesh.closest(points[:3]), mesh.cast(points[:3], points[:3]), nacre.Cloud(points),
        nacre.consolidate(points, num_points=100), nacre.align(points, points),
        nacre.align_global(points, points), nacre.DepthCalibration(0.01, 0.001, 7),
        nacre.DepthParameters(), nacre.RegionParameters(), nacre.RegistrationParameters(),
        nacre.GlobalRegistrationParameters(), done.frames[0].report.depth, done.frames[0].report.region,
        done.frames[0].report.deformation,
        nacre.FileFormatError("a.ply", "is cut short", line=3), nacre.Cancelled("enough"),
        nacre.CameraError("no camera"),
        tree.query_radius(points[:5], 0.01),
        evaluation.absolute_trajectory_error(done.poses, truth),
        evaluation.relative_pose_error(done.poses, truth),
        evaluation.uniformity(points), evaluation.surface_accuracy(in_world, mesh),
        evaluation.f_score(in_world, mesh, num_samples=500),
        evaluation.completeness(in_world, mesh, num_samples=500),
        evaluation.normal_error(done.model.normals, done.model.normals),
        evaluation.pose_error(done.poses, truth), open_recording(frames, folder),
    ]  # fmt: skip
    return {type(thing).__name__: thing for thing in made}
