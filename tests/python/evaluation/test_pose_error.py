"""Errors of poses at the object, and which parts of a surface the cameras saw."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import nacre
from nacre.evaluation import pose_error, sample_surface, seen_samples


def turned(angle: float, center: Any) -> np.ndarray:
    """Return the turn about the z axis through a point."""
    pose = np.eye(4)
    pose[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    pose[:3, 3] = center - pose[:3, :3] @ center
    return pose


class TestPoseError:
    CENTER = np.array([0.3, -0.2, 0.1])

    def poses(self) -> np.ndarray:
        mesh = nacre.built_in_object()
        return nacre.turntable_poses(mesh, 6, 0.5, camera=nacre.default_camera(mesh))

    def test_a_turn_about_the_object_does_not_shift_it(self):
        truth = self.poses()
        estimated = truth.copy()
        estimated[3] = turned(0.01, self.CENTER) @ truth[3]  # shifts the camera, not the centre
        error = pose_error(estimated, truth, center=self.CENTER)
        assert error.rotation_max == pytest.approx(0.01)
        assert error.translation_max < 1e-12
        assert np.linalg.norm((estimated[3] - truth[3])[:3, 3]) > 1e-3
        elsewhere = pose_error(estimated, truth, center=self.CENTER + np.array([1.0, 0, 0]))
        assert elsewhere.translation_max == pytest.approx(2 * np.sin(0.005))

    def test_greatest_and_final_are_of_the_frames(self):
        truth = self.poses()
        estimated = truth.copy()
        estimated[2, :3, 3] += [0.003, 0, 0]
        estimated[5, :3, 3] += [0, 0.001, 0]
        error = pose_error(estimated, truth)
        np.testing.assert_allclose(error.translation_errors, [0, 0, 0.003, 0, 0, 0.001], atol=1e-12)
        assert error.translation_max == pytest.approx(0.003)
        assert error.translation_final == pytest.approx(0.001)
        estimated[5] = np.nan
        lost = pose_error(estimated, truth)
        assert lost.num_compared == 5
        assert lost.translation_final < 1e-12

    def test_the_first_frame_is_in_its_place(self):
        truth = self.poses()
        moved = turned(1.0, np.zeros(3)) @ truth
        assert pose_error(moved, truth, center=self.CENTER).translation_max < 1e-12
        assert pose_error(moved, truth, align=False).rotation_max == pytest.approx(1.0)

    def test_nothing_to_compare_is_nan(self):
        error = pose_error(np.full((2, 4, 4), np.nan), self.poses()[:2])
        assert np.isnan([error.translation_max, error.rotation_final]).all()

    def test_illegal_input_is_named(self):
        truth = self.poses()
        with pytest.raises(ValueError, match="center must be 3 finite numbers"):
            pose_error(truth, truth, center=(0, 0))
        with pytest.raises(ValueError, match="truth must have one pose per pose of estimated"):
            pose_error(truth, truth[:2])
        with pytest.raises(ValueError, match='align must be "first" or False, got True'):
            pose_error(truth, truth, align=True)  # type: ignore[arg-type]


class TestSeenSamples:
    """A cube of side 1 about the origin."""

    CUBE = nacre.Mesh(
        np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)]),
        np.array(
            [
                [0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
                [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3],
            ]
        ),
    )  # fmt: skip

    @pytest.mark.parametrize("kind", ["pinhole", "orthographic"])
    def test_a_camera_before_a_cube_sees_one_face(self, kind):
        camera = nacre.Camera(200, 200, 250.0, 250.0, 99.5, 99.5)
        if kind == "orthographic":
            camera = nacre.Camera.orthographic(width=200, height=200, pixel_size=0.01)
        samples = sample_surface(self.CUBE.vertices, self.CUBE.triangles, 3000)
        pose = np.diag([1.0, -1.0, -1.0, 1.0])  # looks along -z
        pose[2, 3] = 3.0
        seen = seen_samples(self.CUBE, samples, camera, pose[None])
        np.testing.assert_array_equal(seen, samples.normals[:, 2] > 0.5)

    def test_what_is_hidden_outside_or_grazing_is_not_seen(self):
        small = nacre.Mesh(0.2 * self.CUBE.vertices + [0, 0, 1.0], self.CUBE.triangles)
        both = nacre.Mesh(
            np.concatenate([self.CUBE.vertices, small.vertices]),
            np.concatenate([self.CUBE.triangles, small.triangles + 8]),
        )
        camera = nacre.Camera.orthographic(width=60, height=100, pixel_size=0.01)
        samples = sample_surface(both.vertices, both.triangles, 4000)
        pose = np.diag([1.0, -1.0, -1.0, 1.0])
        pose[2, 3] = 3.0
        seen = seen_samples(both, samples, camera, pose[None])
        x, y, z = samples.points.T
        face = (samples.normals[:, 2] > 0.5) & (np.abs(x) < 0.3)
        hidden = (np.abs(x) < 0.1) & (np.abs(y) < 0.1) & (z < 0.9)
        np.testing.assert_array_equal(seen, face & ~hidden)
        assert not seen_samples(both, samples, camera, np.full((1, 4, 4), np.nan)).any()

    def test_illegal_input_is_named(self):
        samples = sample_surface(self.CUBE.vertices, self.CUBE.triangles, 10)
        camera = nacre.Camera.orthographic(width=60, height=100, pixel_size=0.01)
        with pytest.raises(ValueError, match="max_slant must be an angle from 0 to pi / 2, got 4"):
            seen_samples(self.CUBE, samples, camera, np.eye(4)[None], max_slant=4)
