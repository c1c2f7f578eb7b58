"""Loops from the outside: corrected poses, what reports say, and the switch of the command line."""

import contextlib
import dataclasses
import io
import json
import math

import numpy as np
import pytest

import nacre
from nacre.reconstruction import Reconstruction

TURN = 72  # frames
FRAMES = TURN + 6


def box(center, size, turn):
    corners = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)]) * size
    cos, sin = math.cos(turn), math.sin(turn)
    quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    triangles = [t for a, b, c, d in quads for t in ([a, b, c], [a, c, d])]
    return corners @ np.array([[cos, 0, sin], [0, 1, 0], [-sin, 0, cos]]).T + center, np.array(triangles)


def merged(parts):
    sizes = np.cumsum([0] + [len(vertices) for vertices, _ in parts])
    vertices = np.concatenate([vertices for vertices, _ in parts])
    return nacre.Mesh(vertices, np.concatenate([t + n for (_, t), n in zip(parts, sizes[:-1], strict=True)]))


def furnished_room():
    """Return a room of 4 m x 2.6 m x 4 m with boxes along its walls."""
    random = np.random.default_rng(3)
    parts = [box(np.zeros(3), [4.0, 2.6, 4.0], 0.0)]
    for i in range(90):
        angle = 2 * math.pi * (i + random.random()) / 90
        way = np.array([math.sin(angle), 0, math.cos(angle)])
        place = (1.9 / abs(way).max() - 0.4 * random.random()) * way + [0, random.uniform(-1.1, 1.1), 0]
        parts.append(box(place, random.uniform(0.1, [0.5, 0.7, 0.5]), random.uniform(0, math.pi)))
    return merged(parts)


def pose(k):
    angle = 2 * math.pi * k / TURN
    cos, sin = math.cos(angle), math.sin(angle)
    matrix = np.eye(4)
    matrix[:3, :3] = [[cos, 0, sin], [0, 1, 0], [-sin, 0, cos]]
    matrix[:3, 3] = [0.3 * sin, 0.06 * math.sin(3 * angle), 0.3 * cos]
    return matrix


def camera(focal_error=0.0):
    focal = 180 * (1 + focal_error)
    return nacre.Camera(208, 156, focal, focal, 103.5, 77.5)


@pytest.fixture(scope="module")
def views():
    room = furnished_room()
    return [room.simulate_depth(camera(), pose(k), noise="kinect", seed=k) for k in range(FRAMES)]


@pytest.fixture(scope="module")
def recording(views, tmp_path_factory):
    """Return the folder of a recording with too long a focal length: a full turn that does not close."""
    folder = tmp_path_factory.mktemp("turn")
    poses = [pose(k) for k in range(FRAMES)]
    nacre.write_recording(folder / "recording", camera(0.015), views, depth_scale=5000, poses=poses)
    return folder / "recording"


@pytest.fixture(scope="module")
def done(recording):
    sequence = nacre.open_sequence(recording)
    done = Reconstruction(sequence, nacre.Model(sequence.camera))
    done.first, done.changed = [], []
    before = done.model.poses
    for frame in done.run():
        done.first.append(frame.world_from_camera)
        done.changed.append(not np.array_equal(before, done.model.poses[:-1]))
        before = done.model.poses
    return done


def test_a_loop_corrects_the_poses_of_earlier_frames(done):
    closing = [report for report in done.model.frames if report.loop_frame is not None]
    assert closing
    assert all(report.loop_distance > 0 for report in closing)
    assert all(report.loop_frame < report.index - TURN // 2 for report in closing)
    moved = np.linalg.norm(np.array(done.first)[:, :3, 3] - done.model.poses[:, :3, 3], axis=1)
    assert moved[0] == 0
    assert moved[TURN // 2] > 0.003
    np.testing.assert_array_equal(
        done.model.poses, [report.world_from_camera for report in done.model.frames]
    )


def test_a_reconstruction_holds_the_corrected_poses(done):
    np.testing.assert_array_equal(done.poses, done.model.poses)
    np.testing.assert_array_equal(done.trajectory.poses, done.model.poses)
    assert [frame.index for frame in done.loops] == [
        report.index for report in done.model.frames if report.loop_frame is not None
    ]


def test_a_report_says_whether_earlier_poses_changed(done):
    assert done.changed == [report.corrects_earlier for report in done.model.frames]
    assert 0 < sum(done.changed) < FRAMES


def test_a_loop_with_a_frame_that_was_tried_again_names_its_place_in_the_recording(done):
    """The model counts a frame that it sees twice as two."""
    again, closing = (
        dataclasses.replace(frame, report=dataclasses.replace(frame.report, **change))
        for frame, change in (
            (done.frames[4], {"index": FRAMES + 2}),
            (done.frames[-1], {"loop_frame": FRAMES + 2}),
        )
    )
    changed = Reconstruction(done.sequence, done.model)
    changed.frames = [*done.frames[:4], again, *done.frames[5:-1], closing]
    assert changed.as_dict()["frames"][-1]["loop_frame"] == 4


def test_without_loop_closure_nothing_is_corrected(views):
    model = nacre.Model(camera(0.015), loop_closure=False)
    before = np.array([model.add_frame(view).world_from_camera for view in views])
    assert all(report.loop_frame is None for report in model.frames)
    np.testing.assert_array_equal(model.poses, before)


def test_the_command_line_closes_loops_unless_told_not_to(recording, tmp_path):
    pytest.importorskip("typer")
    from nacre.cli import main

    errors = {}
    for switch in ("--loop-closure", "--no-loop-closure"):
        said = io.StringIO()
        with (
            contextlib.redirect_stdout(said),
            contextlib.redirect_stderr(said),
            pytest.raises(SystemExit) as stopped,
        ):
            main(["reconstruct", str(recording), "-o", str(tmp_path / switch), switch])
        assert stopped.value.code == 0
        report = json.loads((tmp_path / switch / "report.json").read_text())
        loops = [frame["loop_frame"] for frame in report["frames"] if frame["loop_frame"] is not None]
        closes = switch == "--loop-closure"
        assert report["parameters"]["loop_closure"] is closes
        assert report["num_loops"] == len(loops)
        assert (len(loops) > 0) is closes
        assert ("loops closed" in said.getvalue()) is closes
        errors[switch] = report["absolute_trajectory_error"]["rotation_rmse"]
    assert errors["--loop-closure"] < 0.7 * errors["--no-loop-closure"]


@pytest.mark.parametrize("closes", [True, False])
def test_the_model_never_has_more_points_than_it_may(views, closes):
    model = nacre.Model(camera(0.015), max_points=6000, loop_closure=closes)
    for view in views:
        report = model.add_frame(view)
        assert report.num_points == len(model) <= 6000
    assert model.spacing > nacre.Model(camera()).add_frame(views[0]).spacing
