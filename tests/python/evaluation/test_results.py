"""Evaluation: errors that can be worked out by hand."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nacre import evaluation
from nacre.evaluation import (
    absolute_trajectory_error,
    completeness,
    f_score,
    normal_error,
    pose_error,
    relative_pose_error,
    sample_surface,
    surface_accuracy,
    uniformity,
)
from nacre.mesh import Mesh

NAN_POSE = np.full((4, 4), np.nan)


def rotation(axis: Any, angle: float) -> np.ndarray:
    """Rodrigues' formula."""
    x, y, z = np.asarray(axis, dtype=float) / np.linalg.norm(axis)
    skew = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * skew + (1 - np.cos(angle)) * skew @ skew


def pose(axis: Any = (0, 0, 1), angle: float = 0.0, position: Any = (0, 0, 0)) -> np.ndarray:
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = rotation(axis, angle), position
    return matrix


def wandering(count: int, seed: int = 0) -> np.ndarray:
    random = np.random.default_rng(seed)
    return np.stack(
        [pose(random.normal(size=3), random.uniform(0, 3), random.normal(size=3)) for _ in range(count)]
    )


def plane_mesh(side: float = 1.0) -> Mesh:
    """A square in z = 0 whose normal is +z."""
    corners = np.array([[0, 0, 0], [side, 0, 0], [side, side, 0], [0, side, 0]], dtype=float)
    return Mesh(corners, np.array([[0, 1, 2], [0, 2, 3]]))


def on_sphere(count: int, seed: int = 0) -> np.ndarray:
    points = np.random.default_rng(seed).normal(size=(count, 3))
    return np.asarray(points / np.linalg.norm(points, axis=1, keepdims=True))


class TestAbsoluteTrajectoryError:
    @settings(max_examples=25, deadline=None)
    @given(seed=st.integers(0, 1000), angle=st.floats(-3, 3), shift=st.floats(-1e3, 1e3))
    def test_a_moved_trajectory_has_no_error_after_alignment(
        self, seed: int, angle: float, shift: float
    ) -> None:
        truth = wandering(8, seed)
        moved = pose((1, 2, 3), angle, (shift, -2, 5)) @ truth
        error = absolute_trajectory_error(moved, truth)
        assert error.rmse < 1e-9 * (1 + abs(shift))
        assert error.rotation_max < 1e-8
        np.testing.assert_allclose(error.truth_from_estimated @ moved, truth, atol=1e-9 * (1 + abs(shift)))

    def test_errors_without_alignment_are_the_distances(self) -> None:
        truth = np.stack([pose(position=(i, 0, 0)) for i in range(4)])
        estimated = truth.copy()
        estimated[:, 1, 3] = [0, 0.3, -0.4, 0]
        error = absolute_trajectory_error(estimated, truth, align=False)
        np.testing.assert_allclose(error.errors, [0, 0.3, 0.4, 0], atol=1e-15)
        assert error.rmse == pytest.approx(0.25)
        assert error.mean == pytest.approx(0.175)
        assert error.median == pytest.approx(0.15)
        assert error.max == pytest.approx(0.4)
        np.testing.assert_array_equal(error.truth_from_estimated, np.eye(4))

    def test_alignment_to_the_first_pose_keeps_it_exact(self) -> None:
        truth = wandering(5)
        estimated = pose((0, 1, 0), 0.5, (1, 2, 3)) @ truth
        estimated[3, :3, 3] += [0, 0, 0.5]
        error = absolute_trajectory_error(estimated, truth, align="first")
        np.testing.assert_allclose(error.errors, [0, 0, 0, 0.5, 0], atol=1e-12)

    def test_rotation_error_is_the_angle(self) -> None:
        truth = wandering(6)
        estimated = truth.copy()
        estimated[2, :3, :3] = estimated[2, :3, :3] @ rotation((1, 1, 0), 0.02)
        estimated[4, :3, :3] = estimated[4, :3, :3] @ rotation((0, 1, 0), 3.1)
        error = absolute_trajectory_error(estimated, truth)
        np.testing.assert_allclose(error.rotation_errors, [0, 0, 0.02, 0, 3.1, 0], atol=1e-8)
        assert error.rmse < 1e-9

    def test_the_alignment_is_the_best_rigid_one(self) -> None:
        random = np.random.default_rng(3)
        truth = wandering(30, 1)
        estimated = pose((1, 0, 2), 1.0, (3, 2, 1)) @ truth
        estimated[:, :3, 3] += random.normal(0, 0.05, (30, 3))
        best = absolute_trajectory_error(estimated, truth)
        for _ in range(50):
            nudge = pose(random.normal(size=3), 1e-3 * random.normal(), 1e-3 * random.normal(size=3))
            other = nudge @ best.truth_from_estimated @ estimated
            assert absolute_trajectory_error(other, truth, align=False).rmse >= best.rmse

    def test_a_path_too_short_to_turn_by_leaves_no_error_of_rotation(self) -> None:
        random = np.random.default_rng(3)
        truth = np.tile(np.eye(4), (50, 1, 1))
        for pose, angle in zip(truth, np.linspace(-0.7, 0.7, 50), strict=True):
            pose[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
        truth[:, :3, 3] = random.normal(scale=0.01, size=(50, 3))
        estimated = truth.copy()
        estimated[:, :3, 3] = random.normal(scale=0.01, size=(50, 3))  # nothing of the positions is right
        error = absolute_trajectory_error(estimated, truth)
        assert error.rotation_max < 1e-6
        assert np.trace(error.truth_from_estimated[:3, :3]) < 2.9  # the positions ask for 18 degrees and more

    def test_a_mirrored_trajectory_is_not_made_to_fit(self) -> None:
        truth = wandering(10)
        estimated = truth.copy()
        estimated[:, 0, 3] *= -1
        error = absolute_trajectory_error(estimated, truth)
        assert np.linalg.det(error.truth_from_estimated[:3, :3]) == pytest.approx(1)
        assert error.rmse > 0.1

    def test_orientations_decide_what_positions_leave_open(self) -> None:
        line = np.stack([pose((0, 1, 0), 0.1 * i, (i, 0, 0)) for i in range(5)])
        for truth in (line, line[:3], np.tile(pose((1, 0, 0), 0.3), (3, 1, 1))):
            error = absolute_trajectory_error(pose((1, 2, 3), 1.2, (4, 5, 6)) @ truth, truth)
            assert error.rmse < 1e-9
            assert error.rotation_max < 1e-6

    @pytest.mark.parametrize("number", [1, 2])
    def test_fewer_than_three_aligned_poses_say_nothing(self, number: int) -> None:
        truth = wandering(48)
        estimated = np.full_like(truth, np.nan)
        estimated[:number] = truth[20 : 20 + number]
        error = absolute_trajectory_error(estimated, truth)
        assert np.isnan([error.rmse, error.max, error.rotation_rmse, *error.errors]).all()
        assert (error.num_compared, error.num_frames) == (number, 48)
        assert absolute_trajectory_error(estimated, truth, align=False).rmse > 0

    def test_lost_frames_lower_the_coverage_only(self) -> None:
        truth = wandering(10)
        estimated = truth.copy()
        estimated[3] = NAN_POSE
        estimated[7, :3, 3] += 100
        valid = np.ones(10, dtype=bool)
        valid[7] = False
        unknown = truth.copy()
        unknown[1] = NAN_POSE
        error = absolute_trajectory_error(estimated, unknown, valid=valid)
        assert (error.num_frames, error.num_tracked, error.num_compared) == (10, 8, 7)
        assert error.coverage == 0.8
        assert error.rmse < 1e-9
        assert np.flatnonzero(np.isnan(error.errors)).tolist() == [1, 3, 7]
        assert absolute_trajectory_error(estimated, truth, valid=valid, num_frames=16).coverage == 0.5

    def test_time_stamps_pair_the_poses(self) -> None:
        truth = np.stack([pose(position=(0.1 * i, 0, 0)) for i in range(100)])
        times = 1e9 + 0.01 * np.arange(100)
        rows = [0, 30, 60, 99]
        error = absolute_trajectory_error(
            np.concatenate([truth[rows], truth[:1]]),
            truth,
            timestamps=np.append(times[rows] + 0.004, 2e9),
            truth_timestamps=times,
            align=False,
        )
        assert error.num_compared == 4
        assert error.rmse == 0

    def test_nothing_to_compare_gives_nan_not_zero(self) -> None:
        truth = wandering(3)
        for estimated, reference in (
            (np.tile(NAN_POSE, (3, 1, 1)), truth),
            (truth, np.tile(NAN_POSE, (3, 1, 1))),
        ):
            error = absolute_trajectory_error(estimated, reference)
            assert np.isnan(error.rmse)
            assert error.num_compared == 0
        assert np.isnan(absolute_trajectory_error(np.zeros((0, 4, 4)), np.zeros((0, 4, 4))).coverage)

    @pytest.mark.parametrize(
        ("arguments", "options", "message"),
        [
            ((np.eye(4), np.eye(4)), {}, r"estimated must have shape \(N, 4, 4\)"),
            ((wandering(2), wandering(3)), {}, "truth must have one pose per pose"),
            ((2 * wandering(2), wandering(2)), {}, r"estimated\[0\] must be a rigid transform"),
            ((wandering(2), wandering(2)), {"align": "horn"}, "align must be"),
            ((wandering(2), wandering(2)), {"valid": [True]}, "valid must have one entry"),
            (
                (wandering(2), wandering(2)),
                {"timestamps": [0], "truth_timestamps": [0, 1]},
                "timestamps must have one",
            ),
            ((wandering(2), wandering(2)), {"truth_timestamps": [0, 1]}, "timestamps must be given"),
            ((wandering(2), wandering(2)), {"num_frames": 1}, "num_frames must be at least"),
        ],
    )
    def test_illegal_input_is_named(self, arguments: Any, options: Any, message: str) -> None:
        with pytest.raises(ValueError, match=message):
            absolute_trajectory_error(*arguments, **options)

    def test_text_is_not_a_pose(self) -> None:
        with pytest.raises(TypeError, match="estimated must be an array of real numbers"):
            absolute_trajectory_error([["a"]], wandering(1))


class TestRelativePoseError:
    def test_a_constant_drift_is_found(self) -> None:
        truth = np.stack([pose((0, 1, 0), 0.1 * i, (i, 0, 0)) for i in range(10)])
        drift = pose((0, 0, 1), 0.01, (0.002, 0, 0))
        estimated = [truth[0]]
        for i in range(9):
            estimated.append(estimated[-1] @ np.linalg.inv(truth[i]) @ truth[i + 1] @ drift)
        error = relative_pose_error(pose((1, 1, 1), 2, (7, 8, 9)) @ np.stack(estimated), truth)
        assert error.num_pairs == 9
        assert error.translation_rmse == pytest.approx(0.002, rel=1e-9)
        assert error.rotation_rmse == pytest.approx(0.01, rel=1e-9)
        assert error.rotation_max == pytest.approx(0.01, rel=1e-9)

    def test_pairs_with_a_lost_frame_do_not_count(self) -> None:
        truth = wandering(10)
        estimated = truth.copy()
        estimated[4] = NAN_POSE
        assert relative_pose_error(estimated, truth, delta=1).num_pairs == 7
        assert relative_pose_error(estimated, truth, delta=3).num_pairs == 5
        nothing = relative_pose_error(estimated, truth, delta=10)
        assert nothing.num_pairs == 0
        assert np.isnan(nothing.translation_rmse)

    def test_an_interval_in_seconds(self) -> None:
        times = np.array([0, 0.5, 1.0, 1.5, 3.0])
        truth = np.stack([pose(position=(t, 0, 0)) for t in times])
        estimated = truth.copy()
        estimated[:, 0, 3] *= 1.1
        error = relative_pose_error(
            estimated, truth, delta=1.0, unit="seconds", timestamps=times, truth_timestamps=times
        )
        assert error.num_pairs == 2
        assert error.translation_rmse == pytest.approx(0.1)

    @pytest.mark.parametrize(
        ("options", "message"),
        [
            ({"delta": 0}, "delta must be a positive"),
            ({"delta": 1.5}, "delta must be a positive"),
            ({"delta": np.nan}, "delta must be a positive"),
            ({"unit": "minutes"}, "unit must be"),
            ({"unit": "seconds"}, "timestamps must be given"),
        ],
    )
    def test_illegal_input_is_named(self, options: Any, message: str) -> None:
        with pytest.raises(ValueError, match=message):
            relative_pose_error(wandering(3), wandering(3), **options)


class TestSampleSurface:
    def test_samples_lie_on_their_triangles_and_follow_the_area(self) -> None:
        vertices = np.array([[0, 0, 0], [3, 0, 0], [0, 1, 0], [0, 0, 1.0]])
        triangles = np.array([[0, 1, 2], [0, 2, 3], [0, 0, 1]])
        samples = sample_surface(vertices, triangles, 20_000, seed=4)
        counts = np.bincount(samples.triangles, minlength=3)
        assert abs(counts[0] - 15_000) <= 1
        assert counts[2] == 0
        first = samples.points[samples.triangles == 0]
        np.testing.assert_array_equal(first[:, 2], 0)
        assert (first[:, 0] / 3 + first[:, 1] <= 1 + 1e-12).all()
        np.testing.assert_allclose(first.mean(axis=0), [1, 1 / 3, 0], atol=0.02)
        np.testing.assert_array_equal(
            samples.normals[samples.triangles == 0], np.tile([0, 0, 1.0], (len(first), 1))
        )

    def test_the_seed_decides(self) -> None:
        mesh = plane_mesh()
        first, again, other = (sample_surface(mesh.vertices, mesh.triangles, 50, seed=s) for s in (1, 1, 2))
        np.testing.assert_array_equal(first.points, again.points)
        assert (first.points != other.points).any()

    @pytest.mark.parametrize(
        ("triangles", "count", "message"),
        [
            ([[0, 1, 9]], 5, "name rows of vertices"),
            ([[0, 1, -1]], 5, "name rows of vertices"),
            ([[0, 1, 1]], 5, "an area"),
            (np.zeros((0, 3), int), 5, "an area"),
            ([[0.0, 1.0, 2.0]], 5, "whole numbers"),
            ([[0, 1, 2]], 0, "num_samples"),
        ],
    )
    def test_illegal_input_is_named(self, triangles: Any, count: int, message: str) -> None:
        with pytest.raises(ValueError, match=message):
            sample_surface(np.eye(3), triangles, count)


class TestSurfaceAccuracy:
    def test_points_above_and_below_a_plane(self) -> None:
        points = np.array(
            [[0.5, 0.5, 0.02], [0.3, 0.6, -0.01], [0.2, 0.2, 0.0], [np.nan, 0, 0], [0.6, 0.1, 0.03]]
        )
        result = surface_accuracy(points, plane_mesh())
        np.testing.assert_allclose(result.distances, [0.02, 0.01, 0, np.nan, 0.03], atol=1e-7)
        assert result.num_points == 4
        assert result.rms == pytest.approx(np.sqrt(14e-4 / 4), rel=1e-5)
        assert result.mean == pytest.approx(0.015, rel=1e-5)
        assert result.median == pytest.approx(0.015, rel=1e-5)
        assert result.max == pytest.approx(0.03, rel=1e-5)
        assert result.bias == pytest.approx(0.01, rel=1e-5)

    def test_noise_of_known_sigma(self) -> None:
        random = np.random.default_rng(7)
        points = np.column_stack(
            [random.uniform(0.1, 0.9, (20_000, 2)), random.normal(0.0005, 0.002, 20_000)]
        )
        result = surface_accuracy(points, plane_mesh())
        assert result.rms == pytest.approx(np.hypot(0.002, 0.0005), rel=0.02)
        assert result.bias == pytest.approx(0.0005, abs=5e-5)

    def test_a_cloud_with_normals_does_not_show_its_own_spacing(self) -> None:
        reference = on_sphere(40_000)
        points = 0.97 * on_sphere(3_000, seed=1)
        with_normals = surface_accuracy(points, reference, reference_normals=reference)
        assert with_normals.rms == pytest.approx(0.03, rel=0.01)
        assert with_normals.bias == pytest.approx(-0.03, rel=0.01)
        alone = surface_accuracy(points, reference)
        assert alone.rms > with_normals.rms
        assert np.isnan(alone.bias)

    def test_a_cloud_without_normals_is_a_set_of_points(self) -> None:
        result = surface_accuracy([[0, 0, 0.3], [1, 0.4, 0]], [[0, 0, 0], [1.0, 0, 0], [np.inf, 0, 0]])
        np.testing.assert_allclose(result.distances, [0.3, 0.4])

    def test_disks_end(self) -> None:
        grid = np.stack(np.meshgrid(np.arange(10.0), np.arange(10.0), [0.0]), -1).reshape(-1, 3)
        normals = np.tile([0, 0, 1.0], (100, 1))
        result = surface_accuracy([[4.5, 4.5, 2.0], [109.0, 4.0, 0.0]], grid, reference_normals=normals)
        np.testing.assert_allclose(result.distances, [2.0, 97.0])

    def test_no_points_give_nan(self) -> None:
        result = surface_accuracy(np.zeros((0, 3)), plane_mesh())
        assert np.isnan(result.rms)
        assert result.num_points == 0

    @pytest.mark.parametrize(
        ("arguments", "options", "message"),
        [
            ((np.zeros(3), plane_mesh()), {}, "points must have shape"),
            (
                (np.zeros((1, 3)), plane_mesh()),
                {"reference_normals": np.zeros((4, 3))},
                "must not be given for a mesh",
            ),
            ((np.zeros((1, 3)), np.zeros((0, 3))), {}, "reference must have at least one"),
            (
                (np.zeros((1, 3)), np.zeros((2, 3))),
                {"reference_normals": np.zeros((1, 3))},
                "reference_normals must",
            ),
        ],
    )
    def test_illegal_input_is_named(self, arguments: Any, options: Any, message: str) -> None:
        with pytest.raises(ValueError, match=message):
            surface_accuracy(*arguments, **options)


class TestCompleteness:
    def test_half_of_a_plane(self) -> None:
        grid = np.stack(np.meshgrid(np.linspace(0, 0.5, 101), np.linspace(0, 1, 201), [0.0]), -1).reshape(
            -1, 3
        )
        result = completeness(grid, plane_mesh(), tau=(0.005, 0.1), num_samples=40_000)
        assert result.fraction[0] == pytest.approx(0.505, abs=0.003)
        assert result.fraction[1] == pytest.approx(0.6, abs=0.003)
        assert result.p99 == pytest.approx(0.49, abs=0.01)
        assert result.num_samples == 40_000

    def test_only_seen_samples_count(self) -> None:
        mesh = plane_mesh()
        samples = sample_surface(mesh.vertices, mesh.triangles, 2000).points
        model = samples[samples[:, 0] < 0.5]
        seen = samples[:, 0] < 0.5
        by_mesh = completeness(model, mesh, tau=1e-6, seen=seen, num_samples=2000)
        by_samples = completeness(model, samples, tau=1e-6, seen=seen)
        assert by_mesh == by_samples
        assert by_mesh.fraction == (1.0,)
        assert by_mesh.num_samples == seen.sum()

    def test_an_empty_model_covers_nothing(self) -> None:
        result = completeness(np.full((2, 3), np.nan), plane_mesh(), tau=0.1, num_samples=10)
        assert result.fraction == (0.0,)
        assert result.mean == np.inf

    def test_nothing_seen_gives_nan(self) -> None:
        result = completeness(np.zeros((1, 3)), np.zeros((2, 3)), tau=0.1, seen=[False, False])
        assert np.isnan(result.fraction[0])

    @pytest.mark.parametrize(
        ("options", "message"),
        [
            ({"tau": 0.0}, "tau must be"),
            ({"tau": ()}, "tau must be"),
            ({"tau": (0.1, np.nan)}, "tau must be"),
            ({"seen": [True]}, "seen must have one entry"),
        ],
    )
    def test_illegal_input_is_named(self, options: Any, message: str) -> None:
        with pytest.raises(ValueError, match=message):
            completeness(np.zeros((1, 3)), plane_mesh(), **options)


class TestFScore:
    def test_by_hand(self) -> None:
        reference = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [3, 0, 0.0]])
        model = np.array([[0, 0, 0.05], [1, 0, 0.05], [1, 0, 5.0]])
        result = f_score(model, reference, tau=(0.01, 0.1))
        assert result.precision == (0.0, pytest.approx(2 / 3))
        assert result.recall == (0.0, 0.5)
        assert result.f_score == (0.0, pytest.approx(2 * (2 / 3) * 0.5 / (2 / 3 + 0.5)))

    def test_an_empty_model_scores_nothing(self) -> None:
        assert f_score(np.zeros((0, 3)), plane_mesh(), tau=0.1, num_samples=10).f_score == (0.0,)


class TestUniformity:
    def test_a_lattice(self) -> None:
        grid = 0.01 * np.stack(np.meshgrid(*[np.arange(8.0)] * 3), -1).reshape(-1, 3)
        result = uniformity(np.concatenate([grid, [[np.nan, 0, 0]]]))
        assert result.mean == pytest.approx(0.01)
        assert result.coefficient_of_variation < 1e-9
        assert result.duplicates == 0
        assert result.num_points == 512

    def test_a_poisson_process(self) -> None:
        result = uniformity(on_sphere(40_000))
        assert result.coefficient_of_variation == pytest.approx(np.sqrt(4 / np.pi - 1), abs=0.01)
        assert result.mean == pytest.approx(0.5 * np.sqrt(4 * np.pi / 40_000), rel=0.02)

    def test_duplicates(self) -> None:
        grid = np.stack(np.meshgrid(np.arange(10.0), np.arange(10.0), [0.0]), -1).reshape(-1, 3)
        result = uniformity(np.concatenate([grid, grid[:10]]))
        assert result.duplicates == pytest.approx(20 / 110)
        assert uniformity(np.ones((5, 3))).duplicates == 1

    def test_too_few_points_give_nan(self) -> None:
        for points in (np.zeros((0, 3)), np.zeros((1, 3))):
            assert np.isnan(uniformity(points).mean)

    def test_illegal_input_is_named(self) -> None:
        with pytest.raises(ValueError, match="points must have shape"):
            uniformity(np.zeros((3, 2)))


class TestNormalError:
    def test_known_angles(self) -> None:
        reference = np.tile([0, 0, 2.0], (4, 1))
        angles = np.array([0, 0.1, np.pi - 0.2, 1.0])
        normals = 3 * np.column_stack([np.sin(angles), 0 * angles, np.cos(angles)])
        result = normal_error(normals, reference)
        assert result.mean == pytest.approx(angles.mean())
        assert result.unoriented_mean == pytest.approx((0 + 0.1 + 0.2 + 1.0) / 4)
        assert result.flipped == 0.25
        assert result.beyond_30_degrees == 0.25
        assert result.unoriented_p95 == pytest.approx(np.percentile([0, 0.1, 0.2, 1.0], 95))

    def test_small_angles_keep_their_digits(self) -> None:
        assert normal_error([[1e-9, 0, 1]], [[0, 0, 1]]).mean == pytest.approx(1e-9)

    def test_rows_without_a_normal_are_left_out(self) -> None:
        result = normal_error([[0, 0, 1], [np.nan, 0, 0], [0, 0, 0]], np.tile([0, 0, 1.0], (3, 1)))
        assert result.num_normals == 1
        assert result.mean == 0
        assert np.isnan(normal_error(np.zeros((0, 3)), np.zeros((0, 3))).mean)

    def test_illegal_input_is_named(self) -> None:
        with pytest.raises(ValueError, match="reference_normals must have one row"):
            normal_error(np.zeros((2, 3)), np.zeros((3, 3)))


def test_every_result_is_frozen_and_fits_into_json() -> None:
    truth = wandering(3)
    estimated = truth.copy()
    estimated[1] = NAN_POSE
    results = [
        absolute_trajectory_error(estimated, truth),
        pose_error(estimated, truth),
        relative_pose_error(estimated, truth),
        surface_accuracy([[0, 0, 1.0], [np.nan, 0, 0]], plane_mesh()),
        completeness(np.zeros((0, 3)), plane_mesh(), num_samples=10),
        f_score([[0, 0, 1.0]], plane_mesh(), num_samples=10),
        uniformity([[0, 0, 1.0]]),
        normal_error([[0, 0, 1.0]], [[0, 0, 1.0]]),
    ]
    assert {type(result).__name__ for result in results} == {
        name for name in evaluation.__all__ if name[0].isupper() and name != "SurfaceSamples"
    }
    for result in results:
        told = json.loads(json.dumps(result.as_dict(), allow_nan=False))
        assert list(told) == list(result.units())
        with pytest.raises(AttributeError):
            result.extra = 1  # type: ignore[attr-defined]
    assert results[0].as_dict()["errors"][1] is None
