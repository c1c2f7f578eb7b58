"""The expected standard deviation of points, beside their true distance from the surface."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import nacre
from nacre.evaluation import surface_accuracy

CAMERA = nacre.Camera(160, 120, 131, 131, 79.5, 59.5)
WALL = np.full((120, 160), 0.6)


@pytest.mark.parametrize(
    "options",
    [{"noise": 0.001}, {"sensor": "stereo"}, {"sensor": "structured_light"}],
    ids=["independent", "stereo", "structured light"],
)
def test_the_true_error_is_within_a_factor_of_two(options: dict[str, Any]) -> None:
    mesh = nacre.built_in_object()
    camera = nacre.Camera(240, 180, 196, 196, 119.5, 89.5)
    model = nacre.Model(camera, relocalise=False, loop_closure=False)
    for i, pose in enumerate(nacre.turntable_poses(mesh, 8, 0.17, camera=camera, distance=0.35)):
        depth = mesh.simulate_depth(camera, pose, seed=i, **options)
        assert model.add_frame(depth, guess=pose if i == 0 else None).status == "TRACKED"
    expected = math.sqrt(np.mean(model.point_sigma**2))
    true = surface_accuracy(model.points, mesh).rms
    assert expected / 2 < true < 2 * expected


def wall_model(num_frames: int, sigma: float = 0.001, **changes: Any) -> nacre.Model:
    """Return a model of a wall that a camera stands still before; its noise is given, and independent."""
    model = nacre.Model(CAMERA, depth={"noise": sigma}, **changes)
    random = np.random.default_rng(0)
    for _ in range(num_frames):
        model.add_frame(random.normal(WALL, sigma), guess=np.eye(4), keep_guess=True)
    return model


def test_it_falls_with_the_square_root_of_the_number_of_frames() -> None:
    few, many = (float(np.median(wall_model(number).point_sigma)) for number in (4, 16))
    assert few / many == pytest.approx(2, rel=0.1)


def test_independent_noise_is_what_the_points_have() -> None:
    model = wall_model(8)
    inner = (np.abs(model.points[:, :2]) < 0.2).all(axis=1)
    error = (model.points[inner, 2] - 0.6) / model.point_sigma[inner]
    assert 0.6 < np.sqrt(np.mean(error**2)) < 1.4


def test_it_is_in_proportion_to_the_noise() -> None:
    one, two = (float(np.median(wall_model(4, sigma).point_sigma)) for sigma in (0.0005, 0.001))
    assert two / one == pytest.approx(2, rel=0.15)


def test_without_fusion_nobody_knows_it() -> None:
    model = wall_model(2, fusion_method="wlop+")
    assert len(model) > 0
    assert np.isnan(model.point_sigma).all()
    assert model.point_sigma.shape == (len(model),)


def test_poses_that_are_given_do_not_tell_it() -> None:
    """Images of a stereo camera show a tenth of its noise."""
    mesh = nacre.built_in_object()
    poses = nacre.turntable_poses(mesh, 3, 0.1, camera=CAMERA, distance=0.35)
    images = [mesh.simulate_depth(CAMERA, pose, seed=i, sensor="stereo") for i, pose in enumerate(poses)]
    model = nacre.Model(CAMERA)
    for depth, pose in zip(images[:2], poses[:2], strict=True):
        model.add_frame(depth, guess=pose, keep_guess=True)
    assert len(model) > 0
    assert np.isnan(model.point_sigma).all()
    assert model.add_frame(images[2], guess=poses[2]).num_inliers > 0
    assert np.isfinite(model.point_sigma).all()


def test_an_empty_model_has_none() -> None:
    assert nacre.Model(CAMERA).point_sigma.shape == (0,)


def test_a_model_that_was_saved_has_the_same(tmp_path: Path) -> None:
    model = wall_model(3)
    model.save(tmp_path / "model")
    np.testing.assert_array_equal(nacre.Model.load(tmp_path / "model").point_sigma, model.point_sigma)
