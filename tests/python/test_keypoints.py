"""A painted relief, seen from places too far apart for registration: what colour images show leads there."""

import functools

import numpy as np

import nacre

CAMERA = nacre.Camera(160, 120, 120.0, 120.0, 79.5, 59.5)
SIDE = 81  # vertices
SIZE = 4.0  # [m]


@functools.cache
def relief() -> nacre.Mesh:
    """Return a wall of bumps, 1 m before cameras that look along z."""
    random = np.random.default_rng(3)
    x, y = np.meshgrid(*[np.linspace(-SIZE / 2, SIZE / 2, SIDE)] * 2)
    z = 1.0 + 0.08 * random.uniform(-1, 1, x.shape)
    corners = np.arange(SIDE**2).reshape(SIDE, SIDE)
    a, b, c, d = (
        part.ravel() for part in (corners[:-1, :-1], corners[:-1, 1:], corners[1:, :-1], corners[1:, 1:])
    )
    triangles = np.concatenate([np.column_stack([a, c, b]), np.column_stack([b, c, d])])
    return nacre.Mesh(np.column_stack([x.ravel(), y.ravel(), z.ravel()]), triangles)


def paint(points):
    """Return the colours of squares of 7 and of 3 cm."""
    random = np.random.default_rng(4)
    brightness = 0.0
    for size in (0.07, 0.03):
        squares = random.integers(0, 128, (int(2 * SIZE / size),) * 2)
        cell = np.floor((points[:, :2] + SIZE) / size).astype(int) % len(squares)
        brightness = brightness + squares[cell[:, 0], cell[:, 1]]
    return np.repeat(brightness[:, None], 3, axis=1).astype(np.uint8)


def pose_at(x, y=0.0, roll=0.0):
    pose = np.eye(4)
    pose[:2, :2] = [[np.cos(roll), -np.sin(roll)], [np.sin(roll), np.cos(roll)]]
    pose[:2, 3] = x, y
    return pose


@functools.cache
def see(x, y=0.0, roll=0.0):
    """Return the depth and colour images of a camera."""
    pose = pose_at(x, y, roll)
    v, u = np.indices((CAMERA.height, CAMERA.width))
    rays = np.stack([(u - CAMERA.cx) / CAMERA.fx, (v - CAMERA.cy) / CAMERA.fy, np.ones(u.shape)], axis=-1)
    rays = rays.reshape(-1, 3) @ pose[:3, :3].T
    origins = np.broadcast_to(pose[:3, 3], rays.shape)
    depth = relief().cast(origins, rays).distances
    colors = paint(origins + depth[:, None] * rays).reshape(*u.shape, 3)
    noise = np.random.default_rng(5).normal(0, 0.001, u.shape)
    return (depth.reshape(u.shape) + noise).astype(np.float32), colors


def is_right(report, *place):
    found, expected = report.world_from_camera, np.linalg.inv(pose_at(0.0)) @ pose_at(*place)
    turn = (np.trace(found[:3, :3].T @ expected[:3, :3]) - 1) / 2
    return np.linalg.norm(found[:3, 3] - expected[:3, 3]) < 0.01 and turn > np.cos(0.01)


def add(model, place, with_color=True):
    depth, color = see(*place)
    return model.add_frame(depth, color if with_color else None)


JUMP = (0.5, 0.1, 0.5)
"""Half of the image is new, and the camera has turned by 29 degrees."""


def test_a_camera_that_went_far_from_one_image_to_the_next_is_found_by_what_they_show() -> None:
    for with_color in (True, False):
        model = nacre.Model(CAMERA)
        for x in (0.0, 0.02, 0.04):
            assert is_right(add(model, (x,), with_color), x)
        report = add(model, JUMP, with_color)
        assert (report.status != "LOST" and is_right(report, *JUMP)) == with_color
        assert report.status == "LOST" or is_right(report, *JUMP)


def test_a_lost_camera_is_found_by_what_earlier_images_show() -> None:
    model = nacre.Model(CAMERA)
    for x in np.arange(0.0, 1.2, 0.05):
        assert is_right(add(model, (round(x, 2),)), round(x, 2))
    nothing = np.full((CAMERA.height, CAMERA.width), np.nan, np.float32)
    for _ in range(3):
        assert model.add_frame(nothing).status == "LOST"
    report = add(model, (0.1, 0.1, 1.2))
    assert report.status == "RELOCALISED"
    assert is_right(report, 0.1, 0.1, 1.2)


def test_another_wall_is_not_taken_for_this_one() -> None:
    model = nacre.Model(CAMERA)
    for x in (0.0, 0.02, 0.04):
        add(model, (x,))
    depth, color = see(-1.2, -1.0)
    assert model.add_frame(depth, color).status == "LOST"


def test_any_number_of_threads_finds_the_same_and_so_does_a_model_that_was_saved(tmp_path) -> None:
    poses = []
    for num_threads in (1, 3):
        model = nacre.Model(CAMERA, num_threads=num_threads)
        for x in (0.0, 0.02, 0.04):
            add(model, (x,))
        model.save(tmp_path / "saved")
        loaded = nacre.Model.load(tmp_path / "saved")
        poses += [add(each, JUMP).world_from_camera for each in (model, loaded)]
    assert all(np.array_equal(pose, poses[0]) for pose in poses)
