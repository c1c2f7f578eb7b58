"""A gripper, or a finger, that the camera carries along in its view."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from test_moving_things import CAMERA, STEP, view

import nacre

Array = npt.NDArray[Any]
NEAR = 0.3  # [m] of the gripper; the wall is a metre away


def gripper(rows: slice, columns: slice, seed: int) -> tuple[Array, Array]:
    """Return the pixels that show a rough gripper, and its depth there."""
    v, u = np.indices((CAMERA.height, CAMERA.width))
    inside = np.zeros(v.shape, bool)
    inside[rows, columns] = True
    depth = NEAR + 0.02 * np.sin(u / 7) * np.cos(v / 9)
    return inside, depth + np.random.default_rng(seed).normal(0, 0.0005, depth.shape)


def holding(count: int, rows: slice = slice(60, None), columns: slice = slice(80, None)) -> list[Array]:
    images = []
    for i in range(count):
        inside, depth = gripper(rows, columns, 1000 + i)
        images.append(np.where(inside, depth, view(i, None)).astype(np.float32))
    return images


def run(images: list[Array], **options: Any) -> nacre.Model:
    model = nacre.Model(CAMERA, **options)
    for image in images:
        model.add_frame(image)
    return model


def test_a_gripper_does_not_hold_the_camera_back() -> None:
    model = run(holding(12))
    known = [frame for frame in model.frames if frame.status == "TRACKED"]
    assert len(known) >= 9
    steps = np.diff([frame.world_from_camera[:3, 3] for frame in known], axis=0)
    np.testing.assert_allclose(steps, np.broadcast_to((STEP, 0, 0), steps.shape), atol=0.0015)
    assert all(frame.num_moving > 4000 for frame in known[-8:])
    assert model.points[:, 2].min() > 0.8  # nothing of it is left


def test_a_model_that_begins_without_it_says_so_of_the_frames_before() -> None:
    model = nacre.Model(CAMERA)
    reports = [model.add_frame(image) for image in holding(4)]
    begun = next(report for report in reports if report.num_moving)
    assert begun.corrects_earlier
    for frame in model.frames[: begun.index]:
        assert frame.status == "LOST"
        assert frame.reason == "the camera carries a part of what it sees: the model begins later"


def test_without_one_nothing_is_left_out() -> None:
    model = run([view(i, None) for i in range(6)])
    assert [frame.num_moving for frame in model.frames] == [0] * 6


def test_what_does_not_come_in_from_the_border_is_no_part_of_the_camera() -> None:
    model = run(holding(6, slice(40, 80), slice(50, 110)))
    assert [frame.num_moving for frame in model.frames][:3] == [0] * 3


def test_a_camera_at_rest_leaves_out_nothing() -> None:
    inside, depth = gripper(slice(60, None), slice(80, None), 0)
    rng = np.random.default_rng(1)
    scene = np.where(inside, depth, view(0, None))
    images = [(scene + rng.normal(0, 0.0005, scene.shape)).astype(np.float32) for _ in range(4)]
    assert [frame.num_moving for frame in run(images).frames] == [0] * 4


def test_a_gripper_that_leaves_is_forgotten() -> None:
    model = run(holding(6) + [view(i, None) for i in range(6, 12)])
    assert [frame.num_moving for frame in model.frames][7:] == [0] * 5
    assert {frame.status for frame in model.frames[7:]} == {"TRACKED"}


@pytest.mark.parametrize("frames", [1, 4])
def test_it_goes_on_to_the_same_bits(tmp_path: Path, frames: int) -> None:
    images = holding(8)
    model = run(images[:frames])
    model.save(tmp_path / "model")
    other = nacre.Model.load(tmp_path / "model")
    for some in (model, other):
        for image in images[frames:]:
            some.add_frame(image)
    for some in (other, run(images, num_threads=1), run(images, num_threads=3)):
        assert np.asarray(some.points).tobytes() == np.asarray(model.points).tobytes()
