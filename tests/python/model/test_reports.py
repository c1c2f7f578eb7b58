"""Poses, and what the reports say."""

import dataclasses

import numpy as np
import pytest
from model_scenes import (
    FLAT,
    HOPELESS,
    moved,
    object_model,
    off_thing,
    relief,
    rms,
    state,
    thing,
    true_pose,
    view,
)

import nacre


def test_guess_of_the_first_frame_is_the_world() -> None:
    pose = true_pose(3)
    model = nacre.Model(nacre.default_camera(thing()))
    report = model.add_frame(view(3), guess=pose)
    assert np.allclose(report.world_from_camera, pose, atol=1e-12)
    assert rms(off_thing(model.points)) < 0.0005


def test_guess_is_where_registration_starts() -> None:
    """A view from 90 degrees away is found from a guess within some degrees, and lost or wrong without."""
    model = nacre.Model(nacre.default_camera(thing()))
    for index in (0, 1, 2):
        model.add_frame(view(index))
    report = model.add_frame(view(0), guess=true_pose(0))
    assert report.status == "TRACKED"
    assert np.allclose(report.world_from_camera, np.eye(4), atol=0.003)


def test_kept_guess_is_the_pose() -> None:
    model = object_model(1)
    pose = true_pose(1)
    pose[:3, 3] += 0.0005
    report = model.add_frame(view(1), guess=pose, keep_guess=True)
    assert report.status == "TRACKED"
    assert np.allclose(report.world_from_camera, pose, atol=1e-12)
    assert report.num_updated > 500


def test_timestamps_are_kept() -> None:
    model = nacre.Model(FLAT)
    model.add_frame(relief(), timestamp=12.25)
    model.add_frame(relief())
    model.add_frame(np.zeros((80, 100)), timestamp=1e9)
    assert [report.timestamp for report in model.frames] == [12.25, None, 1e9]


def test_poses_of_every_frame() -> None:
    model = nacre.Model(nacre.default_camera(thing()))
    assert model.poses.shape == (0, 4, 4)
    for depth in (view(0), HOPELESS["zeros"](), view(1)):
        model.add_frame(depth)
    poses = model.poses
    assert poses.shape == (3, 4, 4)
    assert np.isnan(poses[1]).all()
    assert (poses[0] == np.eye(4)).all()
    assert (poses[2] == model.frames[2].world_from_camera).all()
    rotation = poses[2, :3, :3]
    assert np.allclose(rotation @ rotation.T, np.eye(3), atol=1e-9)
    assert (poses[2, 3] == [0, 0, 0, 1]).all()


def test_in_camera_is_the_model_seen_from_the_newest_pose() -> None:
    model = object_model(3)
    model.add_frame(HOPELESS["NaN"]())
    points, normals = model.in_camera()
    pose = model.poses[2]
    assert np.allclose(moved(pose, points.astype(np.float64)), model.points, atol=1e-6)
    assert np.allclose(normals @ pose[:3, :3].T, model.normals, atol=1e-5)


def test_reports() -> None:
    model = nacre.Model(nacre.default_camera(thing()))
    for index in range(3):
        before = len(model)
        report = model.add_frame(view(index))
        assert report.index == index
        assert report.reason == ""
        assert report.num_points == len(model) == before + report.num_inserted - report.num_removed
        assert 0 < report.overlap <= 1
        assert 0 < report.consistency <= 1
        assert report.information.shape == (6, 6)
        assert report.weak_directions.shape == (0, 6)
        assert report.depth.num_pixels == 224 * 224
        assert report.depth.num_kept + report.depth.num_invalid <= 224 * 224
        assert set(report.milliseconds) == {
            "preprocess", "back_project", "region", "registration", "loop_closure", "fuse", "normals",
            "total",
        }  # fmt: skip
        steps = sum(value for name, value in report.milliseconds.items() if name != "total")
        assert 0 < steps <= report.milliseconds["total"] * 1.001
        with pytest.raises(dataclasses.FrozenInstanceError):
            report.index = 7  # type: ignore[misc]
        if index:
            assert report.num_inliers > 1000
            assert 0.0001 < report.rmse < 0.001
            assert report.num_updated > 500
            assert (np.linalg.eigvalsh(report.information) > 0).all()
    assert model.frames[2] == report
    assert len(model.frames) == 3
    assert repr(report).startswith("FrameReport(index=2, TRACKED, overlap=")
    assert repr(model) == f"Model({len(model)} points, 3 of 3 frames tracked, spacing=0.002 m)"


def test_outputs_are_copies() -> None:
    model = object_model(1)
    before = state(model)
    for array in (model.points, model.normals, model.confidence, model.poses):
        assert array.flags.c_contiguous
        array[:] = 7
    assert state(model) == before
    assert model.points.dtype == model.normals.dtype == model.confidence.dtype == np.float32
