"""What the data knows about the pose, and which directions it leaves open."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from known_motions import (
    CENTER,
    METHODS,
    Array,
    cylinder,
    errors,
    motion,
    moved,
    plane,
    sampled,
    source_of,
    sphere,
    twist,
)

import nacre


@pytest.mark.parametrize("robust", [True, False])
@pytest.mark.parametrize("method", ["symmetric", "point_to_plane"])
def test_information_is_the_inverse_covariance(cloud: Any, method: Any, robust: bool) -> None:
    """Repeated trials vary so, within a factor of 3 of the variance along each axis. Measured: 0.7 to 1.5."""
    sigma, rng = 0.0005, np.random.default_rng(9)
    base, normals = sampled(800, 10)
    differences, informations = [], []
    for _ in range(60):
        noisy = base + rng.normal(0, sigma, base.shape)
        result = nacre.align(
            noisy, cloud[0], source_normals=normals, target_normals=cloud[1], method=method, robust=robust
        )
        differences.append(twist(result.target_from_source, np.eye(4), result.center))
        informations.append(result.information)
    information = np.mean(informations, axis=0)
    covariance = np.cov(np.array(differences).T)
    values, axes = np.linalg.eigh(np.linalg.inv(information))
    ratios = np.array([axis @ covariance @ axis for axis in axes.T]) / values
    assert (ratios > 1 / 3).all(), ratios
    assert (ratios < 3).all(), ratios


@pytest.mark.parametrize("method", METHODS)
def test_information_is_symmetric_and_positive(cloud: Any, resampled: Any, method: Any) -> None:
    source, normals = source_of(resampled)
    result = nacre.align(source, cloud[0], source_normals=normals, target_normals=cloud[1], method=method)
    assert result.information.shape == (6, 6)
    assert np.allclose(result.information, result.information.T, rtol=1e-12)
    assert (np.linalg.eigvalsh(result.information) > 0).all()


@pytest.mark.parametrize("method", ["symmetric", "point_to_plane"])
@pytest.mark.parametrize(
    ("shape", "free"),
    [
        (plane, [[0, 0, 1, 0, 0, 0], [0, 0, 0, 1, 0, 0], [0, 0, 0, 0, 1, 0]]),
        (sphere, [[1, 0, 0, 0, 0, 0], [0, 1, 0, 0, 0, 0], [0, 0, 1, 0, 0, 0]]),
        (cylinder, [[0, 1, 0, 0, 0, 0], [0, 0, 0, 0, 1, 0]]),
    ],
)
def test_weak_directions_keep_their_initial_value(
    shape: Callable[[int], tuple[Array, Array]], free: list[list[float]], method: Any
) -> None:
    """The free motions of a plane, a sphere and a cylinder are found, and not made up."""
    target, target_normals = shape(11)
    source, normals = shape(12)
    wanted = np.array([0.03, 0.05, 0.04, 0.004, 0.006, 0.003])
    first = motion(wanted[:3], wanted[3:])
    result = nacre.align(
        source, target, source_normals=normals, target_normals=target_normals, initial=first, method=method
    )
    assert len(result.weak_directions) == len(free)
    assert np.allclose(np.linalg.norm(result.weak_directions, axis=1), 1)
    # The weak directions span the free ones.
    spanned = result.weak_directions @ np.array(free, dtype=float).T
    assert np.allclose(spanned @ spanned.T, np.eye(len(free)), atol=0.02)
    # What is free stays, what is not is corrected.
    expected = wanted * np.any(free, axis=0)
    difference = twist(result.target_from_source, np.eye(4), CENTER)
    assert np.allclose(difference[:3], expected[:3], atol=0.006)
    assert np.allclose(difference[3:], expected[3:], atol=0.0008)
    assert np.sqrt(np.mean((moved(result.target_from_source, source) - CENTER) ** 2)) < 1  # finite
    assert result.rmse < 1e-4


def test_low_bumps_tell_the_turn_of_a_noisy_ball() -> None:
    """Normals that are estimated from noise neither hide the turn, nor feign one on a ball without bumps."""

    def scan(seed: int, height: float) -> Array:
        rng = np.random.default_rng(seed)
        directions = rng.normal(size=(10000, 3))
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        x, y, z = directions.T
        bumps = np.sin(5 * x + 1) * np.cos(4 * y) + np.sin(6 * z + 2 * x)
        points = 0.075 * (1 + height * bumps)[:, None] * directions
        return points + 0.0003 * rng.normal(size=points.shape)

    turn = motion(np.radians([4, -6, 5]), [0.003, -0.002, 0.004])
    bumpy = nacre.align(moved(turn, scan(1, 0.03)), scan(2, 0.03))
    assert bumpy.converged
    assert len(bumpy.weak_directions) == 0
    assert errors(bumpy.target_from_source, np.linalg.inv(turn))[0] < 1
    assert len(nacre.align(moved(turn, scan(1, 0.0)), scan(2, 0.0)).weak_directions) == 3


def test_no_direction_of_a_generic_object_is_weak(cloud: Any, resampled: Any) -> None:
    source, normals = source_of(resampled)
    result = nacre.align(source, cloud[0], source_normals=normals, target_normals=cloud[1])
    assert result.weak_directions.shape == (0, 6)


def test_weak_threshold_zero_finds_nothing_weak() -> None:
    (target, target_normals), (source, normals) = cylinder(11), cylinder(12)
    options = {"source_normals": normals, "target_normals": target_normals}
    assert len(nacre.align(source, target, weak_threshold=0.0, **options).weak_directions) == 0
    assert len(nacre.align(source, target, weak_threshold=0.01, **options).weak_directions) == 2
