"""A wall whose relief repeats and whose paint does not: what shape takes for one place looks otherwise."""

import functools

import numpy as np

import nacre

CAMERA = nacre.Camera(160, 120, 120.0, 120.0, 79.5, 59.5)
PERIOD = 64  # vertices
STEP = 0.04  # [m]
APART = PERIOD * STEP  # [m]
NUM_FRAMES = 12


@functools.cache
def wall() -> nacre.Mesh:
    """Return a wall of bumps, 1 m before cameras that look along z; after a period all comes again."""
    random = np.random.default_rng(3)
    bumps = np.tile(0.1 * random.uniform(-1, 1, (PERIOD, PERIOD)), (1, 3))
    rows, columns = bumps.shape
    y, x = STEP * np.indices(bumps.shape, float)
    corners = np.arange(bumps.size).reshape(rows, columns)
    a, b, c, d = (
        part.ravel() for part in (corners[:-1, :-1], corners[:-1, 1:], corners[1:, :-1], corners[1:, 1:])
    )
    triangles = np.concatenate([np.column_stack([a, c, b]), np.column_stack([b, c, d])])
    return nacre.Mesh(
        np.column_stack([x.ravel() - APART, y.ravel() - APART / 2, 1.0 + bumps.ravel()]), triangles
    )


def paint(points, size=0.05):
    random = np.random.default_rng(4)
    squares = random.integers(0, 256, (400, 400))
    cell = np.floor((points[:, :2] + 8.0) / size).astype(int)
    return np.repeat(squares[cell[:, 0], cell[:, 1], None], 3, axis=1).astype(np.uint8)


@functools.cache
def see(x, y=0.0, gain=1.0):
    """Return the depth and colour images of a camera."""
    v, u = np.indices((CAMERA.height, CAMERA.width))
    rays = np.stack([(u - CAMERA.cx) / CAMERA.fx, (v - CAMERA.cy) / CAMERA.fy, np.ones(u.shape)], axis=-1)
    rays = rays.reshape(-1, 3)
    origins = np.tile([x, y, 0.0], (len(rays), 1))
    depth = wall().cast(origins, rays).distances
    colors = paint(origins + depth[:, None] * rays).reshape(*u.shape, 3)
    noise = np.random.default_rng(5).normal(0, 0.002, u.shape)
    return (depth.reshape(u.shape) + noise).astype(np.float32), (gain * colors).astype(np.uint8)


def walked(with_color=True):
    """Return the model of a camera that went along the wall."""
    model = nacre.Model(CAMERA)
    for i in range(NUM_FRAMES):
        depth, color = see(0.05 * i)
        assert model.add_frame(depth, color if with_color else None).status == "TRACKED"
    return model


def off_by(report, x, y=0.0):
    return np.linalg.norm(report.world_from_camera[:3, 3] - [x, y, 0.0])


def test_a_place_of_the_same_shape_that_looks_otherwise_is_not_taken_for_it() -> None:
    depth, color = see(APART)
    report = walked(with_color=False).add_frame(depth)
    assert report.status == "TRACKED"
    assert off_by(report, 0.0) < 0.02  # nothing tells that it is the next one

    model = walked()
    report = model.add_frame(depth, color)
    assert report.status == "LOST"
    # What looks alike is known, in other light, too.
    report = model.add_frame(*see(0.5, gain=0.5))
    assert report.status == "RELOCALISED"
    assert off_by(report, 0.5) < 0.02


def test_a_place_that_shape_tells_too_little_of_is_known_by_its_looks() -> None:
    """Half of the image and more is new."""
    place = (0.0, 0.4)
    depth, color = see(*place)
    assert walked(with_color=False).add_frame(depth).status == "LOST"
    report = walked().add_frame(depth, color)
    assert report.status == "TRACKED"
    assert off_by(report, *place) < 0.02


def test_a_model_that_was_saved_knows_how_alike_its_frames_look(tmp_path) -> None:
    depth, color = see(0.0, 0.4)
    model = walked()
    model.save(tmp_path / "wall.nacre")
    pose = model.add_frame(depth, color).world_from_camera
    again = nacre.Model.load(tmp_path / "wall.nacre").add_frame(depth, color)
    assert again.status == "TRACKED"
    assert np.array_equal(again.world_from_camera, pose)
