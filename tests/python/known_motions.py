"""Clouds whose motion is known, and how far a pose is from it."""

import functools
from typing import Any

import numpy as np
import numpy.typing as npt

import nacre

Array = npt.NDArray[Any]
METHODS = ["symmetric", "point_to_plane", "point_to_point", "paper"]
CENTER = np.array([0.0, 0.0, 0.4])  # of the clouds below [m]


def rotation(vector: npt.ArrayLike) -> Array:
    """Rodrigues' formula."""
    vector = np.asarray(vector, dtype=np.float64)
    angle = np.linalg.norm(vector)
    if angle == 0:
        return np.eye(3)
    x, y, z = vector / angle
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def motion(vector: npt.ArrayLike, translation: npt.ArrayLike, center: npt.ArrayLike = CENTER) -> Array:
    """Return a turn about a centre, then a shift."""
    pose = np.eye(4)
    pose[:3, :3] = rotation(vector)
    pose[:3, 3] = np.asarray(center) - pose[:3, :3] @ center + translation
    return pose


def moved(pose: Array, points: Array) -> Array:
    return points @ pose[:3, :3].T + pose[:3, 3]


def turned(pose: Array, normals: Array) -> Array:
    return normals @ pose[:3, :3].T


def twist(pose: Array, truth: Array, center: Array) -> Array:
    """Return how a pose differs from the truth: a small turn about a point, and the shift of that point."""
    difference = pose @ np.linalg.inv(truth)
    r = difference[:3, :3]
    turn = 0.5 * np.array([r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]])
    return np.concatenate([turn, r @ center + difference[:3, 3] - center])


def errors(pose: Array, truth: Array, center: npt.ArrayLike = CENTER) -> tuple[float, float]:
    """Return the angle [degrees] and the shift of a centre of the target frame [m] between two poses."""
    difference = twist(pose, truth, np.asarray(center))
    return float(np.degrees(np.linalg.norm(difference[:3]))), float(np.linalg.norm(difference[3:]))


@functools.cache
def built_in_triangles() -> tuple[Array, Array]:
    """Return the corners of the built-in object's triangles about CENTER, and normals as long as areas."""
    thing = nacre.built_in_object()
    corners = thing.vertices[thing.triangles] - thing.bounds.mean(axis=0) + CENTER
    return corners, 0.5 * np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


def sampled(count: int, seed: int) -> tuple[Array, Array]:
    """Return points of the built-in object's surface about CENTER, spread at random, and their normals."""
    corners, normals = built_in_triangles()
    areas = np.linalg.norm(normals, axis=1)
    rng = np.random.default_rng(seed)
    chosen = rng.choice(len(areas), count, p=areas / areas.sum())
    points = np.einsum("nk,nkd->nd", rng.dirichlet((1, 1, 1), count), corners[chosen])
    return points, normals[chosen] / areas[chosen, None]


TRUTH = motion([0.06, -0.1, 0.05], [0.004, -0.006, 0.003])


def source_of(cloud: tuple[Array, Array], truth: Array = TRUTH) -> tuple[Array, Array]:
    inverse = np.linalg.inv(truth)
    return moved(inverse, cloud[0]), turned(inverse, cloud[1])


def plane(seed: int, count: int = 2500) -> tuple[Array, Array]:
    rng = np.random.default_rng(seed)
    points = np.column_stack([rng.uniform(-0.1, 0.1, (count, 2)), np.full(count, 0.4)])
    return points, np.tile([0.0, 0.0, -1.0], (count, 1))


def sphere(seed: int, count: int = 2500) -> tuple[Array, Array]:
    normals = np.random.default_rng(seed).normal(size=(count, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return CENTER + 0.08 * normals, normals


def cylinder(seed: int, count: int = 2500) -> tuple[Array, Array]:
    rng = np.random.default_rng(seed)
    angle = rng.uniform(0, 2 * np.pi, count)
    normals = np.column_stack([np.cos(angle), np.zeros(count), np.sin(angle)])
    return CENTER + 0.05 * normals + np.outer(rng.uniform(-0.15, 0.15, count), [0, 1, 0]), normals
