"""The first images explain each other too little, or not at all."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import nacre

Array = npt.NDArray[Any]

CAMERA = nacre.Camera(160, 120, 150, 150, 79.5, 59.5)
STEP = 0.1  # [m] between views of the wall, to the right


def boxes() -> nacre.Mesh:
    """Return a small box on a large one."""
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = np.array([t for a, b, c, d in sides for t in ((a, b, c), (a, c, d))])
    large, small = corners * [0.15, 0.15, 0.1], corners * [0.05, 0.05, 0.04] + [0.06, 0.19, 0.02]
    return nacre.Mesh(np.concatenate([large, small]), np.concatenate([faces, faces + 8]))


def bumps() -> nacre.Mesh:
    """Return a wall a metre away that looks different everywhere."""
    rng = np.random.default_rng(0)
    x, y = np.meshgrid(np.linspace(-1, 2, 301), np.linspace(-1, 1, 201))
    z = np.ones(x.shape)
    for _ in range(250):
        a, b, wide = rng.uniform(-1, 2), rng.uniform(-1, 1), rng.uniform(0.03, 0.15)
        z += rng.uniform(-0.06, 0.06) * np.exp(-((x - a) ** 2 + (y - b) ** 2) / (2 * wide**2))
    rows = np.arange(x.size).reshape(x.shape)
    corner, right, below, last = rows[:-1, :-1], rows[:-1, 1:], rows[1:, :-1], rows[1:, 1:]
    triangles = [
        np.stack(three, axis=-1).reshape(-1, 3) for three in ((corner, below, right), (right, below, last))
    ]
    return nacre.Mesh(np.stack([x, y, z], axis=-1).reshape(-1, 3), np.concatenate(triangles).astype(np.int32))


BOXES, WALL = boxes(), bumps()


def around_boxes() -> tuple[list[Array], list[Array]]:
    """Return views 40 degrees apart, and their poses."""
    poses = list(
        nacre.turntable_poses(BOXES, 4, math.radians(40), camera=CAMERA, distance=0.7, elevation=0.5)
    )
    views = [
        BOXES.simulate_depth(CAMERA, pose, noise=0.001, edge_mixing=1.0, seed=i)
        for i, pose in enumerate(poses)
    ]
    return views, poses


def along_wall(count: int) -> list[Array]:
    poses = [np.eye(4) for _ in range(count)]
    for i, pose in enumerate(poses):
        pose[0, 3] = STEP * i
    return [WALL.simulate_depth(CAMERA, pose, noise=0.0005, seed=i) for i, pose in enumerate(poses)]


def another_scene() -> Array:
    return around_boxes()[0][0]


def add_all(model: nacre.Model, views: list[Array]) -> list[nacre.FrameReport]:
    return [model.add_frame(view) for view in views]


def statuses(model: nacre.Model) -> list[str]:
    return [report.status for report in model.frames]


def test_a_second_view_that_says_too_little_is_believed_once_a_third_confirms_it() -> None:
    views, truths = around_boxes()
    model = nacre.Model(CAMERA)
    reports = add_all(model, views)
    assert [report.status for report in reports[:3]] == ["TRACKED", "LOST", "TRACKED"]
    assert [report.corrects_earlier for report in reports[:3]] == [False, False, True]
    assert statuses(model) == ["TRACKED"] * 4
    for pose, truth in zip(model.poses, truths, strict=True):
        assert np.linalg.norm((pose - np.linalg.inv(truths[0]) @ truth)[:3, 3]) < 0.005


def test_where_the_first_view_explains_no_other_the_model_begins_with_a_later_one() -> None:
    model = nacre.Model(CAMERA)
    reports = add_all(model, [another_scene(), *along_wall(4)])
    assert [report.status for report in reports] == ["TRACKED", "LOST", "LOST", "TRACKED", "TRACKED"]
    assert statuses(model) == ["LOST", *["TRACKED"] * 4]
    assert model.frames[0].reason == "no other frame fits it: the model begins with a later one"
    assert model.frames[0].num_points == 0
    assert np.array_equal(model.poses[1], np.eye(4)), "the world is the first camera's that is registered"
    assert np.abs(model.poses[2:, 0, 3] - STEP * np.arange(1, 4)).max() < 0.001
    assert np.abs(model.points[:, 2] - 1).max() < 0.3, "nothing of the other scene is left"


def test_a_first_view_whose_pose_is_given_stays() -> None:
    model = nacre.Model(CAMERA)
    model.add_frame(another_scene(), guess=np.eye(4))
    add_all(model, along_wall(4))
    assert statuses(model) == ["TRACKED", *["LOST"] * 4]


def test_views_that_nothing_joins_begin_no_model() -> None:
    model = nacre.Model(CAMERA)
    wall = along_wall(4)
    add_all(model, [another_scene(), wall[0], another_scene(), wall[3][::-1, ::-1].copy(), wall[1]])
    assert "LOST" in statuses(model)[1:]
    assert model.frames[0].status == "TRACKED"


def test_covered_views_in_between_do_not_count() -> None:
    wall = along_wall(3)
    covered = np.zeros_like(wall[0])
    model = nacre.Model(CAMERA)
    add_all(model, [another_scene(), wall[0], covered, wall[1], wall[2]])
    assert statuses(model) == ["LOST", "TRACKED", "LOST", "TRACKED", "TRACKED"]


def test_attributes_that_fit_the_first_view_and_not_each_other_begin_no_model() -> None:
    model = nacre.Model(CAMERA)
    model.add_frame(another_scene())
    for channels, view in enumerate(along_wall(3), start=1):
        model.add_frame(view, attributes={"label": np.ones((*view.shape, channels), np.float32)})
    assert statuses(model) == ["TRACKED", *["LOST"] * 3]


@pytest.mark.parametrize("count", [1, 2, 3])
def test_the_same_bits_from_any_number_of_threads_and_after_loading(tmp_path: Path, count: int) -> None:
    views = [another_scene(), *along_wall(4)]
    model = nacre.Model(CAMERA, num_threads=1)
    add_all(model, views)
    other = nacre.Model(CAMERA, num_threads=3)
    add_all(other, views[:count])
    other.save(tmp_path / "model.ckpt")
    other = nacre.Model.load(tmp_path / "model.ckpt")
    add_all(other, views[count:])
    assert statuses(other) == statuses(model)
    assert np.array_equal(other.poses, model.poses, equal_nan=True)
    assert np.array_equal(other.points, model.points)


def test_a_recording_tells_what_became_of_its_first_frames() -> None:
    wall = along_wall(4)
    frames = [
        nacre.datasets.SequenceFrame(i, view, CAMERA, None, None, None)
        for i, view in enumerate([another_scene(), *wall])
    ]
    done = nacre.reconstruct(frames, retry=False)
    assert [frame.status for frame in done.frames] == ["LOST", *["TRACKED"] * 4]
    assert done.num_tracked == 4


def test_lost_frames_are_tried_again_only_where_the_model_has_grown_since() -> None:
    wall, other = along_wall(4), another_scene()
    order = [other, *wall, other]
    frames = [nacre.SequenceFrame(i, view, CAMERA, None, None, None) for i, view in enumerate(order)]
    done = nacre.reconstruction.Reconstruction(frames, nacre.Model(CAMERA))
    list(done.run())
    assert [frame.status for frame in done.frames] == ["LOST", *["TRACKED"] * 4, "LOST"]
    assert [frame.index for frame in done.retry_lost()] == [0]


def test_a_frame_that_is_not_to_be_searched_for_is_looked_for_near_its_guess_alone() -> None:
    wall = along_wall(9)
    model = nacre.Model(CAMERA)
    add_all(model, wall[:6])
    far, near = np.eye(4), np.eye(4)
    far[:3, :3] = [[0, 0, 1], [0, 1, 0], [-1, 0, 0]]
    near[0, 3] = STEP * 2
    assert model.add_frame(wall[2], guess=far, search=False).status == "LOST"
    report = model.add_frame(wall[2], guess=near, search=False)
    assert report.status == "RELOCALISED"
    assert abs(report.world_from_camera[0, 3] - near[0, 3]) < 0.001


def test_where_the_camera_moves_on_lost_frames_are_found_from_those_beside_them() -> None:
    wall = along_wall(12)
    hidden = [view if i not in (4, 5, 6) else np.zeros_like(view) for i, view in enumerate(wall)]
    frames = [nacre.SequenceFrame(i, view, CAMERA, None, None, None) for i, view in enumerate(hidden)]
    done = nacre.reconstruction.Reconstruction(frames, nacre.Model(CAMERA))
    list(done.run())
    assert [frame.index for frame in done.frames if frame.status == "LOST"] == [4, 5, 6]
    frames[4:7] = [nacre.SequenceFrame(i, wall[i], CAMERA, None, None, None) for i in (4, 5, 6)]
    assert [frame.index for frame in done.retry_lost()] == [6, 5, 4]
    assert [done.frames[i].status for i in (4, 5, 6)] == ["RELOCALISED"] * 3
    assert np.abs(done.poses[:, 0, 3] - STEP * np.arange(12)).max() < 0.002


def test_a_model_that_begins_before_a_bare_wall_begins_anew_behind_it() -> None:
    """Nothing is added to its first frame, as a bare wall leaves directions open."""
    vertices = WALL.vertices.copy()
    vertices[:, 2] = 1 + (vertices[:, 2] - 1) * np.clip((vertices[:, 0] - 0.3) / 0.1, 0, 1)
    wall = nacre.Mesh(vertices, WALL.triangles)
    model, poses = nacre.Model(CAMERA), [np.eye(4) for _ in range(18)]
    for number, pose in enumerate(poses):
        pose[0, 3] = -0.3 + 0.1 * number
        model.add_frame(wall.simulate_depth(CAMERA, pose, noise=0.0005, seed=number))
    assert model.frames[1].status == "LOST"  # it was WEAK, and nothing is known of it any more
    first = next(i for i, report in enumerate(model.frames) if report.status == "TRACKED")
    assert 0 < first < 15
    assert set(statuses(model)[first:]) == {"TRACKED"}
    moved = [report.world_from_camera[0, 3] for report in model.frames[first:]]
    np.testing.assert_allclose(moved, 0.1 * np.arange(len(moved)), atol=0.01)
