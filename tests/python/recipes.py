"""A valid call of every public function, and what must hold of what it returns."""

from __future__ import annotations

import dataclasses
import functools
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

import nacre
import nacre.evaluation

Array = npt.NDArray[Any]
RNG = np.random.default_rng(5)


@dataclasses.dataclass(frozen=True)
class Recipe:
    """A call with valid arguments."""

    call: Callable[..., Any]
    arguments: Mapping[str, Any]
    holds: Callable[..., None] = lambda result, **arguments: None
    grows: tuple[str, ...] = ()  # arguments that say how much to compute: a large one takes its time
    lists: tuple[str, ...] = ()  # arrays whose dtype matters: a list is another


def arrays_of(recipe: Recipe) -> list[str]:
    """Return the names of the arguments that are arrays."""
    return [name for name, value in recipe.arguments.items() if isinstance(value, np.ndarray)]


def bumpy(count: int = 60, dtype: Any = np.float64) -> Array:
    """Return points of a surface without symmetry."""
    xy = np.random.default_rng(1).uniform(-0.1, 0.1, (count, 2))
    z = 0.5 + 0.03 * np.sin(30 * xy[:, 0]) * np.cos(25 * xy[:, 1]) + 0.2 * xy[:, 0]
    return np.column_stack([xy, z]).astype(dtype)


def unit(count: int = 60) -> Array:
    """Return normals."""
    normals = np.random.default_rng(2).normal(size=(count, 3))
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)


CAMERA = nacre.Camera(24, 18, 20.0, 20.0, 11.5, 8.5)
_V, _U = np.indices((18, 24))
DEPTH = (0.6 + 0.01 * _U - 0.005 * _V + 0.02 * np.sin(_U)).astype(np.float32)
MASK = (_U > 3).astype(np.uint8)
COLOR = np.random.default_rng(3).integers(0, 256, (18, 24, 3)).astype(np.uint8)
VERTICES = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
TRIANGLES = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
_TEMPORARY = tempfile.TemporaryDirectory()
FOLDER = Path(_TEMPORARY.name)
POSE = np.eye(4)
POSES = np.stack([nacre.turntable_poses(VERTICES, 3, 0.1)[i] for i in range(3)])


@functools.cache
def mesh() -> nacre.Mesh:
    """Return a tetrahedron."""
    return nacre.Mesh(VERTICES, TRIANGLES)


@functools.cache
def tree() -> nacre.KdTree:
    """Return a tree of 60 points."""
    return nacre.KdTree(bumpy())


def add_frame(**arguments: Any) -> nacre.FrameReport:
    """Add a frame to a model that has two."""
    model = nacre.Model(CAMERA, num_threads=1, relocalise=False)
    model.add_frame(DEPTH)
    model.add_frame(DEPTH)
    return model.add_frame(**arguments)


def bent_model() -> nacre.Model:
    """Return a model that deforms, of one frame."""
    model = nacre.Model(CAMERA, num_threads=1, deform=True)
    model.add_frame(DEPTH)
    return model


def is_finite(result: Any, **arguments: Any) -> None:
    """Check that an array is finite."""
    assert np.isfinite(result).all()


def has_unit_rows(normals: Array) -> None:
    """Check rows of unit length, or NaN."""
    known = np.isfinite(normals).all(axis=-1)
    assert (np.isnan(normals).all(axis=-1) | known).all()
    assert np.allclose(np.linalg.norm(normals[known].astype(np.float64), axis=-1), 1, atol=1e-4)


def _consolidated(result: nacre.Consolidated, points: Any, **arguments: Any) -> None:
    points = np.asarray(points, np.float64)
    assert np.isfinite(result.points).all()
    assert ((result.sources >= 0) & (result.sources < max(1, len(points)))).all()
    assert len(result.points) == len(result.sources)


def _samples(result: Array, samples: Any, **arguments: Any) -> None:
    given = np.asarray(samples, np.float64)
    assert result.shape == given.shape
    assert np.isfinite(result[np.isfinite(given).all(axis=1)]).all()


def _aligned(result: Any, **arguments: Any) -> None:
    pose = result.target_from_source
    assert np.isfinite(pose).all()
    assert np.allclose(pose[:3, :3] @ pose[:3, :3].T, np.eye(3), atol=1e-5)
    assert 0 <= result.overlap <= 1 or np.isnan(result.overlap)


def _neighbors(result: Any, **arguments: Any) -> None:
    distances, indices = result
    assert ((indices >= 0) & (indices <= 60)).all()
    assert (np.isinf(distances) == (indices == 60)).all()
    rows = distances.reshape(-1, distances.shape[-1])
    assert (rows[:, 1:] >= rows[:, :-1]).all()


def _neighbors_within(result: nacre.RadiusNeighbors, **arguments: Any) -> None:
    assert result.offsets[0] == 0
    assert (np.diff(result.offsets) >= 0).all()
    assert result.offsets[-1] == len(result.indices) == len(result.distances)
    assert ((result.indices >= 0) & (result.indices < 60)).all()


def _balls(result: Any, **arguments: Any) -> None:
    lengths = arguments["return_length"]
    counts = np.ravel(result if lengths else [len(row) for row in np.ravel(result)])
    assert ((counts >= 0) & (counts <= 60)).all()


def _report(report: nacre.FrameReport, **arguments: Any) -> None:
    assert report.status in {"TRACKED", "WEAK", "LOST", "RELOCALISED"}
    assert np.isfinite(report.world_from_camera).all()


def _image(result: Array, **arguments: Any) -> None:
    assert result.shape == (18, 24)
    assert not (result <= 0).any()


def _is_noise(result: nacre.NoiseModel, **arguments: Any) -> None:
    assert np.isfinite(dataclasses.astuple(result)).all()
    assert result.constant >= 0
    assert result.quadratic >= 0


def _poses(result: Array, **arguments: Any) -> None:
    assert np.isfinite(result).all()
    assert np.allclose(np.linalg.det(result[:, :3, :3]), 1)


def _closest(result: nacre.ClosestPoints, points: Any, **arguments: Any) -> None:
    known = (np.abs(np.asarray(points, np.float64)) < 1e150).all(axis=1)
    assert ((result.triangles >= 0) == known).all()
    assert (result.distances[known] >= 0).all()


def _hits(result: nacre.RayHits, **arguments: Any) -> None:
    assert ((result.triangles >= -1) & (result.triangles < 4)).all()
    assert (np.isnan(result.distances) == (result.triangles < 0)).all()


_OPTIONS = {"depth_scale": 1.0, "num_threads": 1}
_EVALUATION = nacre.evaluation
_DEPTH = {"depth": DEPTH, "camera": CAMERA, **_OPTIONS}
_CLEANING = dataclasses.asdict(nacre.DepthParameters()) | {"noise": 0.001}
_ALIGN = dataclasses.asdict(nacre.RegistrationParameters()) | {"num_threads": 1}
_GLOBAL = dataclasses.asdict(nacre.GlobalRegistrationParameters()) | {
    "num_threads": 1, "num_rotations": 8, "num_candidates": 2, "max_samples": 50,
}  # fmt: skip
_SIMULATION = {
    "camera": CAMERA, "world_from_camera": POSES[0], "noise": 0.001, "edge_mixing": 0.5,
    "background_depth": 5.0,
    "quantization": 0.001, "dropout": 0.1, "seed": 3, "num_threads": 1,
}  # fmt: skip
_CONSOLIDATION = {
    "radius": 0.05,
    "iterations": 3,
    "mu": 0.4,
    "method": "wlop+",
    "theta": "huang",
    "num_threads": 1,
}

RECIPES: dict[str, Recipe] = {
    "nacre.camera.Camera": Recipe(
        nacre.Camera,
        {"width": 24, "height": 18, "fx": 20.0, "fy": 20.0, "cx": 11.5, "cy": 8.5,
         "distortion": (0.1, 0.0, 0.0, 0.0, 0.0), "depth": "z"},
        grows=("width", "height"),
    ),
    "nacre.camera.Camera.orthographic": Recipe(
        nacre.Camera.orthographic, {"width": 24, "height": 18, "pixel_size": 0.001}, grows=("width", "height")
    ),
    "nacre.camera.Camera.from_fov": Recipe(
        nacre.Camera.from_fov,
        {"width": 24, "height": 18, "horizontal_degrees": 60.0, "vertical_degrees": 45.0, "depth": "z"},
        grows=("width", "height"),
    ),
    "nacre.camera.Camera.from_matrix": Recipe(
        nacre.Camera.from_matrix,
        {"width": 24, "height": 18, "matrix": CAMERA.matrix, "distortion": (0.1, 0.0, 0.0, 0.0, 0.0),
         "depth": "z"},
        grows=("width", "height"),
    ),
    "nacre.camera.Camera.project": Recipe(CAMERA.project, {"points": bumpy()}),
    "nacre.consolidation.consolidate": Recipe(
        nacre.consolidate,
        {"points": bumpy(), "num_points": 20, "attributes": unit(), "seed": 3, **_CONSOLIDATION},
        _consolidated,
        grows=("iterations",),
    ),
    "nacre.consolidation.project_samples": Recipe(
        nacre.project_samples,
        {"samples": bumpy(20), "points": bumpy(), "point_weights": np.ones(60), "sample_normals": unit(20),
         "frozen": np.arange(20) % 2, **_CONSOLIDATION},
        _samples,
        grows=("iterations",),
    ),
    "nacre.parameters.DepthParameters.for_camera": Recipe(
        nacre.DepthParameters().for_camera, {"camera": CAMERA}
    ),
    "nacre.downsampling.voxel_downsample": Recipe(
        nacre.voxel_downsample,
        {"points": bumpy(), "voxel_size": 0.05, "normals": unit(), "colors": np.full((60, 3), 7, np.uint8)},
        lambda result, **_: is_finite(result.points),
    ),
    "nacre.depth.back_project": Recipe(nacre.back_project, _DEPTH, is_finite),
    "nacre.depth.depth_normals": Recipe(
        nacre.depth_normals, {**_DEPTH, "noise": 0.001}, lambda result, **_: has_unit_rows(result)
    ),
    "nacre.depth.label_pixels": Recipe(
        nacre.label_pixels, {**_DEPTH, "parameters": nacre.DepthParameters(), "mask": MASK}
    ),
    "nacre.depth.preprocess_depth": Recipe(
        nacre.preprocess_depth, {**_DEPTH, **_CLEANING, "mask": MASK, "return_report": False},
        lambda result, return_report=False, **_: None if return_report is not False else _image(result),
    ),
    "nacre.depth_calibration.DepthCalibration.correct": Recipe(
        nacre.DepthCalibration(0.01, 0.001, 7).correct, {"depth": DEPTH, "camera": CAMERA}
    ),
    "nacre.depth_calibration.DepthCalibration.camera_advice": Recipe(
        nacre.DepthCalibration(0.01, 0.001, 7, 0.9, 0.001).camera_advice, {"camera": CAMERA}
    ),
    "nacre.depth_calibration.calibrate_depth": Recipe(
        lambda depth, world_from_camera, camera: nacre.calibrate_depth(
            [(DEPTH, POSE), (depth, world_from_camera)], camera
        ),
        {"depth": DEPTH, "world_from_camera": POSES[1], "camera": CAMERA},
    ),
    "nacre.evaluation.normals.normal_error": Recipe(
        _EVALUATION.normal_error, {"normals": unit(), "reference_normals": unit()}
    ),
    "nacre.evaluation.pose.pose_error": Recipe(
        _EVALUATION.pose_error, {"estimated": POSES, "truth": POSES, "center": np.zeros(3), "align": "first"}
    ),
    "nacre.evaluation.surface.completeness": Recipe(
        _EVALUATION.completeness,
        {"points": bumpy(), "reference": mesh(), "tau": np.array([0.01, 0.02]), "seen": np.ones(50, bool),
         "num_samples": 50, "seed": 1},
        grows=("num_samples",),
    ),
    "nacre.evaluation.surface.f_score": Recipe(
        _EVALUATION.f_score,
        {"points": bumpy(), "reference": bumpy(50), "tau": np.array([0.01, 0.02]),
         "reference_normals": unit(50),
         "seen": np.ones(50, bool)},
    ),
    "nacre.evaluation.surface.sample_surface": Recipe(
        _EVALUATION.sample_surface,
        {"vertices": VERTICES, "triangles": TRIANGLES, "num_samples": 50, "seed": 1},
        grows=("num_samples",),
    ),
    "nacre.evaluation.surface.surface_accuracy": Recipe(
        _EVALUATION.surface_accuracy, {"points": bumpy(), "reference": bumpy(50),
        "reference_normals": unit(50)}
    ),
    "nacre.evaluation.trajectory.absolute_trajectory_error": Recipe(
        _EVALUATION.absolute_trajectory_error,
        {"estimated": POSES, "truth": POSES, "align": True, "valid": np.ones(3, bool),
         "timestamps": np.arange(3.0),
         "truth_timestamps": np.arange(3.0), "max_time_difference": 0.02, "num_frames": 3},
    ),
    "nacre.evaluation.trajectory.relative_pose_error": Recipe(
        _EVALUATION.relative_pose_error,
        {"estimated": POSES, "truth": POSES, "delta": 1.0, "unit": "frames", "valid": np.ones(3, bool),
         "timestamps": np.arange(3.0), "truth_timestamps": np.arange(3.0), "max_time_difference": 0.02},
    ),
    "nacre.evaluation.uniformity.uniformity": Recipe(_EVALUATION.uniformity, {"points": bumpy()}),
    "nacre.evaluation.visibility.seen_samples": Recipe(
        lambda **arguments: _EVALUATION.seen_samples(
            samples=_EVALUATION.sample_surface(VERTICES, TRIANGLES, 50), **arguments
        ),
        {"mesh": mesh(), "camera": CAMERA, "poses": POSES, "max_slant": 1.3},
    ),
    "nacre.global_registration.align_global": Recipe(
        nacre.align_global,
        {"source": bumpy(), "target": bumpy(50), "source_normals": unit(60), "target_normals": unit(50),
         "source_viewpoint": np.zeros(3), "target_viewpoint": np.zeros(3), **_GLOBAL},
        _aligned,
        grows=("num_rotations", "num_candidates"),
    ),
    "nacre.io.animations.write_animation": Recipe(
        functools.partial(nacre.write_animation, FOLDER / "moving.glb"),
        {"vertices": np.stack([VERTICES, 1.1 * VERTICES]), "triangles": TRIANGLES,
         "normals": np.stack([unit(4), unit(4)]), "colors": np.full((4, 3), 7, np.uint8),
         "times": np.array([0.0, 0.1]), "tolerance": 1e-5},
    ),
    "nacre.io.cameras.write_camera": Recipe(
        functools.partial(nacre.write_camera, FOLDER / "camera.json"), {"camera": CAMERA,
        "depth_scale": 1000.0}
    ),
    "nacre.io.meshes.write_mesh": Recipe(
        functools.partial(nacre.write_mesh, FOLDER / "mesh.glb"),
        {"vertices": VERTICES, "triangles": TRIANGLES, "normals": unit(4),
         "colors": np.full((4, 3), 7, np.uint8), "binary": True},
    ),
    "nacre.io.points.write_points": Recipe(
        functools.partial(nacre.write_points, FOLDER / "points.ply"),
        {"points": bumpy(), "normals": unit(), "colors": np.full((60, 3), 7, np.uint8), "binary": True},
    ),
    "nacre.io.trajectories.write_trajectory": Recipe(
        functools.partial(nacre.write_trajectory, FOLDER / "poses.txt"), {"timestamps": np.arange(3.0),
        "poses": POSES, "format": "kitti"}
    ),
    "nacre.datasets.plain.write_recording": Recipe(
        lambda depth_images, colors, poses, timestamps, **more: nacre.write_recording(
            tempfile.mkdtemp(dir=FOLDER), depth_images=[depth_images], colors=[colors], poses=[poses],
            timestamps=[timestamps], **more,
        ),
        {"camera": CAMERA, "depth_scale": 1000.0, "depth_images": DEPTH, "colors": COLOR, "poses": POSE,
         "timestamps": 1.0},
        lists=("colors",),
    ),
    "nacre.trajectory.associate": Recipe(
        nacre.associate, {"timestamps_a": np.arange(5.0), "timestamps_b": np.arange(4.0),
        "max_difference": 0.1}
    ),
    "nacre.trajectory.Trajectory.at": Recipe(
        nacre.Trajectory(np.arange(3.0), POSES).at, {"timestamps": np.arange(4.0), "max_difference": 0.1}
    ),
    "nacre.mesh.Mesh": Recipe(
        nacre.Mesh,
        {"vertices": VERTICES, "triangles": TRIANGLES, "normals": unit(4), "colors": COLOR[0, :4]},
        lists=("colors",),
    ),
    "nacre.mesh.Mesh.cast": Recipe(
        mesh().cast, {"origins": bumpy(), "directions": unit(), "num_threads": 1}, _hits
    ),
    "nacre.mesh.Mesh.closest": Recipe(mesh().closest, {"points": bumpy(), "num_threads": 1}, _closest),
    "nacre.mesh.Mesh.distance": Recipe(mesh().distance, {"points": bumpy(), "num_threads": 1}),
    "nacre.mesh.Mesh.simulate_depth": Recipe(mesh().simulate_depth, _SIMULATION, _image),
    "nacre.mesh.built_in_object": Recipe(nacre.built_in_object, {}),
    "nacre.model.Model": Recipe(nacre.Model, {"camera": CAMERA, "preset": "paper", "depth_scale": 1000.0}),
    "nacre.model.Model.add_frame": Recipe(
        add_frame,
        {"depth": DEPTH, "color": COLOR, "mask": MASK, "timestamp": 1.0}
        | {"guess": POSE, "keep_guess": False, "search": True},
        _report,
        lists=("color",),
    ),
    "nacre.model.Model.points_at": Recipe(lambda frame: bent_model().points_at(frame), {"frame": 0}),
    "nacre.model.Model.normals_at": Recipe(lambda frame: bent_model().normals_at(frame), {"frame": 0}),
    "nacre.model.Model.nodes_at": Recipe(lambda frame: bent_model().nodes_at(frame), {"frame": 0}),
    "nacre.model.Model.in_camera": Recipe(lambda: nacre.Model(CAMERA).in_camera(), {}),
    "nacre.parameters.ModelParameters.preset": Recipe(
        lambda preset: nacre.ModelParameters.preset(preset), {"preset": "paper"}
    ),
    "nacre.kdtree.KdTree": Recipe(nacre.KdTree, {"points": bumpy(), "num_threads": 1}),
    "nacre.kdtree.KdTree.query": Recipe(
        tree().query,
        {"queries": bumpy(10), "k": 3, "max_distance": 0.1, "distance_upper_bound": 0.1, "workers": 1},
        _neighbors,
    ),
    "nacre.kdtree.KdTree.query_ball_point": Recipe(
        tree().query_ball_point,
        {"x": bumpy(10), "r": np.full(10, 0.1), "workers": 1, "return_sorted": True, "return_length": False},
        _balls,
    ),
    "nacre.kdtree.KdTree.query_radius": Recipe(
        tree().query_radius, {"queries": bumpy(10), "radius": 0.1, "num_threads": 1}, _neighbors_within
    ),
    "nacre.noise.NoiseModel.kinect": Recipe(nacre.NoiseModel.kinect, {}, _is_noise),
    "nacre.noise.NoiseModel.local": Recipe(
        lambda **values: nacre.NoiseModel(**values).local(),
        {"constant": 0.001, "quadratic": 0.001, "offset": 0.1, "shared": 0.1},
    ),
    "nacre.noise.NoiseModel.sigma": Recipe(nacre.NoiseModel(0.001, 0.002, 0.1).sigma, {"z": np.ones(3)}),
    "nacre.noise.NoiseModel.stereo": Recipe(
        nacre.NoiseModel.stereo, {"fx": 400.0, "baseline": 0.05, "disparity_sigma": 0.1}
    ),
    "nacre.noise.NoiseModel.time_of_flight": Recipe(nacre.NoiseModel.time_of_flight, {}, _is_noise),
    "nacre.noise.calibrate_noise": Recipe(
        lambda images, **more: nacre.calibrate_noise([images], **more),
        {"images": DEPTH, "camera": CAMERA, **_OPTIONS},
        _is_noise,
    ),
    "nacre.noise.estimate_noise": Recipe(nacre.estimate_noise, _DEPTH, _is_noise),
    "nacre.normals.estimate_normals": Recipe(
        nacre.estimate_normals,
        {"points": bumpy(), "k": 8, "max_radius": 1.0, "viewpoint": np.zeros(3), "num_threads": 1},
        lambda result, **_: has_unit_rows(result),
    ),
    "nacre.region.select_region": Recipe(
        nacre.select_region,
        {**_DEPTH, "previous": MASK, "noise": 0.001, "return_report": False,
         **dataclasses.asdict(nacre.RegionParameters())},
    ),
    "nacre.registration.align": Recipe(
        nacre.align,
        {"source": bumpy(), "target": bumpy(50), "source_normals": unit(60), "target_normals": unit(50),
         "source_sigma": np.full(60, 0.01), "target_sigma": np.full(50, 0.01),
         "source_colors": RNG.uniform(0, 255, 60),
         "target_colors": RNG.uniform(0, 255, 50), "initial": POSE, **_ALIGN},
        _aligned,
    ),
    "nacre.simulation.default_camera": Recipe(nacre.default_camera, {"mesh": VERTICES, "model": "pinhole"}),
    "nacre.simulation.simulate_depth": Recipe(
        nacre.simulate_depth, {"vertices": VERTICES, "triangles": TRIANGLES, **_SIMULATION}, _image
    ),
    "nacre.simulation.turntable_poses": Recipe(
        nacre.turntable_poses,
        {"mesh": VERTICES, "num_views": 3, "step": 0.1, "camera": CAMERA, "distance": 1.0, "elevation": 0.1,
         "axis": np.array([0.0, 1.0, 0.0])},
        _poses,
        grows=("num_views",),
    ),
    "nacre.system.default_threads": Recipe(nacre.default_threads, {}),
    "nacre.system.instruction_set": Recipe(nacre.instruction_set, {}),
    "nacre.system.parallel_backend": Recipe(nacre.parallel_backend, {}),
}  # fmt: skip
