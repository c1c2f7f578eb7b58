"""Clouds with known truth."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[Any]


def bumps(directions: Array, frequencies: tuple[float, float], seed: int = 7) -> tuple[Array, Array]:
    """Return a smooth function on the sphere, about -1 to 1, and its gradient in space."""
    rng = np.random.default_rng(seed)
    waves = rng.normal(size=(12, 3))
    waves *= rng.uniform(*frequencies, size=(12, 1)) / np.linalg.norm(waves, axis=1, keepdims=True)
    phases = rng.uniform(0, 2 * np.pi, 12)
    angles = directions @ waves.T + phases
    return np.sin(angles).sum(axis=1) / 6, np.cos(angles) @ waves / 6


def bumpy_surface(
    directions: Array,
    radius: float = 0.075,
    height: float = 0.06,
    frequencies: tuple[float, float] = (3, 9),
) -> tuple[Array, Array]:
    """Return points, and their normals, of a closed surface without symmetry, in the given directions."""
    values, gradients = bumps(directions, frequencies)
    lengths = radius * (1 + height * values)[:, None]
    slopes = radius * height * (gradients - (gradients * directions).sum(axis=1, keepdims=True) * directions)
    normals = directions - slopes / lengths
    return lengths * directions, normals / np.linalg.norm(normals, axis=1, keepdims=True)


def scan(size: int, seed: int) -> tuple[Array, Array]:
    """
    Return noisy points of the bumpy surface, 0.15 m wide, in random order, and the true normals.

    The noise is 0.5 mm up to 100,000 points, and beyond them in proportion to their spacing, so that
    neighbours lie on a surface for any size.
    """
    sigma = 0.0005 * min(1.0, (100_000 / size) ** 0.5)
    rng = np.random.default_rng(seed)
    directions = rng.normal(size=(size, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    points, normals = bumpy_surface(directions)
    return points + sigma * rng.normal(size=points.shape), normals


@lru_cache(maxsize=2)
def cloud(size: int, seed: int = 1, ordered: bool = False) -> dict[str, Array]:
    """Return a scan as float32 and, with the same values, as float64; along a Morton curve if ordered."""
    points, normals = scan(size, seed)
    single = points.astype(np.float32)
    if ordered:
        order = np.argsort(morton_codes(single), kind="stable")
        single, normals = single[order], normals[order]
    return {"points": single, "points64": single.astype(np.float64), "normals": normals}


def morton_codes(points: Array) -> Array:
    """Return the place of each point along a Morton curve of 21 bits an axis."""
    low = points.min(axis=0)
    cells = ((points - low) * ((2**21 - 1) / np.ptp(points, axis=0).max())).astype(np.uint64)
    for shift, mask in (
        (32, 0x1F00000000FFFF),
        (16, 0x1F0000FF0000FF),
        (8, 0x100F00F00F00F00F),
        (4, 0x10C30C30C30C30C3),
        (2, 0x1249249249249249),
    ):
        cells = (cells | (cells << np.uint64(shift))) & np.uint64(mask)
    codes: Array = cells[:, 0] | cells[:, 1] << np.uint64(1) | cells[:, 2] << np.uint64(2)
    return codes


def rotation(axis: Any, degrees: float) -> Array:
    """Return the 3x3 rotation about an axis."""
    x, y, z = np.asarray(axis, dtype=float) / np.linalg.norm(axis)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    angle = np.radians(degrees)
    turn: Array = np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
    return turn


def degrees_between(a: Array, b: Array) -> float:
    """Return the angle of the rotation between two poses or rotations [deg]."""
    difference = a[:3, :3].T @ b[:3, :3]
    sine = np.linalg.norm(difference - difference.T) / np.sqrt(8)
    return float(np.degrees(np.arctan2(sine, (np.trace(difference) - 1) / 2)))
