"""Cameras whose neighbouring pixels err together, as those of stereo do: one image does not show it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
import test_loop_closure as loops

import nacre

Array = npt.NDArray[np.float64]

CAMERA = nacre.Camera(320, 240, 300.0, 300.0, 159.5, 119.5)


def smooth_field(random: np.random.Generator, patch: int) -> Array:
    """Return errors of about 1 that pixels within a patch share: bilinear between random values."""
    rows, cols = np.mgrid[: CAMERA.height, : CAMERA.width] / patch
    top, left = rows.astype(int), cols.astype(int)
    grid = random.normal(size=(top.max() + 2, left.max() + 2)) * 1.5  # interpolation takes a third away
    down, right = rows - top, cols - left
    upper = grid[top, left] * (1 - right) + grid[top, left + 1] * right
    lower = grid[top + 1, left] * (1 - right) + grid[top + 1, left + 1] * right
    return np.asarray(upper * (1 - down) + lower * down)


def turned(angle: float) -> Array:
    cos, sin = np.cos(angle), np.sin(angle)
    return np.array([[cos, 0, sin, 0], [0, 1, 0, 0], [-sin, 0, cos, 0], [0, 0, 0, 1]])


@pytest.fixture(scope="module")
def exact() -> list[tuple[Array, Array]]:
    """Return images and poses of a camera that turns in a room."""
    room = loops.furnished_room()
    poses = [turned(0.02 * i) for i in range(8)]
    return [(np.asarray(room.simulate_depth(CAMERA, pose), np.float64), pose) for pose in poses]


def track(
    model: nacre.Model, exact: list[tuple[Array, Array]], shared: float, seed: int = 7
) -> tuple[list[str], Array]:
    """
    Add frames whose errors, at 1 m, are 1 mm for each pixel and ``shared`` for its patch; the room has 2 m.

    Returns the states of the frames and the errors of those that are tracked [m].
    """
    random = np.random.default_rng(seed)
    states, errors = [], []
    for depth, truth in exact:
        error = shared * smooth_field(random, 24) + 0.001 * random.normal(size=depth.shape)
        report = model.add_frame(depth + error * depth**2)
        states.append(report.status)
        if report.status == "TRACKED":
            errors.append(np.linalg.norm(report.world_from_camera[:3, 3] - truth[:3, 3]))
    return states, np.asarray(errors)


def test_where_images_show_all_the_noise_nothing_is_added(exact: list[tuple[Array, Array]]) -> None:
    model = nacre.Model(CAMERA)
    states, errors = track(model, exact, 0.0)
    assert states == 8 * ["TRACKED"]
    assert errors.max() < 0.002
    assert model.noise_factor == 1.0


@pytest.mark.parametrize("shared", [0.004, 0.008])
def test_noise_that_neighbours_share_is_learned(exact: list[tuple[Array, Array]], shared: float) -> None:
    model = nacre.Model(CAMERA)
    states, _ = track(model, exact, shared)
    assert states == 8 * ["TRACKED"]
    # Residuals have the errors of both sides.
    assert model.noise_factor == pytest.approx(np.sqrt(2) * shared / 0.001, rel=0.4)


def test_no_pose_errs_by_more_than_a_patch(exact: list[tuple[Array, Array]]) -> None:
    _, errors = track(nacre.Model(CAMERA), exact, 0.004)
    assert errors.max() < 4 * 0.004  # what a patch is off by at 2 m


@pytest.mark.parametrize("shared", [0.004, 0.008])
def test_a_pose_errs_by_less_than_a_patch_in_the_mean(
    exact: list[tuple[Array, Array]], shared: float
) -> None:
    errors = [track(nacre.Model(CAMERA), exact, shared, seed)[1][1:] for seed in range(8)]
    assert sum(map(len, errors)) > 0.9 * 8 * 7
    mean_square = np.mean(np.concatenate(errors) ** 2)
    assert np.sqrt(mean_square) < 3 * shared  # a patch errs by 4 at 2 m


@pytest.mark.parametrize("step", [0.2, 0.3])
@pytest.mark.parametrize("shared", [0.003, 0.006])
def test_a_camera_of_unknown_noise_may_turn_fast(step: float, shared: float) -> None:
    room = loops.furnished_room()
    poses = [turned(step * i) for i in range(4)]
    frames = [(np.asarray(room.simulate_depth(CAMERA, pose), np.float64), pose) for pose in poses]
    states, errors = track(nacre.Model(CAMERA), frames, shared)
    assert states == 4 * ["TRACKED"]
    assert errors.max() < 8 * shared  # twice what a patch is off by at 2 m


def test_noise_that_is_given_is_believed(exact: list[tuple[Array, Array]]) -> None:
    model = nacre.Model(CAMERA, depth={"noise": nacre.NoiseModel(0.0, 0.001, 0.0, 0.0)})
    states, _ = track(model, exact, 0.008)
    assert "LOST" in states
    assert model.noise_factor == 1.0


def test_what_was_learned_is_kept(exact: list[tuple[Array, Array]], tmp_path: Path) -> None:
    model = nacre.Model(CAMERA)
    track(model, exact, 0.004)
    model.save(tmp_path / "model")
    assert nacre.Model.load(tmp_path / "model").noise_factor == model.noise_factor > 1.0


def test_a_camera_at_rest_tells_no_noise_that_stays_in_its_image(exact: list[tuple[Array, Array]]) -> None:
    random = np.random.default_rng(7)
    size = (CAMERA.height, CAMERA.width)
    errors = [0.004 * smooth_field(random, 24) for _ in exact]
    images = [depth + error * depth**2 for (depth, _), error in zip(exact, errors, strict=True)]
    moving, rested = nacre.Model(CAMERA), nacre.Model(CAMERA)
    for model, still in ((moving, 1), (rested, 12)):
        for image in still * images[:1] + images[1:]:
            noisy = image + 0.001 * random.normal(size=size) * image**2
            assert model.add_frame(noisy).status == "TRACKED"
    assert moving.noise_factor > 1.5
    assert rested.noise_factor == pytest.approx(moving.noise_factor, rel=0.2)


def test_an_image_that_comes_twice_tells_no_noise(exact: list[tuple[Array, Array]]) -> None:
    random = np.random.default_rng(7)
    size = (CAMERA.height, CAMERA.width)
    errors = [0.004 * smooth_field(random, 24) + 0.001 * random.normal(size=size) for _ in exact]
    images = [depth + error * depth**2 for (depth, _), error in zip(exact, errors, strict=True)]
    once, twice = nacre.Model(CAMERA), nacre.Model(CAMERA)
    for image in images:
        once.add_frame(image)
        reports = [twice.add_frame(image) for _ in range(2)]
        assert [report.status for report in reports] == ["TRACKED", "TRACKED"]
    assert once.noise_factor > 1.5
    assert twice.noise_factor == pytest.approx(once.noise_factor, rel=0.2)


def test_frames_whose_poses_are_given_tell_noise_too(exact: list[tuple[Array, Array]]) -> None:
    random = np.random.default_rng(7)
    tracked, given = nacre.Model(CAMERA), nacre.Model(CAMERA)
    for i, (depth, truth) in enumerate(exact):
        error = 0.004 * smooth_field(random, 24) + 0.001 * random.normal(size=depth.shape)
        image = depth + error * depth**2
        tracked.add_frame(image, guess=truth if i == 0 else None, keep_guess=i == 0)
        report = given.add_frame(image, guess=truth, keep_guess=True)
        np.testing.assert_array_equal(report.world_from_camera, truth)
    assert given.noise_factor == pytest.approx(tracked.noise_factor, rel=0.3)
    assert len(given) < 1.1 * len(tracked)
