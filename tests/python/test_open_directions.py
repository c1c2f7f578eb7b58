"""A camera that passes along a wall: who holds what it leaves open, or noise feigns, and for how long."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from boxes import boxes

import nacre

Array = npt.NDArray[Any]

CAMERA = nacre.Camera(160, 120, 150, 150, 79.5, 59.5)
STEP = 0.05  # [m] between frames
COVERED = -1


def wall() -> nacre.Mesh:
    """Return a wall a metre away, rough where x < 0.3 m and bare from there on."""
    x, y = np.meshgrid(np.linspace(-1, 3, 401), np.linspace(-1, 1, 201))
    rough = np.sin(19 * x) * np.cos(23 * y) + np.sin(11 * x + 17 * y) + np.cos(29 * x - 7 * y)
    z = 1 - 0.02 * rough * np.clip((0.3 - x) / 0.1, 0, 1)
    rows = np.arange(x.size).reshape(x.shape)
    corner, right, below, last = rows[:-1, :-1], rows[:-1, 1:], rows[1:, :-1], rows[1:, 1:]
    triangles = [
        np.stack(three, axis=-1).reshape(-1, 3) for three in ((corner, below, right), (right, below, last))
    ]
    return nacre.Mesh(np.stack([x, y, z], axis=-1).reshape(-1, 3), np.concatenate(triangles).astype(np.int32))


def view(number: int) -> Array:
    """Return what the camera sees after so many steps, with noise of half a millimetre."""
    pose = np.eye(4)
    pose[0, 3] = STEP * number
    depth = wall().simulate_depth(CAMERA, pose)
    return depth + np.random.default_rng(number).normal(0, 0.0005, depth.shape).astype(np.float32)


def passed(numbers: list[int]) -> nacre.Model:
    """Return what a model makes of some of the views."""
    model = nacre.Model(CAMERA)
    for number in numbers:
        model.add_frame(view(number) if number != COVERED else np.zeros((120, 160), np.float32))
    return model


def steps(model: nacre.Model) -> Array:
    """Return how far the camera has come, in steps."""
    return np.array([report.world_from_camera[0, 3] / STEP for report in model.frames])


def test_the_motion_goes_on_where_the_wall_leaves_it_open() -> None:
    model = passed(list(range(24)))
    assert {report.status for report in model.frames[:12]} == {"TRACKED"}
    assert {report.status for report in model.frames[16:]} == {"WEAK"}
    np.testing.assert_allclose(steps(model), np.arange(24), atol=0.1)


def test_after_a_loss_nobody_knows_the_motion() -> None:
    model = passed([*range(14), COVERED, *range(15, 22)])
    assert {report.status for report in model.frames[14:]} == {"LOST"}
    np.testing.assert_allclose(steps(model)[14:], steps(model)[13])


def test_after_a_loss_a_guess_that_is_given_tells_the_motion() -> None:
    model = passed([*range(14), COVERED])
    guess = np.eye(4)
    guess[0, 3] = STEP * 15
    report = model.add_frame(view(15), guess=guess)
    assert report.status == "WEAK"
    np.testing.assert_allclose(steps(model)[-1], 15, atol=0.1)


def test_a_camera_that_turned_back_is_found_where_the_wall_is_rough() -> None:
    there_and_back = [*range(18), *range(18, 5, -1)]
    model = passed(there_and_back)
    known = [i for i, report in enumerate(model.frames) if report.status in {"TRACKED", "RELOCALISED"}]
    np.testing.assert_allclose(steps(model)[known], np.array(there_and_back)[known], atol=0.1)
    assert model.frames[-1].status == "TRACKED"


def test_a_camera_that_turns_on_the_spot_does_not_go_about_what_it_sees() -> None:
    """Floor and wall tell how it turns, not where along them it stands."""
    wall_and_floor = boxes(((-4, -2, 3), (4, 1, 3.1)), ((-4, 1, -1), (4, 1.1, 3)))
    model = nacre.Model(CAMERA)
    for number in range(6):
        pose = np.eye(4)
        angle = np.radians(3 * number)
        pose[:3, :3] = [[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]]
        depth = wall_and_floor.simulate_depth(CAMERA, pose)
        noise = np.random.default_rng(number).normal(0, 0.001, depth.shape)
        report = model.add_frame(depth + noise.astype(np.float32))
        if number > 0:
            assert (report.status, len(report.weak_directions)) == ("WEAK", 1)
        np.testing.assert_allclose(report.world_from_camera[:3, :3], pose[:3, :3], atol=0.003)
        np.testing.assert_allclose(report.world_from_camera[:3, 3], 0, atol=0.02)


def wall_with_boxes() -> nacre.Mesh:
    """Return a wall two metres away, with boxes before it that are a third of a metre deep."""
    random = np.random.default_rng(5)
    corners = [(np.array([-4.5, -3, 2]), np.array([4.5, 3, 2.1]))]
    for x in np.arange(-3, 3, 0.55):
        middle = np.array([x + random.uniform(-0.1, 0.1), random.uniform(-0.7, 0.7), 2])
        size = random.uniform([0.3, 0.3, 0.6], [0.5, 0.5, 0.7])
        corners.append((middle - size / 2, middle + size / 2))
    return boxes(*corners)


@pytest.mark.parametrize(
    ("sensor", "focal_length", "seed"), [("stereo", 615, 1), ("structured_light", 525, 0)]
)
def test_what_sticks_to_a_camera_does_not_hold_it(sensor: Any, focal_length: float, seed: int) -> None:
    # The faces of wall and boxes look one way, and what neighbouring pixels and successive images err by in
    # common lies still in the image: registered by shape alone the camera stands still, and is sure of it.
    camera, scene = nacre.Camera(640, 480, focal_length, focal_length, 319.5, 239.5), wall_with_boxes()
    model, pose = nacre.Model(camera), np.eye(4)
    for number in range(8):
        pose[0, 3] = 0.04 * number - 0.5
        depth = scene.simulate_depth(camera, pose, sensor=sensor, seed=100 * seed + number, sensor_seed=seed)
        model.add_frame(depth)
    come = [report.world_from_camera[0, 3] for report in model.frames if report.tracked]
    assert len(come) == 8
    np.testing.assert_allclose(come, 0.04 * np.arange(8), atol=0.02)


FLOOR_CAMERA = nacre.Camera(320, 240, 290, 290, 159.5, 119.5)


def over_a_floor(sensor: Any, down: float) -> list[Array]:
    """Return what a camera sees that looks down by some degrees, and passes over a bare floor."""
    floor, pose = boxes(((-9, 0, -9), (9, 0.1, 9))), np.eye(4)
    cos, sin = np.cos(np.radians(down)), np.sin(np.radians(down))
    pose[:3, :3] = [[1, 0, 0], [0, cos, sin], [0, -sin, cos]]
    images = []
    for number in range(12):
        pose[:3, 3] = [0.014 * number, -1, 0]
        images.append(floor.simulate_depth(FLOOR_CAMERA, pose, sensor=sensor, seed=number, sensor_seed=1))
    return images


@pytest.mark.parametrize(
    ("sensor", "down"), [("stereo", 30), ("stereo", 70), ("structured_light", 30), ("phone_lidar", 70)]
)
def test_a_bare_floor_tells_nothing_of_who_passes_over_it(sensor: Any, down: float) -> None:
    # What pixels err by again and again looks like relief that agrees, where the camera has not moved.
    model = nacre.Model(FLOOR_CAMERA)
    for image in over_a_floor(sensor, down):
        model.add_frame(image)
    assert [report.status for report in model.frames[2:]] == 10 * ["WEAK"]
    shifts = [report.world_from_camera[0, 3] for report in model.frames if report.status == "TRACKED"]
    np.testing.assert_allclose(shifts, 0.014 * np.arange(len(shifts)), atol=0.01)


@pytest.mark.parametrize("sensor", ["stereo", "structured_light"])
def test_what_noise_decides_is_no_motion_that_goes_on(sensor: Any) -> None:
    model = nacre.Model(FLOOR_CAMERA)
    for image in over_a_floor(sensor, 30):
        model.add_frame(image)
    assert [report.status for report in model.frames[1:]] == 11 * ["WEAK"]
    assert max(np.linalg.norm(report.world_from_camera[:3, 3]) for report in model.frames) < 0.05


@pytest.mark.parametrize(("sensor", "down"), [("stereo", 30), ("stereo", 70), ("phone_lidar", 70)])
def test_nothing_is_found_again_that_was_open_before_images_were_lost(sensor: Any, down: float) -> None:
    model = nacre.Model(FLOOR_CAMERA)
    for number, image in enumerate(over_a_floor(sensor, down)):
        model.add_frame(np.full_like(image, np.nan) if number in (4, 8) else image)
    assert {report.status for report in model.frames[2:]} <= {"WEAK", "LOST"}


def test_a_model_goes_on_to_the_same_bits_while_directions_are_open(tmp_path: Path) -> None:
    images = over_a_floor("stereo", 30)
    model, saved = nacre.Model(FLOOR_CAMERA), nacre.Model(FLOOR_CAMERA)
    for image in images:
        model.add_frame(image)
        saved.add_frame(image)
        saved.save(tmp_path / "model")
        saved = nacre.Model.load(tmp_path / "model")
    assert [report.status for report in model.frames[2:]] == 10 * ["WEAK"]
    assert np.array_equal(saved.poses, model.poses)


def corridor() -> nacre.Mesh:
    """Return a corridor two metres wide, with door frames 5 cm deep on one side or the other."""
    corners = [((-1.1, 1.15, -4), (1.1, 1.25, 16)), ((-1.1, -1.45, -4), (1.1, -1.35, 16))]
    corners += [((x, -1.5, -4), (x + 0.1, 1.5, 16)) for x in (-1.1, 1.0)]
    corners += [((-1.5, -1.5, 14.95), (1.5, 1.5, 15.05))]
    for number, z in enumerate(np.arange(1, 15, 1.7)):
        left, right = (-1) ** number - 0.05, (-1) ** number + 0.05
        corners += [((left, -0.95, near - 0.05), (right, 1.15, near + 0.05)) for near in (z, z + 0.9)]
        corners += [((left, -1, z - 0.05), (right, -0.9, z + 0.95))]
    return boxes(*((np.array(low, float), np.array(high, float)) for low, high in corners))


@pytest.mark.parametrize("place", [0.6, 1.8, 2.4, 3.0, 4.8])
def test_walls_do_not_hold_a_camera_that_walks_along_a_corridor(place: float) -> None:
    # Frame and model fit where it was, too, but for the door frames, which then count as new.
    camera, scene = nacre.Camera(320, 240, 290, 290, 159.5, 119.5), corridor()
    model, pose = nacre.Model(camera), np.eye(4)
    for number in range(2):
        pose[2, 3] = place + 0.1 * number
        depth = scene.simulate_depth(camera, pose, sensor="structured_light", seed=number, sensor_seed=1)
        model.add_frame(depth)
    assert model.frames[1].tracked
    assert model.frames[1].world_from_camera[2, 3] == pytest.approx(0.1, abs=0.025)


def printed(points: Array, number: int) -> Array:
    """Return the brightness of a pattern with details of 5 to 30 cm, with the noise of an image."""
    random = np.random.default_rng(1)
    waves = random.normal(size=(20, 3))
    waves *= (random.uniform(10, 60, 20) / np.linalg.norm(waves, axis=1))[:, None]
    phases = random.uniform(0, 2 * np.pi, 20)
    pattern = sum(np.sin(points @ wave + phase) for wave, phase in zip(waves, phases, strict=True))
    noise = np.random.default_rng(number).normal(0, 3, points.shape[:2])
    return np.clip(np.nan_to_num(128 + 12 * pattern + noise), 0, 255).astype(np.uint8)


@pytest.mark.parametrize("seed", [0, 1])
def test_colours_tell_that_a_camera_moves_where_shared_errors_hold_it(seed: int) -> None:
    # By shape alone it stands still from the first frame on, and is sure of it.
    camera, scene = nacre.Camera(640, 480, 615, 615, 319.5, 239.5), wall_with_boxes()
    v, u = np.mgrid[0:480, 0:640]
    rays = np.stack([(u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, np.ones(u.shape)], axis=-1)
    model, pose = nacre.Model(camera), np.eye(4)
    for number in range(6):
        pose[0, 3] = 0.08 * number - 0.9
        depth = scene.simulate_depth(
            camera, pose, sensor="stereo", seed=100 * seed + number, sensor_seed=seed
        )
        points = scene.simulate_depth(camera, pose)[..., None] * rays + pose[:3, 3]
        model.add_frame(depth, color=np.repeat(printed(points, number)[..., None], 3, axis=-1))
    come = [report.world_from_camera[0, 3] for report in model.frames if report.tracked]
    assert len(come) == 6
    np.testing.assert_allclose(come, 0.08 * np.arange(6), atol=0.02)


@pytest.mark.parametrize("seed", [1, 4])
def test_a_straight_edge_does_not_lead_along_itself(seed: int) -> None:
    # A corner of two walls, one of which ends before a room, and a box at their foot, which leaves the view.
    camera = nacre.Camera(320, 240, 262, 262, 159.5, 119.5)
    scene = boxes(
        ([-0.35, -4, 1.0], [0.2, 4, 1.1]),
        ([0.2, -4, -1], [0.3, 4, 1.1]),
        ([-4, -4, 2.6], [4, 4, 2.7]),
        ([-0.1, 0.2, 0.85], [0.15, 0.5, 1.0]),
    )
    tilt = np.array([[np.cos(0.02), -np.sin(0.02), 0], [np.sin(0.02), np.cos(0.02), 0], [0, 0, 1]])
    model = nacre.Model(camera)
    for k in range(14):
        yaw = 0.002 * k - 0.05
        pose = np.eye(4)
        pose[:3, :3] = [[np.cos(yaw), 0, np.sin(yaw)], [0, 1, 0], [-np.sin(yaw), 0, np.cos(yaw)]] @ tilt
        pose[:3, 3] = [0.002 * k - 0.1, -0.012 * k, 0.002 * k]
        depth = scene.simulate_depth(camera, pose, noise="kinect", seed=100 * seed + k)
        report = model.add_frame(depth, guess=None if k else pose, keep_guess=not k)
        is_right = abs(report.world_from_camera[1, 3] - pose[1, 3]) < 0.005
        assert is_right or report.status == "WEAK", k
