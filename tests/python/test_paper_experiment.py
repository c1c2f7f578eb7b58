"""
The experiment of Blackburn, Kubacki and Stratton 2010, on the built-in object.

Twelve orthographic views of 1 mm pixels, every 30 degrees.
"""

import dataclasses
import functools
from typing import Any

import numpy as np
import pytest

import nacre

pytestmark = pytest.mark.slow


@functools.cache
def thing() -> nacre.Mesh:
    return nacre.built_in_object()


def truth() -> Any:
    """Return the cameras in the frame of the first."""
    poses = nacre.turntable_poses(thing())
    return np.linalg.inv(poses[0]) @ poses


def experiment(preset: Any, sigma: float, seed: int = 0) -> nacre.Model:
    """Return the model after a turn; the seed draws the images, the 5 % of the points and the samples."""
    camera = nacre.default_camera(thing())
    assert camera.model == "orthographic"
    assert camera.pixel_size == 0.001
    parameters = nacre.ModelParameters.preset(preset) if isinstance(preset, str) else preset
    parameters = dataclasses.replace(
        parameters,
        registration=dataclasses.replace(parameters.registration, seed=seed),
        wlop=dataclasses.replace(parameters.wlop, seed=seed),
    )
    model = nacre.Model(camera, parameters=parameters)
    for index, pose in enumerate(nacre.turntable_poses(thing())):
        noise = {"noise": sigma, "edge_mixing": float(sigma > 0), "seed": 100 * seed + index}
        model.add_frame(thing().simulate_depth(camera, pose, **noise))
    return model


def pose_errors(model: nacre.Model) -> tuple[Any, Any]:
    """Return the angles [degrees] and the shifts at the object's centre [m]."""
    center = np.linalg.inv(nacre.turntable_poses(thing())[0]) @ [*thing().bounds.mean(axis=0), 1]
    difference = model.poses @ np.linalg.inv(truth())
    r = difference[:, :3, :3]
    axes = np.stack([r[:, 2, 1] - r[:, 1, 2], r[:, 0, 2] - r[:, 2, 0], r[:, 1, 0] - r[:, 0, 1]], axis=1)
    angles = np.degrees(np.arctan2(np.linalg.norm(axes, axis=1), np.trace(r, axis1=1, axis2=2) - 1))
    return angles, np.linalg.norm((difference @ center - center)[:, :3], axis=1)


def surface_error(points: Any) -> float:
    """Return the root mean square distance of points of the first camera's frame from the object [m]."""
    pose = nacre.turntable_poses(thing())[0]
    distances = thing().distance(points @ pose[:3, :3].T + pose[:3, 3])
    return float(np.sqrt(np.mean(distances**2)))


def completeness(points: Any, radius: float = 0.003) -> float:
    """Return the part of what the cameras saw that has a model point within a radius."""
    poses, camera = nacre.turntable_poses(thing()), nacre.default_camera(thing())
    seen = np.concatenate(
        [
            nacre.back_project(thing().simulate_depth(camera, pose), camera) @ true[:3, :3].T + true[:3, 3]
            for pose, true in zip(poses, truth(), strict=True)
        ]
    )
    distances, _ = nacre.KdTree(points.astype(np.float64)).query(seen, k=1)
    return float(np.mean(distances < radius))


def unevenness(points: Any) -> float:
    """Return the coefficient of variation of the distances between nearest neighbours."""
    distances, _ = nacre.KdTree(points).query(points, k=2)
    return float(distances[:, 1].std() / distances[:, 1].mean())


@pytest.mark.parametrize(
    ("sigma", "seed", "angle", "shift", "rms"),
    [
        (0.0, 0, 0.06, 0.06e-3, 0.10e-3),
        (0.0005, 0, 0.4, 0.4e-3, 0.2e-3),
        (0.0005, 1, 0.4, 0.4e-3, 0.2e-3),
        (0.0005, 2, 0.4, 0.4e-3, 0.2e-3),
    ],
)
def test_default_preset(sigma: float, seed: int, angle: float, shift: float, rms: float) -> None:
    """
    The default preset tracks every frame, closely.

    Measured, without noise: 0.023 degrees, 0.024 mm, RMS 0.067 mm. With noise of 0.5 mm, for three seeds:
    0.18, 0.26, 0.21 degrees; 0.18, 0.26, 0.12 mm; RMS 0.14, 0.16, 0.13 mm. Completeness 0.94.
    """
    model = experiment("default", sigma, seed)
    assert [report.status for report in model.frames] == ["TRACKED"] * 12
    angles, shifts = pose_errors(model)
    assert angles.max() < angle
    assert shifts.max() < shift
    assert surface_error(model.points) < rms
    assert completeness(model.points) > 0.9
    assert unevenness(model.points) < 0.15
    # The model knows more than a frame: the noise is gone.
    assert sigma == 0 or surface_error(model.points) < 0.5 * sigma


@pytest.mark.parametrize(
    ("sigma", "num_runs"), [(0.0, 20), pytest.param(0.0, 60, marks=pytest.mark.weekly), (0.0005, 60)]
)
def test_paper_preset(sigma: float, num_runs: int) -> None:
    """
    The paper's algorithm, alone, completes the turn in at least 95 % of the runs.

    No pose is more than 5 degrees off, and the model has the object's shape.
    """
    runs = [experiment("paper", sigma, seed) for seed in range(num_runs)]
    assert all(len(model.frames) == 12 for model in runs)
    assert max(report.num_points for model in runs for report in model.frames) == 2000
    succeed = [
        pose_errors(model)[0].max() < 5
        and surface_error(model.points) < 0.002
        and completeness(model.points, 0.008) > 0.85
        for model in runs
    ]
    assert sum(succeed) >= 0.95 * num_runs


def test_paper_preset_needs_what_the_paper_leaves_open() -> None:
    """Every view from the last pose, Huang's theta, all normals matched: the turn is lost."""
    preset = nacre.ModelParameters.preset("paper")
    literal = dataclasses.replace(
        preset,
        predict_motion=False,
        registration=dataclasses.replace(preset.registration, max_angle=np.pi),
        wlop=dataclasses.replace(preset.wlop, theta="huang", normal_neighbors=3),
    )
    angles, _ = pose_errors(experiment(literal, 0.0))
    assert angles.max() > 20
