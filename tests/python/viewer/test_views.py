"""The first view, and which frames saw what."""

from __future__ import annotations

import math
import sys
from pathlib import Path

import numpy as np
import pytest

import nacre
from nacre.report import ReportedFrame
from nacre.viewer import Snapshot, Timeline
from nacre.viewer.views import first_seen, first_view, sees

sys.path.insert(0, str(Path(__file__).parents[1]))
from viewer_scenes import CAMERA, plane, two_looks


def ball(center: tuple[float, float, float], radius: float, count: int) -> tuple[np.ndarray, np.ndarray]:
    directions = np.random.default_rng(0).normal(size=(count, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    return center + radius * directions, directions


def test_a_camera_sees_what_is_in_its_image_and_faces_it() -> None:
    cloud = plane()
    aside = np.eye(4)
    aside[0, 3] = 0.5 + 0.045  # the plane's right end is at the image's left border
    poses = [np.eye(4), aside, np.diag([1.0, -1, -1, 1])]  # the last looks away
    assert [sees(CAMERA, pose, cloud.points, cloud.normals).sum() for pose in poses] == [441, 6 * 21, 0]
    assert not sees(CAMERA, np.eye(4), cloud.points, -cloud.normals).any()


def test_points_come_with_the_first_frame_that_saw_them() -> None:
    cloud = plane()
    first = first_seen(cloud, two_looks(cloud), 1)
    assert first is not None
    np.testing.assert_array_equal(first, np.where(cloud.points[:, 0] < -0.0451, 0, 1))


def test_without_cameras_nothing_grows() -> None:
    timeline = Timeline("points", None)
    timeline.add(ReportedFrame(0, "TRACKED", world_from_camera=np.eye(4)))
    assert first_seen(plane(), timeline, 0) is None


def test_the_view_is_of_the_ball_that_all_frames_saw_and_not_of_far_specks() -> None:
    near, near_normals = ball((0.3, 0, 1), 0.1, 2000)
    far, far_normals = ball((0, 0, 9), 5, 500)
    cloud = Snapshot(
        np.concatenate([near, far]).astype(np.float32),
        np.concatenate([near_normals, far_normals]).astype(np.float32),
        0.005,
        confidence=np.r_[np.full(2000, 20.0), np.ones(500)].astype(np.float32),
    )
    timeline = Timeline("ball", nacre.Camera(64, 48, 50, 50, 31.5, 23.5))
    for index in range(10):
        pose = np.eye(4)
        pose[0, 3] = 0.3 + 0.01 * (index - 5)
        timeline.add(ReportedFrame(index, "TRACKED", world_from_camera=pose))
    view = first_view(cloud, timeline, 9)
    assert np.linalg.norm(view.target - (0.3, 0, 1)) < 0.12
    assert math.degrees(math.acos(view.direction @ (0, 0, -1))) < 15
    np.testing.assert_allclose(view.up, (0, -1, 0), atol=1e-9)
    assert 0.08 < view.radius < 0.25


def test_a_model_without_frames_is_seen_from_the_world_s_camera() -> None:
    view = first_view(plane(), Timeline("plane", None), -1)
    np.testing.assert_allclose(view.direction, (0, 0, -1), atol=1e-6)
    np.testing.assert_allclose(view.up, (0, -1, 0), atol=1e-6)
    assert np.linalg.norm(view.target - (0, 0, 1)) < 0.05
    upright = first_view(plane(), Timeline("plane", None, is_upright=True), -1)
    np.testing.assert_allclose([upright.direction, upright.up], -np.array([view.direction, view.up]))


def test_a_camera_that_looks_along_up_still_has_an_up() -> None:
    timeline = Timeline("plane", CAMERA)
    for pose in (np.eye(4), np.diag([1.0, -1, -1, 1])):  # their up directions cancel
        timeline.add(ReportedFrame(0, "TRACKED", world_from_camera=pose))
    view = first_view(plane(), timeline, 1)
    assert abs(view.up @ view.direction) < 0.98
    assert np.linalg.norm(view.up) == pytest.approx(1)
