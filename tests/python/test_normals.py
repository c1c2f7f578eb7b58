import inspect

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import nacre
from nacre import _core


def sphere(count, seed=0):
    points = np.random.default_rng(seed).normal(size=(count, 3))
    return points / np.linalg.norm(points, axis=1, keepdims=True)


def rotation(seed):
    q, r = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    q *= np.sign(np.diag(r))
    return q * np.sign(np.linalg.det(q))


def test_a_sphere_seen_from_inside():
    points = sphere(5000)
    normals = nacre.estimate_normals(points)
    assert normals.dtype == np.float64
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1, atol=1e-12)
    assert np.einsum("ij,ij->i", normals, points).max() < -0.99


def test_the_least_squares_plane():
    points = sphere(3000, 1) + np.random.default_rng(2).normal(size=(3000, 3)) * 0.01
    normals = nacre.estimate_normals(points, k=12)
    _, indices = nacre.KdTree(points).query(points, k=12)
    near = points[indices] - points[indices].mean(axis=1, keepdims=True)
    _, vectors = np.linalg.eigh(np.einsum("nki,nkj->nij", near, near))
    known = np.isfinite(normals[:, 0])
    assert known.mean() > 0.99
    assert np.linalg.norm(np.cross(vectors[known, :, 0], normals[known]), axis=1).max() < 1e-10


@settings(max_examples=30, deadline=None, derandomize=True)
@given(
    seed=st.integers(0, 2**32 - 1),
    scale=st.sampled_from([1e-6, 1.0, 1e6]),
    shift=st.sampled_from([0.0, 100.0]),
)
def test_rotated_points_have_rotated_normals(seed, scale, shift):
    turn = rotation(seed)
    points = sphere(300, 3)
    moved = scale * (points @ turn.T + shift)
    normals = nacre.estimate_normals(moved, viewpoint=np.full(3, scale * shift))
    np.testing.assert_allclose(normals, nacre.estimate_normals(points) @ turn.T, atol=1e-7)


def test_the_order_of_the_points_does_not_matter():
    points = sphere(2000, 4).astype(np.float32)
    order = np.random.default_rng(5).permutation(len(points))
    np.testing.assert_allclose(
        nacre.estimate_normals(points[order]), nacre.estimate_normals(points)[order], atol=1e-6
    )


def test_far_away_points_keep_their_digits():
    points = sphere(2000, 6)
    far = np.array([1e6, -2e6, 3e6])
    normals = nacre.estimate_normals(points + far, viewpoint=far)
    np.testing.assert_allclose(normals, nacre.estimate_normals(points), atol=1e-6)


def test_single_precision_in_and_out():
    points = sphere(2000, 7).astype(np.float32)
    normals = nacre.estimate_normals(points)
    assert normals.dtype == np.float32
    np.testing.assert_allclose(normals, nacre.estimate_normals(points.astype(np.float64)), atol=1e-6)


@pytest.mark.parametrize("k", [16, 32])
def test_ordinary_noise_is_no_reason_to_refuse(k):
    rng = np.random.default_rng(8)
    points = np.c_[rng.uniform(0, 100, (10_000, 2)), rng.normal(scale=0.5, size=10_000)]  # half the spacing
    refused = np.isnan(nacre.estimate_normals(points, k=k)[:, 0])
    assert refused.mean() < 0.005


def test_no_plane_no_normal():
    line = np.outer(np.arange(40.0), (0.3, -0.1, 0.7))
    assert np.isnan(nacre.estimate_normals(line)).all()
    assert np.isnan(nacre.estimate_normals(line.astype(np.float32))).all()
    assert np.isnan(nacre.estimate_normals(np.ones((40, 3)))).all()
    lattice = np.stack(np.meshgrid(*[np.arange(5.0)] * 3), axis=-1).reshape(-1, 3)
    assert np.isnan(nacre.estimate_normals(lattice, k=125)).all()


def test_too_few_neighbours():
    for count in (0, 1, 2):
        normals = nacre.estimate_normals(sphere(count))
        assert normals.shape == (count, 3)
        assert np.isnan(normals).all()
    assert np.isfinite(nacre.estimate_normals(sphere(3))).all()
    assert np.isnan(nacre.estimate_normals(sphere(100), max_radius=1e-9)).all()


def test_points_that_are_not_finite_have_no_normal_and_do_no_harm():
    points = sphere(1000, 9)
    clean = nacre.estimate_normals(points[100:])
    points[:50, 1] = np.nan
    points[50:100, 2] = np.inf
    normals = nacre.estimate_normals(points)
    assert np.isnan(normals[:100]).all()
    np.testing.assert_array_equal(normals[100:], clean)


def test_the_same_bits_for_any_number_of_threads():
    points = sphere(20_000, 10).astype(np.float32)
    one = nacre.estimate_normals(points, num_threads=1)
    np.testing.assert_array_equal(nacre.estimate_normals(points, num_threads=4), one)


def test_the_defaults_are_those_of_the_core():
    options = _core.NormalOptions()
    for name, parameter in inspect.signature(nacre.estimate_normals).parameters.items():
        if hasattr(options, name):
            assert parameter.default == getattr(options, name)


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        ({"points": np.zeros((4, 2))}, ValueError, r"points must have shape \(N, 3\), got \(4, 2\)"),
        ({"k": 2}, ValueError, "k must be an integer of at least 3, got 2"),
        ({"k": "many"}, TypeError, "k must be an integer, got 'many'"),
        ({"max_radius": 0}, ValueError, "max_radius must be positive, got 0"),
        ({"max_radius": -1.0}, ValueError, "max_radius must be at least 0, got -1"),
        ({"viewpoint": (0, 0)}, ValueError, "viewpoint must be 3 finite numbers"),
        ({"viewpoint": (0, 0, np.nan)}, ValueError, "viewpoint must be 3 finite numbers"),
        ({"num_threads": None}, TypeError, "num_threads must be an integer, got None"),
    ],
)
def test_illegal_arguments(arguments, error, message):
    with pytest.raises(error, match=message):
        nacre.estimate_normals(**({"points": sphere(10)} | arguments))
