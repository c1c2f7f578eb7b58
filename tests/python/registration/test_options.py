"""What each option of the registration does."""

from typing import Any

import numpy as np
import pytest
from known_motions import TRUTH, errors, motion, moved, source_of, turned

import nacre


def test_fixed_gate(cloud: Any, resampled: Any) -> None:
    """Pairs beyond a fixed gate are never used: a small offset is found, from afar nothing is matched."""
    near, normals = source_of(resampled, motion([0.01, -0.01, 0.005], [0.001, 0, -0.001]))
    fixed = {"max_distance": 0.005, "final_distance": 0.005, "gate_decay": 1.0, "target_normals": cloud[1]}
    result = nacre.align(near, cloud[0], source_normals=normals, **fixed)
    assert result.converged
    assert errors(result.target_from_source, motion([0.01, -0.01, 0.005], [0.001, 0, -0.001]))[0] < 0.05
    far = nacre.align(near + np.array([0.4, 0, 0]), cloud[0], source_normals=normals, **fixed)
    assert far.status == "too_few_pairs"
    assert far.num_inliers == 0


def test_annealed_gate_ends_at_final_distance(cloud: Any) -> None:
    """A part of the source lies 2 mm off the target: inside a gate of 3 mm, outside one of 0.5 mm."""
    source = cloud[0].copy()
    off = source[:, 0] > np.quantile(source[:, 0], 0.7)
    source[off] += 0.002 * cloud[1][off]
    options = {"source_normals": cloud[1], "target_normals": cloud[1]}
    wide = nacre.align(source, cloud[0], final_distance=0.003, **options)
    narrow = nacre.align(source, cloud[0], final_distance=0.0005, max_iterations=80, **options)
    assert wide.overlap > 0.95
    assert narrow.overlap == pytest.approx(0.7, abs=0.06)
    assert errors(narrow.target_from_source, np.eye(4))[1] < 1e-5


def test_normals_gate_drops_pairs_of_other_sides(cloud: Any) -> None:
    options = {"source_normals": cloud[1], "target_normals": cloud[1]}
    assert nacre.align(cloud[0], cloud[0], **options).overlap > 0.99
    flipped = nacre.align(cloud[0], cloud[0], source_normals=-cloud[1], target_normals=cloud[1])
    assert flipped.overlap < 0.3


@pytest.mark.parametrize("method", ["symmetric", "point_to_plane"])
@pytest.mark.parametrize("share", [0.2, 0.3])
def test_robust_weights_resist_outliers(cloud: Any, resampled: Any, share: float, method: Any) -> None:
    """A part of the source lies 1.5 mm off its surface, all on one side, within the gate."""
    source, normals = resampled[0].copy(), resampled[1]
    rng = np.random.default_rng(7)
    outliers = (normals[:, 0] > 0.3) & (rng.random(len(source)) < share / np.mean(normals[:, 0] > 0.3))
    source[outliers] += 0.0015 * normals[outliers]
    source += rng.normal(0, 0.0001, source.shape)
    inverse = np.linalg.inv(motion([0.02, 0.02, -0.01], [0.002, 0.001, -0.002]))
    options = {
        "source_normals": turned(inverse, normals),
        "target_normals": cloud[1],
        "final_distance": 0.004,
        "method": method,
        "max_iterations": 100,
    }
    shifts = {
        robust: errors(
            nacre.align(moved(inverse, source), cloud[0], robust=robust, **options).target_from_source,
            np.linalg.inv(inverse),
        )[1]
        for robust in (True, False)
    }
    assert shifts[True] < 0.15e-3
    assert shifts[True] < 0.5 * shifts[False]


def test_sigma_favours_the_accurate_points(cloud: Any, resampled: Any) -> None:
    source, normals = source_of(resampled, np.eye(4))
    rng = np.random.default_rng(8)
    rough = rng.random(len(source)) < 0.5
    sigma = np.where(rough, 0.002, 0.0001)
    results = {True: [], False: []}
    for _ in range(5):
        noisy = source + sigma[:, None] * rng.normal(0, 1, source.shape)
        for weighted, found in results.items():
            result = nacre.align(
                noisy,
                cloud[0],
                source_normals=normals,
                target_normals=cloud[1],
                source_sigma=sigma if weighted else None,
                robust=False,
                final_distance=0.008,
            )
            found.append(errors(result.target_from_source, np.eye(4))[1])
    assert np.mean(results[True]) < 0.5 * np.mean(results[False])


def test_equal_sigma_changes_nothing_but_the_scale(cloud: Any, resampled: Any) -> None:
    source, normals = source_of(resampled)
    options = {"source_normals": normals, "target_normals": cloud[1]}
    plain = nacre.align(source, cloud[0], **options)
    equal = nacre.align(source, cloud[0], source_sigma=np.full(len(source), 0.001), **options)
    assert np.allclose(equal.target_from_source, plain.target_from_source, atol=1e-9)


def test_keep_best_returns_the_iterate_of_least_rmse(cloud: Any, resampled: Any) -> None:
    source, normals = source_of(resampled, motion([0.03, -0.05, 0.02], [0.002, -0.002, 0.001]))
    options = {
        "source_normals": normals,
        "target_normals": cloud[1],
        "method": "point_to_plane",
        "gate_decay": 1.0,
        "max_distance": 0.01,
        "final_distance": 0.01,
        "robust": False,
        "coarse_samples": 0,
    }
    best = nacre.align(source, cloud[0], max_iterations=15, keep_best=True, **options)
    every_one = [
        nacre.align(source, cloud[0], max_iterations=count, **options).rmse for count in range(1, 15)
    ]
    assert best.rmse <= min(every_one) * 1.01


def test_samples_depend_on_the_seed_alone(cloud: Any, resampled: Any) -> None:
    source, normals = source_of(resampled)
    options = {"source_normals": normals, "target_normals": cloud[1], "sample_fraction": 0.1}
    one = nacre.align(source, cloud[0], seed=1, **options)
    again = nacre.align(source, cloud[0], seed=1, **options)
    two = nacre.align(source, cloud[0], seed=2, **options)
    assert (one.target_from_source == again.target_from_source).all()
    assert (one.target_from_source != two.target_from_source).any()
    assert one.num_inliers <= 300
    assert one.num_inliers == pytest.approx(300 * one.overlap)
    for result in (one, two):
        assert errors(result.target_from_source, TRUTH)[0] < 0.3


@pytest.mark.parametrize(("limit", "expected"), [(500, 500), (0, 3000), (10**6, 3000)])
def test_max_samples(cloud: Any, resampled: Any, limit: int, expected: int) -> None:
    source, normals = source_of(resampled)
    result = nacre.align(source, cloud[0], source_normals=normals, target_normals=cloud[1], max_samples=limit)
    assert result.num_inliers / result.overlap == pytest.approx(expected)


def test_too_few_iterations_are_not_called_convergence(cloud: Any, resampled: Any) -> None:
    source, normals = source_of(resampled)
    result = nacre.align(source, cloud[0], source_normals=normals, target_normals=cloud[1], max_iterations=2)
    assert result.status == "max_iterations"
    assert not result.converged
    assert result.iterations == 2
