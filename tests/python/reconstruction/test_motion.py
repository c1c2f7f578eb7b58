"""How what bends moved is kept in few bytes: each frame's shape, and what is between two that are kept."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from bending_sheet import CAMERA, CURVATURES, sheet
from command_line import run

import nacre
from nacre.datasets import write_recording
from nacre.errors import FileFormatError
from nacre.io.npz import read_arrays, write_arrays
from nacre.run_data import motion as motions
from nacre.run_data.motion import Motion, frames_shown, motion_of, read_motion

LOST = 3


def depth_images() -> list[np.ndarray]:
    """Return those of a sheet that is rolled up, one of nothing in between."""
    depths = [
        sheet(curvature).simulate_depth(CAMERA, np.eye(4), noise="kinect", seed=index)
        for index, curvature in enumerate(CURVATURES)
    ]
    depths.insert(LOST, np.full_like(depths[0], np.nan))
    return depths


@pytest.fixture(scope="module")
def model() -> nacre.Model:
    model = nacre.Model(CAMERA, deform=True)
    for depth in depth_images():
        model.add_frame(depth)
    assert [report.tracked for report in model.frames] == [i != LOST for i in range(7)]
    return model


@pytest.fixture(scope="module")
def motion(model: nacre.Model) -> Motion:
    motion = motion_of(model, model.frames)
    assert motion is not None
    return motion


def test_each_frame_has_its_shape(model: nacre.Model, motion: Motion) -> None:
    for frame in range(7):
        points, normals = motion.at(frame)
        assert np.abs(points - model.points_at(frame)).max() < 0.51 * motion.step
        cosines = (normals * model.normals_at(frame)).sum(axis=1)
        assert np.degrees(np.arccos(np.clip(cosines, -1, 1))).max() < 1
    assert motion.step <= 0.01 * model.spacing
    assert np.abs(motion.at(6)[0] - motion.at(0)[0]).max() > 0.02  # it moved


def test_a_lost_frame_has_the_shape_of_the_one_before(model: nacre.Model, motion: Motion) -> None:
    assert motion.moments.tolist() == [0, 1, 2, 2, 3, 4, 5]
    np.testing.assert_array_equal(motion.at(LOST)[0], motion.at(LOST - 1)[0])
    reports = list(model.frames)
    assert frames_shown([None, reports[LOST], reports[0], None, reports[2]]) == [0, 0, 0, 0, 2]
    assert frames_shown([None, reports[LOST]]) == []
    assert motion_of(model, [None, reports[LOST]]) is None


def test_of_too_many_shapes_some_are_kept_and_blended(
    model: nacre.Model, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(motions, "_MOST_POSITIONS", 3 * len(model))
    motion = motion_of(model, model.frames)
    assert motion is not None
    assert motion.points.shape == (3, len(model), 3)
    assert motion.moments.tolist() == pytest.approx([0, 0.5, 1, 1, 4 / 3, 5 / 3, 2])
    for frame in (0, 2, 6):
        assert np.abs(motion.at(frame)[0] - model.points_at(frame)).max() < 0.51 * motion.step
    halfway, normals = motion.at(1)
    expected = 0.5 * (model.points_at(0) + model.points_at(2))
    assert np.abs(halfway - expected).max() < 1.01 * motion.step
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1, atol=1e-5)


def test_some_of_the_points(motion: Motion) -> None:
    rows = np.array([7, 3])
    np.testing.assert_array_equal(motion.of_points(rows).at(5)[0], motion.at(5)[0][rows])


@pytest.fixture(scope="module")
def out(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of a run with --deform."""
    folder = tmp_path_factory.mktemp("sheet")
    write_recording(folder / "recording", CAMERA, depth_images(), depth_scale=10_000)
    run("reconstruct", folder / "recording", "--deform", "-o", folder / "out", "--no-report")
    return folder / "out"


def test_a_run_writes_that_of_its_points(out: Path) -> None:
    motion, points = read_motion(out / "motion.npz"), nacre.read_points(out / "model.ply").points
    assert motion.points.shape == (6, len(points), 3)
    assert len(motion.moments) == 7
    first = motion.at(0)[0]  # the canonical shape is about that of the first frame
    assert np.median(np.linalg.norm(first - points, axis=1)) < 0.002
    poses = nacre.read_trajectory(out / "trajectory.txt").poses
    tracked = [i for i in range(7) if i != LOST]
    for place, curvature, pose in zip(tracked, CURVATURES, poses, strict=True):
        in_camera = (motion.at(place)[0] - pose[:3, 3]) @ pose[:3, :3]
        distances = sheet(curvature).closest(in_camera.astype(np.float32)).distances
        assert np.sqrt((distances**2).mean()) < 0.0015


def test_what_is_rigid_has_none(out: Path, tmp_path: Path) -> None:
    (tmp_path / "motion.npz").write_bytes(b"of an earlier model")
    run("reconstruct", out.parent / "recording", "-o", tmp_path, "--no-report", "--min-tracked", 0)
    assert not (tmp_path / "motion.npz").exists()


@pytest.mark.parametrize(
    ("name", "change", "message"),
    [
        ("points", lambda old: old[:, :-1], "normals must have shape"),
        ("points", lambda old: old.astype(float), "points must be uint16"),
        ("normals", None, "normals must be uint8"),
        ("moments", lambda old: old + 0.1, "moments must be from 0 to 5"),
        ("moments", lambda old: old * np.nan, "moments must be from 0 to 5"),
        ("origin", lambda old: old * np.inf, "origin and step must be finite"),
        ("step", lambda old: -old, "origin and step must be finite"),
    ],
)
def test_a_damaged_file_is_refused(
    out: Path, tmp_path: Path, name: str, change: Callable[..., np.ndarray] | None, message: str
) -> None:
    arrays = read_arrays(out / "motion.npz")
    old = arrays.pop(name)
    if change is not None:
        arrays[name] = np.asarray(change(old))
    write_arrays(tmp_path / "motion.npz", arrays)
    with pytest.raises(FileFormatError, match=message):
        read_motion(tmp_path / "motion.npz")
