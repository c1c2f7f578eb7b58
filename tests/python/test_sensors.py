"""Simulated sensors: where they err alike, in which steps, and where they see nothing."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import nacre

Array = npt.NDArray[Any]
SENSORS = ("stereo", "structured_light", "time_of_flight", "phone_lidar")
BASELINE = {"stereo": 0.05, "structured_light": 0.075}
STEP = {"stereo": 1 / 32, "structured_light": 1 / 8}
CAMERA = nacre.Camera(160, 120, 200, 200, 79.5, 59.5)
HERE = np.eye(4)


def quad(corner: Any, side: Any, other: Any) -> Array:
    """Return the corners of a parallelogram."""
    corner, side, other = (np.asarray(value, float) for value in (corner, side, other))
    return np.array([corner, corner + side, corner + side + other, corner + other])


def mesh(*quads: Array) -> nacre.Mesh:
    """Return a mesh of parallelograms."""
    triangles = [
        [4 * i + k for k in corners] for i in range(len(quads)) for corners in ([0, 1, 2], [0, 2, 3])
    ]
    return nacre.Mesh(np.concatenate(quads), np.array(triangles))


def wall(z: float) -> Array:
    """Return a wall across the view."""
    return quad((-9, -9, z), (18, 0, 0), (0, 18, 0))


@pytest.fixture(scope="module")
def board() -> nacre.Mesh:
    """Return a board before a wall."""
    return mesh(wall(2.0), quad((-0.2, -0.2, 1.0), (0.4, 0, 0), (0, 0.4, 0)))


def errors(sensor: Any, count: int = 4, **options: Any) -> Array:
    """Return the errors of images of a wall at 1 m."""
    scene = mesh(wall(1.0))
    return (
        np.array([scene.simulate_depth(CAMERA, HERE, sensor=sensor, seed=i, **options) for i in range(count)])
        - 1
    )


def correlation(a: Array, b: Array) -> float:
    """Return that of two images."""
    both = np.isfinite(a) & np.isfinite(b)
    return float(np.corrcoef(a[both], b[both])[0, 1])


@pytest.mark.parametrize("sensor", SENSORS)
def test_a_wall_is_where_it_is(sensor: Any) -> None:
    error = errors(sensor)
    assert np.isfinite(error).mean() > 0.8
    assert abs(np.nanmean(error)) < 0.003
    assert 0.001 < np.nanstd(error) < 0.02


@pytest.mark.parametrize(
    ("sensor", "least"), [("stereo", 0.8), ("structured_light", 0.3), ("phone_lidar", 0.9)]
)
def test_neighbours_err_alike(sensor: Any, least: float) -> None:
    error = errors(sensor)
    assert correlation(error[..., 2:], error[..., :-2]) > least
    assert abs(correlation(error[..., 60:], error[..., :-60])) < 0.25


@pytest.mark.parametrize("sensor", ["stereo", "structured_light", "phone_lidar"])
def test_images_of_one_sensor_share_a_part(sensor: Any) -> None:
    error = errors(sensor, 2)
    assert 0.1 < correlation(error[0], error[1]) < 0.95
    other = errors(sensor, 2, sensor_seed=7)
    assert abs(correlation(error[0], other[1])) < 0.25


@pytest.mark.parametrize("sensor", BASELINE)
def test_disparity_has_steps(sensor: Any) -> None:
    slope = mesh(wall(1.2) @ np.array([[1, 0, 0.3], [0, 1, 0], [0, 0, 1]]))
    depth = slope.simulate_depth(CAMERA, HERE, sensor=sensor)
    steps = CAMERA.fx * BASELINE[sensor] / depth[np.isfinite(depth)] / STEP[sensor]
    np.testing.assert_allclose(steps, np.round(steps), atol=1e-3)
    assert len(np.unique(np.round(steps))) > 10


@pytest.mark.parametrize("sensor", BASELINE)
def test_the_second_eye_sees_no_wall_left_of_the_board(sensor: Any, board: nacre.Mesh) -> None:
    depth = board.simulate_depth(CAMERA, HERE, sensor=sensor)
    # The board covers the columns 40 to 119; its shadow is as wide as disparity changes at its edge.
    shadow = CAMERA.fx * BASELINE[sensor] * (1 / 1.0 - 1 / 2.0)
    missing = np.isnan(depth[40:80])
    left = missing[:, 25:42].sum(axis=1).mean()
    assert left == pytest.approx(shadow, abs=1.5)
    assert missing[:, 118:135].sum(axis=1).mean() < 1
    assert missing[:, 45:115].mean() < 0.05


@pytest.mark.parametrize("sensor", ["time_of_flight", "phone_lidar"])
def test_pixels_at_edges_are_between_the_surfaces(sensor: Any, board: nacre.Mesh) -> None:
    depth = board.simulate_depth(CAMERA, HERE, sensor=sensor)[45:75]
    flying = (depth > 1.1) & (depth < 1.9)
    assert flying[:, 116:124].mean() > 0.1
    assert flying[:, 55:105].mean() == 0
    assert flying[:, 135:].mean() == 0


def test_grazing_surfaces_are_holes() -> None:
    floor = mesh(quad((-9, 0.1, 0.1), (18, 0, 0), (0, 0, 18)))
    for sensor in ("stereo", "structured_light"):
        depth = floor.simulate_depth(CAMERA, HERE, sensor=sensor)
        seen = np.isfinite(depth).mean(axis=1)
        assert seen[-5:].mean() > 0.5 > 0.05 > seen[64:70].mean()


def test_a_concave_corner_is_rounded_by_time_of_flight() -> None:
    corner = mesh(quad((0, -2, 2), (2, 0, -2), (0, 4, 0)), quad((0, -2, 2), (-2, 0, -2), (0, 4, 0)))
    images = [
        corner.simulate_depth(CAMERA, HERE, sensor="time_of_flight", seed=seed)
        - corner.simulate_depth(CAMERA, HERE)
        for seed in range(4)
    ]
    bias = np.nanmean(images, axis=(0, 1))
    flat = np.nanmean(errors("time_of_flight"))
    assert bias[70:90].mean() > 0.01
    assert bias[20:140].min() > flat
    convex = mesh(quad((0, -2, 1), (2, 0, 2), (0, 4, 0)), quad((0, -2, 1), (-2, 0, 2), (0, 4, 0)))
    error = convex.simulate_depth(CAMERA, HERE, sensor="time_of_flight") - convex.simulate_depth(CAMERA, HERE)
    assert abs(np.nanmean(error[:, :70])) < 0.003


def test_time_of_flight_has_the_published_noise() -> None:
    for z in (1.0, 2.0):
        error = mesh(wall(z)).simulate_depth(CAMERA, HERE, sensor="time_of_flight") - z
        published = nacre.NoiseModel.time_of_flight().sigma(z)
        assert 0.9 * published < np.nanstd(error[30:90, 50:110]) < 1.3 * published


def test_a_telephone_sees_few_points() -> None:
    """What is narrower than a point's distance to the next is lost, or filled in."""
    poles = [quad((x, -2, 1.0), (0.006, 0, 0), (0, 4, 0)) for x in (-0.3, -0.1, 0.1, 0.3)]
    scene = mesh(wall(2.0), *poles)
    assert (scene.simulate_depth(CAMERA, HERE) < 1.5).mean() > 0.01
    seen = scene.simulate_depth(CAMERA, HERE, sensor="phone_lidar") < 1.5
    assert seen.mean() < 0.005
    depth = mesh(wall(1.3)).simulate_depth(CAMERA, HERE, sensor="phone_lidar")
    np.testing.assert_array_equal(depth * 1024, np.round(depth * 1024))  # half precision


@pytest.mark.parametrize("sensor", SENSORS)
def test_threads_and_seeds(sensor: Any, board: nacre.Mesh) -> None:
    images = [
        board.simulate_depth(CAMERA, HERE, sensor=sensor, seed=3, num_threads=threads)
        for threads in (1, 2, 3)
    ]
    np.testing.assert_array_equal(images[0], images[1])
    np.testing.assert_array_equal(images[0], images[2])
    other = board.simulate_depth(CAMERA, HERE, sensor=sensor, seed=4)
    assert not np.array_equal(images[0], other, equal_nan=True)


@pytest.mark.parametrize("sensor", SENSORS)
def test_any_depth_kind_and_nothing_in_view(sensor: Any, board: nacre.Mesh) -> None:
    distorted = (-0.2, 0.05, 0.001, -0.002, 0.0)
    for camera in (
        nacre.Camera(160, 120, 200, 200, 79.5, 59.5, depth="radial"),
        nacre.Camera(160, 120, 200, 200, 79.5, 59.5, distortion=distorted),
    ):
        error = board.simulate_depth(camera, HERE, sensor=sensor) - board.simulate_depth(camera, HERE)
        assert np.nanmedian(np.abs(error)) < 0.04
    away = np.eye(4)
    away[2, 3] = 5.0
    assert np.isnan(board.simulate_depth(CAMERA, away, sensor=sensor)).all()
    tiny = nacre.Camera(1, 1, 10, 10, 0, 0)
    assert board.simulate_depth(tiny, HERE, sensor=sensor).shape == (1, 1)


@pytest.mark.parametrize(
    ("options", "error", "message"),
    [
        ({"sensor": "radar"}, ValueError, "sensor must be one of 'none', 'stereo', .* got 'radar'"),
        ({"sensor": None}, TypeError, "sensor must be of type Sensor, got None"),
        ({"sensor": "stereo", "edge_mixing": 1}, ValueError, "edge_mixing must be 0 with a sensor, .* got 1"),
        ({"sensor": "stereo", "sensor_seed": -1}, TypeError, "sensor_seed must be .*, got -1"),
    ],
)
def test_misuse_names_the_option(options: Any, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        mesh(wall(1.0)).simulate_depth(CAMERA, HERE, **options)


def test_a_sensor_needs_a_pinhole_camera() -> None:
    camera = nacre.Camera.orthographic(8, 8, 0.01)
    with pytest.raises(
        ValueError, match="camera must be a pinhole camera for a sensor, got an orthographic one"
    ):
        mesh(wall(1.0)).simulate_depth(camera, HERE, sensor="stereo")
