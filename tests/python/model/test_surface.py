"""What the model becomes: as smooth, even and dense as promised."""

import numpy as np
import pytest
from model_scenes import (
    FLAT,
    PINHOLE,
    Array,
    ball,
    object_model,
    off_slope,
    relief,
    rms,
    shifted,
    slope,
    thing,
    view,
)

import nacre


def seen_ten_times(depth: np.ndarray, sigma: float, seed: int) -> nacre.Model:
    """Return a model of ten noisy images from one place."""
    rng = np.random.default_rng(seed)
    model = nacre.Model(FLAT)
    for _ in range(10):
        model.add_frame(depth + rng.normal(0, sigma, depth.shape), guess=np.eye(4), keep_guess=True)
    return model


def test_a_noisy_plane_is_smoothed() -> None:
    """Measured: RMS 0.07, bias 0.003 of the sensor's noise; normals 0.8 degrees."""
    sigma = 0.001
    model = seen_ten_times(slope(), sigma, seed=1)
    distances = off_slope(model.points)
    assert len(model) > 1000
    assert rms(distances) < 0.15 * sigma
    assert abs(distances.mean()) < 0.02 * sigma
    normal = np.array([0.3, -0.2, -1]) / np.sqrt(1 + 0.3**2 + 0.2**2)
    assert np.degrees(np.arccos(np.clip(model.normals @ normal, -1, 1))).mean() < 2


def test_a_noisy_sphere_is_smoothed_and_not_shrunk() -> None:
    """Measured: RMS 0.08, bias -0.02 of the sensor's noise."""
    sigma = 0.0005
    model = seen_ten_times(ball(), sigma, seed=2)
    outward = model.points - np.array([0, 0, 0.3])
    distances = np.linalg.norm(outward, axis=1) - 0.03
    assert len(model) > 300
    assert rms(distances) < 0.2 * sigma
    assert abs(distances.mean()) < 0.06 * sigma
    assert (np.einsum("nd,nd->n", model.normals, outward) > 0).all()


def neighbours(model: nacre.Model) -> tuple[Array, Array]:
    """Return each point's nearest neighbour's distance, and that of the nearest on the same sheet."""
    points, normals = model.points, model.normals
    distances, indices = nacre.KdTree(points).query(points, k=12)
    agree = np.einsum("nkd,nd->nk", normals[indices[:, 1:]], normals) > 0.5
    same = np.where(agree, distances[:, 1:], np.inf).min(axis=1)
    return distances[:, 1], same


@pytest.mark.parametrize("spacing", [0.0, 0.002, 0.003])
def test_spacing_is_respected_and_even(spacing: float) -> None:
    model = object_model(1, spacing=spacing)
    assert model.spacing == pytest.approx(spacing or 0.002)
    _, same = neighbours(model)
    assert same.min() > 0.999 * model.spacing
    same = same[np.isfinite(same)]
    assert same.std() / same.mean() < 0.15
    assert same.mean() < 1.4 * model.spacing


def test_spacing_stays_even_over_many_frames() -> None:
    """Measured: coefficient of variation 0.08, 3.1 % of the points nearer than 0.9 spacings."""
    model = object_model(12)
    _, same = neighbours(model)
    same = same[np.isfinite(same)]
    assert np.mean(same < 0.9 * model.spacing) < 0.04
    assert same.std() / same.mean() < 0.15


def test_spacing_of_the_first_frame_is_two_pixels() -> None:
    model = nacre.Model(PINHOLE)
    assert model.spacing == 0
    model.add_frame(np.full((120, 160), 0.75))
    assert model.spacing == pytest.approx(2 * 0.75 / 150, rel=0.01)


def test_confidence_grows_with_observations() -> None:
    model = nacre.Model(FLAT)
    sums = []
    for _ in range(4):
        model.add_frame(relief(), guess=np.eye(4), keep_guess=True)
        sums.append(float(np.median(model.confidence)))
    assert np.all(np.diff(sums) > 0)
    assert np.allclose(np.diff(sums), sums[0], rtol=0.3)


def test_confidence_is_bounded() -> None:
    model = nacre.Model(FLAT, **{"fusion.max_confidence": 12.0})
    for _ in range(4):
        model.add_frame(relief(), guess=np.eye(4), keep_guess=True)
    assert model.confidence.max() == 12
    assert np.median(model.confidence) == 12


def test_normals_point_to_the_camera() -> None:
    """Towards where the point was seen from, not towards the origin."""
    pose = shifted(5, -3, 2)
    model = nacre.Model(PINHOLE)
    v, u = np.indices((120, 160))
    depth = 0.6 + 0.02 * np.sin(u / 9) * np.cos(v / 7)
    model.add_frame(depth, guess=pose)
    to_camera = pose[:3, 3] - model.points
    assert len(model) > 2000
    assert (np.einsum("nd,nd->n", model.normals, to_camera) > 0).all()
    assert np.allclose(np.linalg.norm(model.normals, axis=1), 1, atol=1e-5)


def test_max_points_is_never_exceeded() -> None:
    model = nacre.Model(nacre.default_camera(thing()), max_points=700)
    spacings = []
    for index in range(5):
        report = model.add_frame(view(index))
        assert report.status == "TRACKED"
        assert report.num_points == len(model) <= 700
        spacings.append(report.spacing)
    assert spacings[0] > 0.002
    assert np.all(np.diff(spacings) >= 0)
    assert len(model) > 350
    _, same = neighbours(model)
    assert np.quantile(same[np.isfinite(same)], 0.05) > 0.8 * model.spacing
