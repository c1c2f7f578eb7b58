"""Surfaces that are known, models of them, and frames that show nothing of them."""

import functools
from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

import nacre

Array = npt.NDArray[Any]

FLAT = nacre.Camera.orthographic(width=100, height=80, pixel_size=0.001)
PINHOLE = nacre.Camera(width=160, height=120, fx=150, fy=150, cx=79.5, cy=59.5)


def shifted(x: float = 0.0, y: float = 0.0, z: float = 0.0) -> Array:
    pose = np.eye(4)
    pose[:3, 3] = (x, y, z)
    return pose


def moved(pose: Array, points: Array) -> Array:
    return points @ pose[:3, :3].T + pose[:3, 3]


def flat_grid(pose: Array | None = None) -> tuple[Array, Array]:
    """Return the world's x and y of each pixel of the orthographic camera."""
    v, u = np.indices((80, 100))
    x, y = (u - 49.5) * 0.001, (v - 39.5) * 0.001
    return (x, y) if pose is None else (x + pose[0, 3], y + pose[1, 3])


def ball(center: Any = (0.0, 0.0, 0.3), radius: float = 0.03, pose: Array | None = None) -> Array:
    """Return the depth of a sphere in the orthographic camera."""
    x, y = flat_grid(pose)
    squared = radius**2 - (x - center[0]) ** 2 - (y - center[1]) ** 2
    return center[2] - np.where(squared > 0, np.sqrt(np.maximum(squared, 0)), np.nan)


def slope(pose: Array | None = None) -> Array:
    """Return the depth of a slanted plane in the orthographic camera."""
    x, y = flat_grid(pose)
    return 0.3 + 0.3 * x - 0.2 * y


def off_slope(points: Array) -> Array:
    """Return the signed distance of points from the slanted plane."""
    return (points[:, 2] - 0.3 - 0.3 * points[:, 0] + 0.2 * points[:, 1]) / np.sqrt(1 + 0.3**2 + 0.2**2)


def relief(pose: Array | None = None) -> Array:
    """Return the depth of a surface without symmetry in the orthographic camera."""
    x, y = flat_grid(pose)
    waves = np.sin(140 * x + 1) * np.cos(110 * y) + 0.6 * np.sin(90 * y + 60 * x)
    return 0.3 + 0.006 * waves + 0.1 * x


@functools.cache
def thing() -> nacre.Mesh:
    return nacre.built_in_object()


@functools.cache
def view(index: int, sigma: float = 0.0005) -> Array:
    """Return one of twelve views of the built-in object, every 30 degrees."""
    poses = nacre.turntable_poses(thing())
    return thing().simulate_depth(nacre.default_camera(thing()), poses[index], noise=sigma, seed=index)


def true_pose(index: int) -> Array:
    """Return the camera of a view in the frame of the first."""
    poses = nacre.turntable_poses(thing())
    return np.linalg.inv(poses[0]) @ poses[index]


def off_thing(points: Array) -> Array:
    """Return the distances of points of the first camera's frame from the built-in object."""
    return thing().distance(moved(nacre.turntable_poses(thing())[0], points))


def rms(values: Array) -> float:
    return float(np.sqrt(np.mean(np.square(values, dtype=np.float64))))


def state(model: nacre.Model) -> tuple[Any, ...]:
    """Return everything that a lost frame must leave as it is, as bytes."""
    colors = model.colors
    return (
        model.points.tobytes(),
        model.normals.tobytes(),
        model.confidence.tobytes(),
        None if colors is None else colors.tobytes(),
        model.spacing,
        model.in_camera()[0].tobytes(),
    )


def object_model(frames: int = 3, **changes: Any) -> nacre.Model:
    model = nacre.Model(nacre.default_camera(thing()), **changes)
    for index in range(frames):
        model.add_frame(view(index))
    return model


def few_pixels() -> Array:
    depth = np.full((224, 224), np.nan)
    depth[100:105, 100:110] = 0.3
    return depth


def random_plane() -> Array:
    v, u = np.indices((224, 224))
    return 0.25 + 0.0007 * u - 0.0004 * v


def other_object() -> Array:
    """Return a torus."""
    v, u = np.indices((224, 224)) - 111.5
    ring = np.hypot(u, v) - 80
    return np.where(np.abs(ring) < 25, 0.3 - 0.001 * np.sqrt(np.maximum(625 - ring**2, 0)), np.nan)


HOPELESS: dict[str, Callable[[], Array]] = {
    "NaN": lambda: np.full((224, 224), np.nan),
    "zeros": lambda: np.zeros((224, 224)),
    "inf": lambda: np.full((224, 224), np.inf),
    "negative": lambda: np.full((224, 224), -1.0),
    "50 pixels": few_pixels,
    "a plane": random_plane,
    "another object": other_object,
}
