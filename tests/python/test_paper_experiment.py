"""
The experiment of Blackburn, Kubacki and Stratton 2010, on the built-in object.

Twelve orthographic views of 1 mm pixels, every 30 degrees, each registered from the pose before.
"""

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


@functools.cache
def experiment(preset: Any, sigma: float, first_seed: int = 0) -> nacre.Model:
    camera = nacre.default_camera(thing())
    assert camera.model == "orthographic"
    assert camera.pixel_size == 0.001
    model = nacre.Model(camera, preset)
    for index, pose in enumerate(nacre.turntable_poses(thing())):
        model.add_frame(thing().simulate_depth(camera, pose, noise=sigma, seed=first_seed + index))
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


def completeness(points: Any) -> float:
    """Return the part of what the cameras saw that has a model point within 3 mm."""
    poses, camera = nacre.turntable_poses(thing()), nacre.default_camera(thing())
    seen = np.concatenate(
        [
            nacre.back_project(thing().simulate_depth(camera, pose), camera) @ true[:3, :3].T + true[:3, 3]
            for pose, true in zip(poses, truth(), strict=True)
        ]
    )
    distances, _ = nacre.KdTree(points.astype(np.float64)).query(seen, k=1)
    return float(np.mean(distances < 0.003))


def unevenness(points: Any) -> float:
    """Return the coefficient of variation of the distances between nearest neighbours."""
    distances, _ = nacre.KdTree(points).query(points, k=2)
    return float(distances[:, 1].std() / distances[:, 1].mean())


@pytest.mark.parametrize(
    ("sigma", "first_seed", "angle", "shift", "rms"),
    [
        (0.0, 0, 0.06, 0.06e-3, 0.10e-3),
        (0.0005, 0, 0.4, 0.4e-3, 0.2e-3),
        (0.0005, 100, 0.4, 0.4e-3, 0.2e-3),
        (0.0005, 200, 0.4, 0.4e-3, 0.2e-3),
    ],
)
def test_default_preset(sigma: float, first_seed: int, angle: float, shift: float, rms: float) -> None:
    """
    The default preset tracks every frame, closely.

    Measured, without noise: 0.023 degrees, 0.024 mm, RMS 0.067 mm. With noise of 0.5 mm, for three seeds:
    0.18, 0.26, 0.21 degrees; 0.18, 0.26, 0.12 mm; RMS 0.14, 0.16, 0.13 mm. Completeness 0.94.
    """
    model = experiment("default", sigma, first_seed)
    assert [report.status for report in model.frames] == ["TRACKED"] * 12
    angles, shifts = pose_errors(model)
    assert angles.max() < angle
    assert shifts.max() < shift
    assert surface_error(model.points) < rms
    assert completeness(model.points) > 0.9
    assert unevenness(model.points) < 0.15
    # The model knows more than a frame: the noise is gone.
    assert sigma == 0 or surface_error(model.points) < 0.5 * sigma


@pytest.mark.parametrize("sigma", [0.0, 0.0005])
def test_paper_preset_runs_to_its_end(sigma: float) -> None:
    """
    The paper's numbers, literally, lose this object after two views; the figures are honest all the same.

    Measured, without noise and with 0.5 mm: 46 and 35 degrees; 11 and 8 mm; RMS 13 and 7 mm.
    """
    model = experiment("paper", sigma)
    assert len(model.frames) == 12
    assert max(report.num_points for report in model.frames) <= 2000
    angles, shifts = pose_errors(model)
    assert np.isfinite(angles).all()
    assert np.isfinite(shifts).all()
    assert angles[0] == 0
    assert np.isfinite(surface_error(model.points))
    assert 0 < completeness(model.points) <= 1
