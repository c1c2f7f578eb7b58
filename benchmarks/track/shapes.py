"""Shapes along which a camera may slide: their recordings must be called weak."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from track.rows import Places


def wall(places: Places) -> Path:
    """Return a plane that fills the view."""
    corners = np.array([[-4, -4, 0], [4, -4, 0], [4, 4, 0], [-4, 4, 0]], float)
    return write(places, "wall", corners, np.array([[0, 1, 2], [0, 2, 3]]))


def cylinder(places: Places) -> Path:
    """Return a pipe about y that is higher than the view."""
    count, radius, up = 720, 0.1, np.array([0, 4.0, 0])
    angles = np.arange(count) * 2 * math.pi / count
    ring = radius * np.stack([np.sin(angles), np.zeros(count), np.cos(angles)], axis=1)
    vertices = np.concatenate([ring - up, ring + up])
    i = np.arange(count)
    j = (i + 1) % count
    triangles = np.concatenate([np.stack([i, j, j + count], 1), np.stack([i, j + count, i + count], 1)])
    return write(places, "cylinder", vertices, triangles)


def sphere(places: Places) -> Path:
    """Return a ball."""
    rows, columns, radius = 180, 360, 0.1
    polar = np.linspace(0, math.pi, rows + 1)[:, None]
    around = np.arange(columns)[None] * 2 * math.pi / columns
    points = [np.sin(polar) * np.sin(around), np.cos(polar) + 0 * around, np.sin(polar) * np.cos(around)]
    vertices = radius * np.stack(points, axis=-1).reshape(-1, 3)
    i, j = np.meshgrid(np.arange(rows), np.arange(columns), indexing="ij")
    a, b = i * columns + j, i * columns + (j + 1) % columns
    down = np.stack([a, a + columns, b + columns], axis=-1).reshape(-1, 3)
    other = np.stack([a, b + columns, b], axis=-1).reshape(-1, 3)
    return write(places, "sphere", vertices, np.concatenate([down, other]))


def write(places: Places, name: str, vertices: np.ndarray, triangles: np.ndarray) -> Path:
    """Write a mesh where it is not there yet."""
    import nacre

    path = places.work / "meshes" / f"{name}.ply"
    if not path.exists():
        path.parent.mkdir(parents=True, exist_ok=True)
        nacre.write_mesh(path, vertices, triangles)
    return path
