"""Registration against motions that are known, and against data that allows no answer."""

import functools
import inspect
from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import nacre
from nacre import _core

Array = npt.NDArray[Any]
METHODS = ["symmetric", "point_to_plane", "point_to_point"]
CENTER = np.array([0.0, 0.0, 0.4])  # of the clouds below [m]


def rotation(vector: npt.ArrayLike) -> Array:
    """Rodrigues' formula."""
    vector = np.asarray(vector, dtype=np.float64)
    angle = np.linalg.norm(vector)
    if angle == 0:
        return np.eye(3)
    x, y, z = vector / angle
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def motion(vector: npt.ArrayLike, translation: npt.ArrayLike, center: npt.ArrayLike = CENTER) -> Array:
    """Return a turn about a centre, then a shift."""
    pose = np.eye(4)
    pose[:3, :3] = rotation(vector)
    pose[:3, 3] = np.asarray(center) - pose[:3, :3] @ center + translation
    return pose


def moved(pose: Array, points: Array) -> Array:
    return points @ pose[:3, :3].T + pose[:3, 3]


def turned(pose: Array, normals: Array) -> Array:
    return normals @ pose[:3, :3].T


def twist(pose: Array, truth: Array, center: Array) -> Array:
    """Return how a pose differs from the truth: a small turn about a point, and the shift of that point."""
    difference = pose @ np.linalg.inv(truth)
    r = difference[:3, :3]
    turn = 0.5 * np.array([r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]])
    return np.concatenate([turn, r @ center + difference[:3, 3] - center])


def errors(pose: Array, truth: Array, center: npt.ArrayLike = CENTER) -> tuple[float, float]:
    """Return the angle [degrees] and the shift of a centre of the target frame [m] between two poses."""
    difference = twist(pose, truth, np.asarray(center))
    return float(np.degrees(np.linalg.norm(difference[:3]))), float(np.linalg.norm(difference[3:]))


@functools.cache
def built_in_triangles() -> tuple[Array, Array]:
    """Return the corners of the built-in object's triangles about CENTER, and normals as long as areas."""
    thing = nacre.built_in_object()
    corners = thing.vertices[thing.triangles] - thing.bounds.mean(axis=0) + CENTER
    return corners, 0.5 * np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


def sampled(count: int, seed: int) -> tuple[Array, Array]:
    """Return points of the built-in object's surface about CENTER, spread at random, and their normals."""
    corners, normals = built_in_triangles()
    areas = np.linalg.norm(normals, axis=1)
    rng = np.random.default_rng(seed)
    chosen = rng.choice(len(areas), count, p=areas / areas.sum())
    points = np.einsum("nk,nkd->nd", rng.dirichlet((1, 1, 1), count), corners[chosen])
    return points, normals[chosen] / areas[chosen, None]


@pytest.fixture(scope="module")
def cloud() -> tuple[Array, Array]:
    return sampled(4000, 1)


@pytest.fixture(scope="module")
def resampled() -> tuple[Array, Array]:
    """Other points of the same surface."""
    return sampled(3000, 2)


TRUTH = motion([0.06, -0.1, 0.05], [0.004, -0.006, 0.003])


def source_of(cloud: tuple[Array, Array], truth: Array = TRUTH) -> tuple[Array, Array]:
    inverse = np.linalg.inv(truth)
    return moved(inverse, cloud[0]), turned(inverse, cloud[1])


# Known motions


@pytest.mark.parametrize("with_normals", [True, False])
@pytest.mark.parametrize("method", METHODS)
def test_same_points_are_brought_back_exactly(cloud: Any, method: Any, with_normals: bool) -> None:
    source, normals = source_of(cloud)
    options = {"source_normals": normals, "target_normals": cloud[1]} if with_normals else {}
    result = nacre.align(source, cloud[0], method=method, max_iterations=200, **options)
    angle, shift = errors(result.target_from_source, TRUTH)
    assert result.converged
    assert result.status == "converged"
    assert angle < 1e-3
    assert shift < 1e-6
    assert result.overlap > 0.98
    if with_normals:  # without, points of no plane take no part
        assert result.num_inliers == pytest.approx(result.overlap * len(source))
    assert result.rmse < 1e-6


@pytest.mark.parametrize("method", METHODS)
def test_other_points_of_the_same_surface(cloud: Any, resampled: Any, method: Any) -> None:
    source, normals = source_of(resampled)
    result = nacre.align(
        source, cloud[0], source_normals=normals, target_normals=cloud[1], method=method, max_iterations=200
    )
    angle, shift = errors(result.target_from_source, TRUTH)
    assert result.overlap > 0.9
    # Points that have no partner pull point_to_point to and fro; planes do not care.
    assert angle < (0.5 if method == "point_to_point" else 0.1)
    assert shift < (0.5e-3 if method == "point_to_point" else 0.1e-3)


@pytest.mark.parametrize("with_normals", [True, False])
def test_noise_is_averaged(cloud: Any, resampled: Any, with_normals: bool) -> None:
    sigma = 0.0005
    rng = np.random.default_rng(3)
    source, normals = source_of(resampled)
    source = source + rng.normal(0, sigma, source.shape)
    options = {"source_normals": normals, "target_normals": cloud[1]} if with_normals else {}
    result = nacre.align(source, cloud[0], **options)
    angle, shift = errors(result.target_from_source, TRUTH)
    assert result.converged
    assert angle < 0.1
    assert shift < 0.2 * sigma
    if with_normals:
        assert 0.7 * sigma < result.rmse < 1.6 * sigma


def test_inverse_direction_is_the_inverse_motion(cloud: Any, resampled: Any) -> None:
    source, normals = source_of(resampled)
    there = nacre.align(source, cloud[0], source_normals=normals, target_normals=cloud[1])
    back = nacre.align(cloud[0], source, source_normals=cloud[1], target_normals=normals)
    angle, shift = errors(np.linalg.inv(back.target_from_source), there.target_from_source)
    assert angle < 0.05
    assert shift < 0.05e-3


def test_far_away_float64_coordinates_keep_their_digits(cloud: Any) -> None:
    source, normals = source_of(cloud)
    far_source, far_target = np.array([1e6, -2e6, 5e5]), np.array([-1e6, 1e6, 3e6])
    first = np.eye(4)
    first[:3, 3] = far_target - far_source
    result = nacre.align(
        source + far_source,
        cloud[0] + far_target,
        source_normals=normals,
        target_normals=cloud[1],
        initial=first,
    )
    assert result.converged
    end = moved(result.target_from_source, source + far_source) - far_target
    assert np.abs(end - cloud[0]).max() < 1e-5
    assert np.allclose(result.center - far_target, CENTER, atol=0.05)


def test_initial_guess_is_where_the_search_starts(cloud: Any, resampled: Any) -> None:
    truth = motion([0.1, 2.0, -0.3], [0.3, -0.2, 0.1])
    source, normals = source_of(resampled, truth)
    options = {"source_normals": normals, "target_normals": cloud[1]}
    guess = motion([0.03, 0.06, -0.02], [0.004, 0.002, -0.003]) @ truth
    result = nacre.align(source, cloud[0], initial=guess, **options)
    assert result.converged
    assert errors(result.target_from_source, truth)[0] < 0.1
    assert errors(nacre.align(source, cloud[0], **options).target_from_source, truth)[0] > 5


def test_the_rotation_is_a_rotation(cloud: Any) -> None:
    source, normals = source_of(cloud)
    pose = nacre.align(source, cloud[0], source_normals=normals, target_normals=cloud[1]).target_from_source
    assert np.allclose(pose[:3, :3] @ pose[:3, :3].T, np.eye(3), atol=1e-12)
    assert np.linalg.det(pose[:3, :3]) == pytest.approx(1)
    assert (pose[3] == [0, 0, 0, 1]).all()


def test_thirty_degrees_of_the_built_in_object() -> None:
    """
    Twelve views, each registered to the one before from its pose: all within 1 degree.

    Measured: 0.0003 to 0.005 degrees, 0.3 to 2 micrometres.
    """
    thing = nacre.built_in_object()
    camera = nacre.default_camera(thing)
    poses = nacre.turntable_poses(thing)
    views = []
    for pose in poses:
        depth = nacre.preprocess_depth(thing.simulate_depth(camera, pose), camera)
        normals = nacre.depth_normals(depth, camera)[np.isfinite(depth)]
        points = nacre.back_project(depth, camera)
        usable = np.isfinite(normals).all(axis=1)
        views.append((points[usable], normals[usable]))
    for i, (target, target_normals) in enumerate(views):
        j = (i + 1) % len(views)
        truth = np.linalg.inv(poses[i]) @ poses[j]
        result = nacre.align(views[j][0], target, source_normals=views[j][1], target_normals=target_normals)
        angle, shift = errors(result.target_from_source, truth, target.mean(axis=0))
        assert result.converged
        assert angle < 0.05, f"view {j}"
        assert shift < 0.05e-3, f"view {j}"


# Invariances


vectors = st.tuples(*[st.floats(-1, 1)] * 3)


@settings(max_examples=10)
@given(turn=vectors, shift=vectors)
def test_common_motion_of_both_clouds_changes_nothing(turn: Any, shift: Any) -> None:
    target, source = sampled(1200, 4), source_of(sampled(1000, 5))
    common = motion(np.multiply(turn, 3), shift)
    still = nacre.align(source[0], target[0], source_normals=source[1], target_normals=target[1])
    result = nacre.align(
        moved(common, source[0]),
        moved(common, target[0]),
        source_normals=turned(common, source[1]),
        target_normals=turned(common, target[1]),
    )
    expected = common @ still.target_from_source @ np.linalg.inv(common)
    angle, distance = errors(result.target_from_source, expected, moved(common, CENTER[None])[0])
    assert result.status == still.status
    assert angle < 0.02
    assert distance < 0.02e-3


def test_order_of_the_points_does_not_matter(cloud: Any, resampled: Any) -> None:
    source, normals = source_of(resampled)
    still = nacre.align(source, cloud[0], source_normals=normals, target_normals=cloud[1])
    rng = np.random.default_rng(6)
    for _ in range(3):
        p, q = rng.permutation(len(source)), rng.permutation(len(cloud[0]))
        result = nacre.align(source[p], cloud[0][q], source_normals=normals[p], target_normals=cloud[1][q])
        angle, shift = errors(result.target_from_source, still.target_from_source)
        assert angle < 1e-3
        assert shift < 1e-6
        assert result.num_inliers == pytest.approx(still.num_inliers, rel=0.02)


def test_scale_of_the_scene_does_not_matter(cloud: Any, resampled: Any) -> None:
    source, normals = source_of(resampled)
    options = {"source_normals": normals, "target_normals": cloud[1]}
    small = nacre.align(source, cloud[0], **options)
    large = nacre.align(100 * source, 100 * cloud[0], **options)
    expected = small.target_from_source.copy()
    expected[:3, 3] *= 100
    angle, shift = errors(large.target_from_source, expected, 100 * CENTER)
    assert angle < 1e-3
    assert shift < 1e-4
    assert large.rmse == pytest.approx(100 * small.rmse, rel=1e-3)


# Options


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


# What the data knows about the pose


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


def plane(seed: int, count: int = 2500) -> tuple[Array, Array]:
    rng = np.random.default_rng(seed)
    points = np.column_stack([rng.uniform(-0.1, 0.1, (count, 2)), np.full(count, 0.4)])
    return points, np.tile([0.0, 0.0, -1.0], (count, 1))


def sphere(seed: int, count: int = 2500) -> tuple[Array, Array]:
    normals = np.random.default_rng(seed).normal(size=(count, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return CENTER + 0.08 * normals, normals


def cylinder(seed: int, count: int = 2500) -> tuple[Array, Array]:
    rng = np.random.default_rng(seed)
    angle = rng.uniform(0, 2 * np.pi, count)
    normals = np.column_stack([np.cos(angle), np.zeros(count), np.sin(angle)])
    return CENTER + 0.05 * normals + np.outer(rng.uniform(-0.15, 0.15, count), [0, 1, 0]), normals


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


# Data that allows no answer

NOTHING = np.zeros((0, 3))
HOPELESS = {
    "both empty": (NOTHING, NOTHING),
    "empty source": (NOTHING, plane(1)[0]),
    "empty target": (plane(1)[0], NOTHING),
    "single points": (np.zeros((1, 3)), np.zeros((1, 3))),
    "two points": (np.eye(3)[:2], np.eye(3)[:2]),
    "all NaN": (np.full((500, 3), np.nan), plane(1)[0]),
    "target all NaN": (plane(1)[0], np.full((500, 3), np.nan)),
    "inf": (np.full((500, 3), np.inf), plane(1)[0]),
    "far apart": (plane(1)[0], plane(2)[0] + [100.0, 0, 0]),
}


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("case", HOPELESS)
def test_nothing_matched_is_never_converged(case: str, method: Any) -> None:
    source, target = HOPELESS[case]
    first = motion([0.1, 0.2, 0.3], [0.1, 0.2, 0.3])
    first = np.eye(4) if case == "far apart" else first
    result = nacre.align(source, target, initial=first, method=method)
    assert not result.converged
    assert result.status == "too_few_pairs"
    assert result.num_inliers == 0
    assert result.overlap == 0
    assert np.isnan(result.rmse)
    assert np.allclose(result.target_from_source, first, atol=1e-9)
    assert (result.information == 0).all()
    assert "too_few_pairs" in repr(result)


@pytest.mark.parametrize("method", METHODS)
def test_rows_that_are_not_finite_are_ignored(cloud: Any, resampled: Any, method: Any) -> None:
    source, normals = source_of(resampled)
    options = {"method": method, "sample_fraction": 1.0, "coarse_samples": 0, "max_iterations": 100}
    expected = nacre.align(source, cloud[0], source_normals=normals, target_normals=cloud[1], **options)
    holes = np.array([[np.nan, 0, 0], [0, np.inf, 0], [0, 0, -np.inf]])
    result = nacre.align(
        np.concatenate([holes, source]),
        np.concatenate([holes, cloud[0]]),
        source_normals=np.concatenate([np.eye(3), normals]),
        target_normals=np.concatenate([np.eye(3), cloud[1]]),
        **options,
    )
    assert np.isfinite(result.target_from_source).all()
    assert result.num_inliers == pytest.approx(expected.num_inliers, rel=0.02)
    assert np.allclose(result.target_from_source, expected.target_from_source, atol=2e-4)


def test_normals_that_are_not_finite_are_ignored(cloud: Any, resampled: Any) -> None:
    source, normals = source_of(resampled)
    normals[::5] = np.nan
    target_normals = cloud[1].copy()
    target_normals[::7] = np.nan
    result = nacre.align(source, cloud[0], source_normals=normals, target_normals=target_normals)
    assert result.converged
    assert errors(result.target_from_source, TRUTH)[0] < 0.1


@pytest.mark.parametrize("method", METHODS)
def test_identical_clouds_stay(cloud: Any, method: Any) -> None:
    result = nacre.align(cloud[0], cloud[0], source_normals=cloud[1], target_normals=cloud[1], method=method)
    assert result.converged
    assert np.allclose(result.target_from_source, np.eye(4), atol=1e-7)
    assert result.rmse < 1e-9
    assert np.isfinite(result.information).all()


@pytest.mark.parametrize("method", METHODS)
def test_points_on_a_line(method: Any) -> None:
    """No normals exist there; point_to_point finds the line and says that the turn about it is free."""
    line = np.outer(np.linspace(-0.1, 0.1, 400), [1, 2, 2]) / 3 + CENTER
    result = nacre.align(line + np.array([0, 0.0004, -0.0004]), line, method=method, max_iterations=200)
    assert np.isfinite(result.target_from_source).all()
    if method == "point_to_point":
        assert len(result.weak_directions) >= 1
        assert np.linalg.norm(result.target_from_source[:3, :3] - np.eye(3)) < 0.01
    else:
        assert not result.converged
        assert result.num_inliers == 0


def test_points_all_in_one_place() -> None:
    heap = np.zeros((200, 3))
    result = nacre.align(heap, heap, method="point_to_point")
    assert np.isfinite(result.target_from_source).all()
    assert np.allclose(result.target_from_source, np.eye(4))


# Arguments


def test_defaults_are_those_of_the_core() -> None:
    core = _core.AlignOptions()
    parameters = inspect.signature(nacre.align).parameters
    fields = {name for name in dir(core) if not name.startswith("_")}
    assert fields <= set(parameters)
    for name in fields:
        expected = getattr(core, name)
        expected = expected.name if name == "method" else expected
        assert parameters[name].default == expected, name
    data = {f"{cloud}_{name}" for cloud in ("source", "target") for name in ("normals", "sigma", "colors")}
    data |= {"initial"}
    assert set(parameters) - fields == data | {"source", "target"}
    assert all(parameters[name].default is None for name in data)


DTYPES: dict[str, Callable[[Array], Array]] = {
    "float32": lambda a: a.astype(np.float32),
    "longdouble": lambda a: a.astype(np.longdouble),
    "Fortran order": np.asfortranarray,
    "negative strides": lambda a: np.ascontiguousarray(a[::-1])[::-1],
    "every second row": lambda a: np.repeat(a, 2, axis=0)[::2],
    "columns of a wider array": lambda a: np.column_stack([a, a])[:, :3],
    "read only": lambda a: np.frombuffer(a.tobytes()).reshape(a.shape),
    "big endian": lambda a: a.astype(">f8"),
    "a list": lambda a: a.tolist(),
}


@pytest.mark.parametrize("form", DTYPES)
def test_any_real_array_is_taken(cloud: Any, resampled: Any, form: str) -> None:
    source, normals = source_of(resampled)
    cast = DTYPES[form]
    plain = nacre.align(source, cloud[0], source_normals=normals, target_normals=cloud[1])
    result = nacre.align(
        cast(source),
        cast(cloud[0]),
        source_normals=cast(normals),
        target_normals=cast(cloud[1]),
        initial=np.eye(4),
    )
    angle, shift = errors(result.target_from_source, plain.target_from_source)
    assert angle < 1e-3
    assert shift < 1e-6
    assert result.target_from_source.dtype == np.float64


@pytest.mark.parametrize("dtype", [np.int16, np.int64, np.float16])
def test_coarse_dtypes_are_taken(dtype: Any) -> None:
    """Millimetres as integers; half floats."""
    target, target_normals = sampled(2500, 13)
    source, normals = sampled(2000, 14)
    scaled = [
        (1000 * (points - CENTER)).round().astype(dtype)
        for points in (source + np.array([0.003, 0, 0]), target)
    ]
    result = nacre.align(*scaled, source_normals=normals, target_normals=target_normals.astype(np.float16))
    assert result.converged
    assert np.allclose(result.target_from_source[:3, 3], [-3, 0, 0], atol=0.1)


def test_arrays_of_the_caller_stay_as_they_are(cloud: Any, resampled: Any) -> None:
    for dtype in (np.float32, np.float64):
        data = [array.astype(dtype) for array in (*source_of(resampled), *cloud)]
        sigma = np.full(len(data[0]), 0.001, dtype)
        first = np.eye(4)
        before = [array.copy() for array in (*data, sigma, first)]
        nacre.align(
            data[0],
            data[2],
            source_normals=data[1],
            target_normals=data[3],
            source_sigma=sigma,
            initial=first,
        )
        assert all((a == b).all() for a, b in zip(before, (*data, sigma, first), strict=True))


GOOD = plane(15, 200)
ILLEGAL: dict[str, tuple[type[Exception], str, dict[str, Any]]] = {
    "source is flat": (ValueError, r"source.*\(N, 3\).*\(9,\)", {"source": np.zeros(9)}),
    "source has 2 columns": (ValueError, r"source.*\(N, 3\).*\(9, 2\)", {"source": np.zeros((9, 2))}),
    "source of strings": (TypeError, "source.*real", {"source": [["a", "b", "c"]]}),
    "source is complex": (TypeError, "source.*real.*complex", {"source": np.zeros((9, 3), complex)}),
    "source is None": (TypeError, "source", {"source": None}),
    "target has 4 columns": (ValueError, r"target.*\(N, 3\).*\(9, 4\)", {"target": np.zeros((9, 4))}),
    "target of objects": (TypeError, "target", {"target": np.zeros((9, 3), object)}),
    "fewer source normals": (ValueError, "source_normals.*200.*7", {"source_normals": np.zeros((7, 3))}),
    "target normals flat": (ValueError, "target_normals", {"target_normals": np.zeros(200)}),
    "fewer sigma": (ValueError, r"source_sigma.*200.*\(3,\)", {"source_sigma": np.ones(3)}),
    "sigma in columns": (ValueError, "target_sigma", {"target_sigma": np.ones((200, 1))}),
    "initial 3x3": (ValueError, r"initial.*4x4.*\(3, 3\)", {"initial": np.eye(3)}),
    "initial scaled": (ValueError, "initial.*rigid", {"initial": 2 * np.eye(4)}),
    "initial mirrored": (ValueError, "initial.*rigid", {"initial": np.diag([1, 1, -1, 1])}),
    "initial NaN": (ValueError, "initial.*rigid", {"initial": np.full((4, 4), np.nan)}),
    "unknown method": (ValueError, "method.*'point_to_plane'.*'icp'", {"method": "icp"}),
    "no iterations": (ValueError, "max_iterations.*at least 1.*0", {"max_iterations": 0}),
    "half an iteration": (TypeError, "max_iterations.*1.5", {"max_iterations": 1.5}),
    "negative max_distance": (ValueError, "max_distance.*-1", {"max_distance": -1.0}),
    "NaN max_distance": (ValueError, "max_distance.*nan", {"max_distance": float("nan")}),
    "negative final_distance": (ValueError, "final_distance.*-1", {"final_distance": -1.0}),
    "NaN final_distance": (ValueError, "final_distance.*nan", {"final_distance": float("nan")}),
    "gate_decay 0": (ValueError, r"gate_decay.*\(0, 1\].*0", {"gate_decay": 0.0}),
    "gate_decay 2": (ValueError, r"gate_decay.*\(0, 1\].*2", {"gate_decay": 2.0}),
    "max_angle 0": (ValueError, "max_angle.*positive.*0", {"max_angle": 0.0}),
    "NaN max_angle": (ValueError, "max_angle.*nan", {"max_angle": float("nan")}),
    "robust is text": (TypeError, "robust", {"robust": np.zeros(3)}),
    "sample_fraction 0": (ValueError, r"sample_fraction.*\(0, 1\]", {"sample_fraction": 0.0}),
    "sample_fraction 5": (ValueError, r"sample_fraction.*\(0, 1\].*5", {"sample_fraction": 5.0}),
    "negative max_samples": (ValueError, "max_samples.*-1", {"max_samples": -1}),
    "negative coarse_samples": (ValueError, "coarse_samples.*-1", {"coarse_samples": -1}),
    "negative weak_threshold": (ValueError, "weak_threshold.*-1", {"weak_threshold": -1.0}),
    "NaN weak_threshold": (ValueError, "weak_threshold.*nan", {"weak_threshold": float("nan")}),
    "negative threads": (ValueError, "num_threads.*-2", {"num_threads": -2}),
    "seed is text": (TypeError, "seed", {"seed": None}),
}


@pytest.mark.parametrize("case", ILLEGAL)
def test_illegal_argument_is_named(case: str) -> None:
    kind, message, changes = ILLEGAL[case]
    arguments: dict[str, Any] = {"source": GOOD[0], "target": GOOD[0], **changes}
    with pytest.raises(kind, match=message):
        nacre.align(**arguments)


def test_options_are_keywords() -> None:
    with pytest.raises(TypeError):
        nacre.align(GOOD[0], GOOD[0], GOOD[1])  # type: ignore[misc]
    with pytest.raises(TypeError):
        nacre.align(GOOD[0], GOOD[0], radius=0.1)  # type: ignore[call-arg]


def test_result_is_frozen(cloud: Any) -> None:
    result = nacre.align(cloud[0], cloud[0], source_normals=cloud[1], target_normals=cloud[1])
    with pytest.raises(AttributeError):
        result.rmse = 0.0  # type: ignore[misc]
    assert repr(result).startswith("AlignResult(converged, iterations=")
