import inspect
from pathlib import Path

import numpy as np
import pytest

import nacre
from nacre import _core

DATA = Path(__file__).parents[3] / "shared" / "data"
needs_data = pytest.mark.skipif(not DATA.is_dir(), reason="no recordings in ../shared/data")

DISTORTION = (-0.25, 0.08, 0.001, -0.002, 0.01)
CAMERAS = {
    "pinhole": nacre.Camera(120, 90, 110, 112, 60.2, 44.0),
    "distorted": nacre.Camera(120, 90, 110, 112, 60.2, 44.0, distortion=DISTORTION),
    "radial": nacre.Camera(120, 90, 110, 112, 60.2, 44.0, depth="radial"),
    "distorted radial": nacre.Camera(120, 90, 110, 112, 60.2, 44.0, distortion=DISTORTION, depth="radial"),
    "orthographic": nacre.Camera.orthographic(120, 90, 0.003),
}
WALL = np.array([[-9, -9, 2], [9, -9, 2], [9, 9, 2], [-9, 9, 2]], dtype=float)
WALL_TRIANGLES = np.array([[0, 1, 2], [0, 2, 3]])
CUBE = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)]) * 0.2
CUBE_TRIANGLES = np.array(
    [
        *([0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1]),
        *([2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]),
    ]
)


@pytest.fixture(scope="module")
def snail():
    return nacre.built_in_object()


def pose_at(translation, rotation=(0, 0, 0)):
    angle = np.linalg.norm(rotation)
    x, y, z = np.asarray(rotation) / (angle or 1)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    pose = np.eye(4)
    pose[:3, :3] += np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
    pose[:3, 3] = translation
    return pose


def to_world(depth, camera, pose):
    return nacre.back_project(depth, camera).astype(float) @ pose[:3, :3].T + pose[:3, 3]


@pytest.mark.parametrize("name", CAMERAS)
def test_a_turned_cube_is_seen_on_its_faces(name):
    pose = pose_at((0.03, -0.02, -0.6), (0.1, -0.2, 0.3))
    turn = pose_at((0, 0, 0), (0.5, 0.6, -0.3))[:3, :3]
    depth = nacre.simulate_depth(CUBE @ turn.T, CUBE_TRIANGLES, CAMERAS[name], pose)
    assert depth.dtype == np.float32
    assert depth.shape == (90, 120)
    assert np.isfinite(depth).sum() > 800
    inside = np.abs(to_world(depth, CAMERAS[name], pose) @ turn)
    np.testing.assert_allclose(inside.max(axis=1), 0.1, atol=1e-7)
    # Three faces are in view, each nearer than the one behind it.
    camera_in_cube = (pose[:3, 3] if name != "orthographic" else -10 * pose[:3, 2]) @ turn
    points = to_world(depth, CAMERAS[name], pose) @ turn
    face = np.abs(points).argmax(axis=1)
    assert set(face) == {0, 1, 2}
    assert (np.sign(points[np.arange(len(face)), face]) == np.sign(camera_in_cube[face])).all()


@pytest.mark.parametrize("name", CAMERAS)
def test_every_pixel_of_the_built_in_object_lies_on_it(snail, name):
    for pose in nacre.turntable_poses(snail, 3, np.radians(120), distance=0.25, elevation=0.3):
        depth = snail.simulate_depth(CAMERAS[name], pose)
        assert np.isfinite(depth).sum() > 500
        assert snail.distance(to_world(depth, CAMERAS[name], pose)).max() < 1e-7


def test_a_mesh_and_its_arrays_give_the_same_image(snail):
    pose = nacre.turntable_poses(snail)[4]
    camera = nacre.default_camera(snail)
    options = {"noise": "kinect", "edge_mixing": True, "quantization": 0.0001, "dropout": 0.1, "seed": 9}
    depth = snail.simulate_depth(camera, pose, **options)
    np.testing.assert_array_equal(
        nacre.simulate_depth(snail.vertices, snail.triangles, camera, pose, **options), depth
    )
    np.testing.assert_array_equal(snail.simulate_depth(camera, pose, **options, num_threads=3), depth)
    np.testing.assert_array_equal(
        snail.simulate_depth(camera, pose, **{**options, "edge_mixing": 1.0}), depth
    )


def test_moving_mesh_and_camera_together_changes_nothing(snail):
    move = pose_at((3e6, -2e6, 5e5), (0.3, 1.2, -0.4))
    pose = nacre.turntable_poses(snail)[1]
    camera = nacre.default_camera(snail, "pinhole")
    moved = snail.vertices.astype(float) @ move[:3, :3].T + move[:3, 3]
    here = snail.simulate_depth(camera, pose)
    there = nacre.simulate_depth(moved, snail.triangles, camera, move @ pose)
    both = np.isfinite(here) & np.isfinite(there)
    assert both.sum() > 0.999 * np.isfinite(here).sum()
    assert np.median(np.abs(here - there)[both]) < 1e-8
    assert np.quantile(np.abs(here - there)[both], 0.999) < 1e-6


@pytest.mark.parametrize(
    ("noise", "sigma"),
    [
        (0.003, 0.003),
        (np.float32(0.003), 0.003),
        ("kinect", 0.0012 + 0.0019 * 1.6**2),
        (nacre.NoiseModel(0.001, 0.002, 1.0), 0.003),
    ],
)
def test_noise(noise, sigma):
    camera = nacre.Camera.orthographic(200, 200, 0.001)
    error = nacre.simulate_depth(WALL, WALL_TRIANGLES, camera, np.eye(4), noise=noise, seed=1) - np.float64(2)
    assert error.std() == pytest.approx(sigma, rel=0.02)
    assert abs(error.mean()) < 4 * sigma / 200
    other = nacre.simulate_depth(WALL, WALL_TRIANGLES, camera, np.eye(4), noise=noise, seed=2) - np.float64(2)
    assert abs((error * other).mean()) < 4 * sigma**2 / 200


def test_mixed_pixels_are_those_beside_edges(snail):
    camera = nacre.default_camera(snail)
    pose = nacre.turntable_poses(snail)[0]
    exact = snail.simulate_depth(camera, pose)
    mixed = snail.simulate_depth(camera, pose, edge_mixing=1)
    seen = np.isfinite(exact)
    changed = ~((mixed == exact) | (np.isnan(mixed) & ~seen))
    # Pixels appear around the silhouette, none farther than one pixel from it, and none goes.
    around = np.zeros_like(seen)
    for u in (-1, 0, 1):
        for v in (-1, 0, 1):
            around |= np.roll(seen, (u, v), axis=(0, 1))
    assert not (np.isfinite(mixed) & ~around).any()
    assert np.isfinite(mixed[seen]).all()
    assert (np.isfinite(mixed) & ~seen).sum() > 200
    # They float in the air; the others stay exactly where they were.
    assert 0.1 < changed.mean() / seen.mean() < 0.3
    distances = snail.distance(to_world(np.where(changed, mixed, np.nan), camera, pose))
    assert (distances > 0.0005).mean() > 0.4
    # Every mixture lies between what its neighbours see and the background.
    farthest = np.nanmax(exact) + 0.1 * np.linalg.norm(np.subtract(*snail.bounds))
    assert np.nanmin(mixed) >= np.nanmin(exact)
    assert np.nanmax(mixed) < farthest


def test_background_depth():
    camera = nacre.Camera.orthographic(40, 40, 0.01)
    cube = nacre.Mesh(CUBE, CUBE_TRIANGLES)
    near = cube.simulate_depth(camera, pose_at((0.003, 0.004, -1)), edge_mixing=1, background_depth=1.0)
    far = cube.simulate_depth(camera, pose_at((0.003, 0.004, -1)), edge_mixing=1, background_depth=5.0)
    assert 0.9 < np.nanmax(near) < 1.0
    assert 1.0 < np.nanmax(far) < 5.0
    np.testing.assert_array_equal(np.isnan(near), np.isnan(far))


def test_quantization_and_dropout():
    camera = nacre.Camera.orthographic(300, 300, 0.001)
    slope = WALL + np.outer(WALL[:, 0], (0, 0, 0.3))
    depth = nacre.simulate_depth(slope, WALL_TRIANGLES, camera, np.eye(4), quantization=0.01, dropout=0.25)
    assert np.isnan(depth).mean() == pytest.approx(0.25, abs=0.01)
    assert set(np.unique(np.round(depth[np.isfinite(depth)] * 100))) <= set(range(195, 206))
    np.testing.assert_allclose(depth * 100 % 1, np.round(depth * 100 % 1), atol=1e-4)


def test_nothing_in_view():
    camera = CAMERAS["pinhole"]
    for edge_mixing in (0, 1):
        depth = nacre.simulate_depth(
            WALL, WALL_TRIANGLES, camera, pose_at((0, 0, 3)), edge_mixing=edge_mixing
        )
        assert np.isnan(depth).all()


def test_a_single_pixel():
    for camera in (nacre.Camera.orthographic(1, 1, 0.01), nacre.Camera(1, 1, 10, 10, 0, 0)):
        depth = nacre.simulate_depth(WALL, WALL_TRIANGLES, camera, np.eye(4), edge_mixing=2)
        np.testing.assert_array_equal(depth, [[2]])


def test_defaults_are_those_of_the_core():
    options = _core.SimulationOptions()
    for function in (nacre.simulate_depth, nacre.Mesh.simulate_depth):
        defaults = {
            name: parameter.default
            for name, parameter in inspect.signature(function).parameters.items()
            if parameter.kind is inspect.Parameter.KEYWORD_ONLY
        }
        noise = (options.noise.constant, options.noise.quadratic, options.noise.offset)
        assert (defaults.pop("noise"), 0, 0) == noise
        assert defaults.pop("sensor") == options.sensor.name
        assert (defaults.pop("background_depth") or 0) == options.background_depth
        assert defaults == {name: getattr(options, name) for name in defaults}
        assert len(defaults) == 6


@pytest.mark.parametrize(
    ("options", "error", "message"),
    [
        ({"noise": -0.1}, ValueError, "noise"),
        ({"noise": np.nan}, ValueError, "noise"),
        ({"noise": "gaussian"}, ValueError, "noise must be .*'kinect'.* got 'gaussian'"),
        ({"noise": [1, 2]}, TypeError, "noise must be"),
        ({"edge_mixing": -1}, ValueError, "edge_mixing must be 0 to 16 pixels, got -1"),
        ({"edge_mixing": "wide"}, (TypeError, ValueError), "edge_mixing"),
        ({"background_depth": 0}, ValueError, "background_depth must be None or a positive length"),
        ({"background_depth": np.inf}, ValueError, "background_depth"),
        ({"quantization": -0.1}, ValueError, "quantization must be finite and at least 0"),
        ({"dropout": 1.5}, ValueError, "dropout must be 0 to 1, got 1.5"),
        ({"seed": -1}, (TypeError, ValueError), "seed"),
        ({"seed": 0.5}, (TypeError, ValueError), "seed"),
        ({"num_threads": -1}, ValueError, "num_threads must be at least 0, got -1"),
    ],
)
def test_misuse_names_the_option(options, error, message):
    with pytest.raises(error, match=message):
        nacre.simulate_depth(WALL, WALL_TRIANGLES, CAMERAS["pinhole"], np.eye(4), **options)


@pytest.mark.parametrize("pose", [np.eye(3), 2 * np.eye(4), np.full((4, 4), np.nan)])
def test_a_pose_that_is_none(pose):
    with pytest.raises(ValueError, match="world_from_camera"):
        nacre.simulate_depth(WALL, WALL_TRIANGLES, CAMERAS["pinhole"], pose)


@pytest.mark.parametrize("axis", [(0, 1, 0), (0, 0, -2), (1, 2, 3)])
def test_turntable_poses(snail, axis):
    poses = nacre.turntable_poses(snail, 8, np.radians(45), distance=0.4, elevation=0.3, axis=axis)
    center, up = snail.bounds.mean(axis=0), np.divide(axis, np.linalg.norm(axis))
    right, down, forward = poses[:, :3, 0], poses[:, :3, 1], poses[:, :3, 2]
    np.testing.assert_allclose(poses[:, :3, 3] + 0.4 * forward, np.tile(center, (8, 1)), atol=1e-12)
    np.testing.assert_allclose(right @ up, 0, atol=1e-12)
    np.testing.assert_allclose(down @ up, -np.cos(0.3), atol=1e-12)
    np.testing.assert_allclose(forward @ up, -np.sin(0.3), atol=1e-12)
    np.testing.assert_allclose(np.linalg.det(poses[:, :3, :3]), 1)
    step = poses[1] @ np.linalg.inv(poses[0])
    np.testing.assert_allclose(np.linalg.matrix_power(step, 7) @ poses[0], poses[7], atol=1e-12)
    assert np.trace(step[:3, :3]) == pytest.approx(1 + 2 * np.cos(np.radians(45)))
    np.testing.assert_allclose(step[:3, :3] @ up, up, atol=1e-12)
    turn = np.array([step[2, 1] - step[1, 2], step[0, 2] - step[2, 0], step[1, 0] - step[0, 1]])
    assert turn @ up > 0


def test_the_first_camera_of_a_turntable(snail):
    pose = nacre.turntable_poses(snail.vertices)[0]
    np.testing.assert_allclose(pose[:3, :3], np.diag([1, -1, -1]), atol=1e-15)
    assert nacre.turntable_poses(snail).shape == (12, 4, 4)
    depth = snail.simulate_depth(nacre.default_camera(snail), pose)
    rows, columns = np.nonzero(np.isfinite(depth))
    ears = columns[rows == rows.min()]
    assert rows.min() + rows.max() == pytest.approx(223, abs=2)
    assert ears.mean() > 120  # up and to the right


@pytest.mark.parametrize("model", ["orthographic", "pinhole"])
def test_default_cameras_see_the_whole_object(snail, model):
    camera = nacre.default_camera(snail, model)
    for elevation in (0, 0.7, -1.2):
        for pose in nacre.turntable_poses(snail, 6, np.radians(60), camera=camera, elevation=elevation):
            local = (snail.vertices - pose[:3, 3]) @ pose[:3, :3]
            pixels = camera.project(local)
            assert (local[:, 2] > 0.05).all()
            assert (pixels > 1).all()
            assert (pixels < (camera.width - 2, camera.height - 2)).all()
    assert np.ptp(pixels, axis=0).max() > 0.5 * camera.height
    if model == "orthographic":
        assert camera.pixel_size == 0.001


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"num_views": 0}, "num_views"),
        ({"step": np.nan}, "step"),
        ({"distance": 0}, "distance"),
        ({"elevation": 2}, "elevation"),
        ({"axis": (0, 0, 0)}, "axis"),
        ({"axis": (0, 1)}, "axis"),
        ({"camera": nacre.Camera(9, 9, 5, 5, -1, 4)}, "distance"),
    ],
)
def test_misuse_of_turntables(options, message):
    with pytest.raises(ValueError, match=message):
        nacre.turntable_poses(WALL, **options)


def test_misuse_of_default_cameras():
    with pytest.raises(ValueError, match="model must be 'orthographic' or 'pinhole', got 'fisheye'"):
        nacre.default_camera(WALL, "fisheye")
    with pytest.raises(ValueError, match="at least one vertex"):
        nacre.default_camera(np.zeros((0, 3)))
    with pytest.raises(ValueError, match="extent"):
        nacre.default_camera(np.zeros((5, 3)))


@needs_data
@pytest.mark.data
def test_the_stanford_bunny():
    bunny = nacre.read_mesh(DATA / "stanford-bunny" / "reconstruction" / "bun_zipper.ply")
    camera = nacre.default_camera(bunny)
    assert camera == nacre.Camera.orthographic(256, 256, 0.001)
    for pose in nacre.turntable_poses(bunny):
        depth = bunny.simulate_depth(camera, pose)
        assert 9000 < np.isfinite(depth).sum() < 15000
        assert bunny.distance(to_world(depth, camera, pose)).max() < 1e-7
