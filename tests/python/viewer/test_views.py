"""The first view, and which frames saw what."""

from __future__ import annotations

import math
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import nacre
from nacre.report import ReportedFrame
from nacre.viewer import Snapshot, Timeline
from nacre.viewer.view import View
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


def test_a_model_that_faces_the_world_s_camera_is_seen_from_there() -> None:
    view = first_view(plane(), Timeline("plane", None), -1)
    np.testing.assert_allclose(view.direction, (0, 0, -1), atol=1e-6)
    np.testing.assert_allclose(view.up, (0, -1, 0), atol=1e-6)
    assert np.linalg.norm(view.target - (0, 0, 1)) < 0.05
    turned = replace(plane(), points=plane().points * (1, -1, -1), normals=plane().normals * (1, -1, -1))
    upright = first_view(turned, Timeline("plane", None, is_upright=True), -1)
    np.testing.assert_allclose([upright.direction, upright.up], -np.array([view.direction, view.up]))


def sheet(normal: tuple[float, float, float]) -> Snapshot:
    """Return two triangles, a unit square about (0, 0, 1) that faces a direction."""
    facing = np.array(normal) / np.linalg.norm(normal)
    right = np.cross(facing, (0.3, 0.5, 0.8))
    right /= np.linalg.norm(right)
    above = np.cross(facing, right)
    corners = [[0, 0, 1] + 0.5 * (x * right + y * above) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    points, triangles = np.array(corners, np.float32), np.array([[0, 1, 2], [0, 2, 3]], np.int32)
    return Snapshot(
        points, np.broadcast_to(facing, points.shape).astype(np.float32), 1.0, triangles=triangles
    )


def seen_from(cloud: Snapshot, *, is_upright: bool = False) -> tuple[float, float]:
    """Return from where a model without cameras is seen: degrees to the left of the usual, and above it."""
    view = first_view(cloud, Timeline("sheet", None, is_upright=is_upright), -1)
    x, y, z = view.direction if is_upright else view.direction * (1, -1, -1)
    assert np.linalg.norm(view.direction) == pytest.approx(1)
    np.testing.assert_allclose(view.up, (0, 1 if is_upright else -1, 0))
    return math.degrees(math.atan2(-x, z)), math.degrees(math.asin(y))


@pytest.mark.parametrize(
    ("facing", "sideways", "above"),
    [
        ((0.0, 0, -1), 0, 0),  # the camera of the world
        ((0.2, 0, -1), 0, 0),  # nearly
        ((-0.9, 0, -0.1), 83.66, 15),  # a shelf at the side: from its front, raised a little
        ((1.0, 0, 1), -135, 15),  # its back to the camera
        ((0.0, -0.9, -0.9), 0, 45),  # a table, and a wall behind it
        ((0.0, -1, 0), 0, 60),  # a floor
        ((0.0, 1, 0), 0, -60),  # a ceiling
        ((-1.0, 0.3, 0), 90, 15),  # leans over
    ],
)
def test_without_cameras_a_surface_is_seen_from_where_it_faces(
    facing: tuple[float, float, float], sideways: float, above: float
) -> None:
    cloud = sheet(facing)
    points_alone = replace(cloud, triangles=None)
    for shown in (cloud, points_alone):
        assert seen_from(shown) == pytest.approx((sideways, above), abs=0.01)
    turned = sheet((facing[0], -facing[1], -facing[2]))  # y up and z to who looks
    assert seen_from(turned, is_upright=True) == pytest.approx((sideways, above), abs=0.01)


def test_triangles_tell_by_their_area_where_a_mesh_faces() -> None:
    small, large = sheet((0, 0, -1)), sheet((1, 0, 0))
    mesh = Snapshot(
        np.concatenate([0.2 * small.points, large.points]),
        np.concatenate([small.normals, small.normals]),  # of the vertices: they have no say
        1.0,
        triangles=np.concatenate([small.triangles, large.triangles + 4]),
    )
    sideways, above = seen_from(mesh)
    assert (sideways, above) == pytest.approx((-90, 15), abs=3)


def test_a_closed_surface_faces_nowhere_and_holes_do_not_turn_it() -> None:
    points, normals = ball((0, 0, 1), 0.1, 4000)
    closed = Snapshot(points.astype(np.float32), normals.astype(np.float32), 0.005)
    assert seen_from(closed) == (0, 0)
    with_hole = normals @ (1, 0, 0) < 0.95  # 1 / 40 of a ball
    assert seen_from(Snapshot(closed.points[with_hole], closed.normals[with_hole], 0.005)) == (0, 0)
    half = normals @ (1, 0, 0) < 0
    assert seen_from(Snapshot(closed.points[half], closed.normals[half], 0.005)) == pytest.approx(
        (90, 15), abs=3
    )


def test_a_mesh_of_no_area_is_seen_as_ever() -> None:
    for triangles in (np.zeros((0, 3), np.int32), np.zeros((5, 3), np.int32)):
        assert seen_from(replace(sheet((1, 0, 0)), triangles=triangles)) == (0, 0)


def flat(depth: float) -> Snapshot:
    """Return a wall 6 m wide and 1 m high, and a floor before it, so deep."""
    x = np.linspace(-3, 3, 121)
    wall = [(a, b, 0) for a in x for b in np.linspace(0, 1, 21)]
    floor = [(a, 1, -b) for a in x for b in np.linspace(0, depth, int(depth / 0.05) + 1)]
    normals = np.repeat([[0, 0, -1], [0, -1, 0]], [len(wall), len(floor)], axis=0).astype(np.float32)
    return Snapshot(np.array(wall + floor, np.float32), normals, 0.05)


def elevation(view: View) -> float:
    """Return how far above the level the eye is [degrees]; up is that of the world's camera."""
    return math.degrees(math.asin(-view.direction[1]))


@pytest.mark.parametrize(("depth", "above"), [(5.0, 45), (0.1, 0)])
def test_what_no_frame_had_as_a_whole_is_no_sliver(depth: float, above: float) -> None:
    cloud = flat(depth)
    timeline = Timeline("flat", nacre.Camera(64, 48, 50, 50, 31.5, 23.5))
    for index, x in enumerate(np.linspace(-2.5, 2.5, 9)):
        pose = np.eye(4)
        pose[:3, 3] = x, 0.5, -1
        timeline.add(ReportedFrame(index, "TRACKED", world_from_camera=pose))
    view = first_view(cloud, timeline, 8)
    assert elevation(view) == pytest.approx(above, abs=10)
    without_cameras = first_view(
        replace(cloud, normals=np.zeros_like(cloud.normals)), Timeline("flat", None), -1
    )
    assert elevation(without_cameras) == pytest.approx(above, abs=10)


def test_what_a_frame_had_as_a_whole_is_seen_from_there() -> None:
    timeline = Timeline("flat", nacre.Camera(64, 48, 20, 20, 31.5, 23.5))
    for index in range(2):
        pose = np.eye(4)
        pose[:3, 3] = 0.1 * index, 0.5, -9
        timeline.add(ReportedFrame(index, "TRACKED", world_from_camera=pose))
    assert elevation(first_view(flat(5.0), timeline, 1)) == pytest.approx(0, abs=10)


def test_a_camera_that_looks_along_up_still_has_an_up() -> None:
    timeline = Timeline("plane", CAMERA)
    for pose in (np.eye(4), np.diag([1.0, -1, -1, 1])):  # their up directions cancel
        timeline.add(ReportedFrame(0, "TRACKED", world_from_camera=pose))
    view = first_view(plane(), timeline, 1)
    assert abs(view.up @ view.direction) < 0.98
    assert np.linalg.norm(view.up) == pytest.approx(1)


def test_a_file_says_from_where_to_look_at_it() -> None:
    told = View(np.array([1e-4, -0.2, 1.25]), np.array([0.6, 0, -0.8]), np.array([0, -1.0, 0]), 0.3)
    read = View.of_comments(["metres", told.as_comment()])
    assert read is not None
    for expected, value in zip(told, read, strict=True):
        np.testing.assert_allclose(value, expected, atol=1e-6)
    timeline = Timeline("plane", None)
    timeline.view = read._replace(target=np.array([0, 0, 1.0]))
    assert first_view(plane(), timeline, -1) is timeline.view
    timeline.view = read._replace(target=np.array([9.0, 0, 1]))  # the points were moved since
    np.testing.assert_allclose(first_view(plane(), timeline, -1).direction, (0, 0, -1), atol=1e-6)


@pytest.mark.parametrize(
    "comment",
    [
        "",
        "first view: from the front",
        "first view: target 0 0 x, direction 0 0 -1, up 0 -1 0, radius 1",
        "first view: target 0 0 nan, direction 0 0 -1, up 0 -1 0, radius 1",
        "first view: target 0 0 1e300, direction 0 0 -1, up 0 -1 0, radius 1",
        "first view: target 0 0 1, direction 0 0 0, up 0 -1 0, radius 1",
        "first view: target 0 0 1, direction 0 1e200 0, up 0 -1 0, radius 1",
        "first view: target 0 0 1, direction 0 1 0, up 0 -1 0, radius 1",
        "first view: target 0 0 1, direction 0 0 -1, up 0 -1 0, radius -1",
        "first view: target 0 0 1, direction 0 0 -1, up 0 -1 0, radius inf",
    ],
)
def test_a_comment_that_tells_no_view_is_left_alone(comment: str) -> None:
    assert View.of_comments([comment]) is None
