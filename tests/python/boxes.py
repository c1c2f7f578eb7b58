"""Scenes of boxes."""

from __future__ import annotations

from typing import Any

import numpy as np

import nacre


def boxes(*corners: tuple[Any, Any]) -> nacre.Mesh:
    """Return a mesh of axis-aligned boxes, each from its lowest corner to its highest."""
    faces = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    vertices: list[list[float]] = []
    triangles: list[tuple[int, int, int]] = []
    for low, high in corners:
        first = len(vertices)
        vertices += [[(low, high)[i >> k & 1][k] for k in range(3)] for i in range(8)]
        for a, b, c, d in faces:
            triangles += [(first + a, first + b, first + c), (first + a, first + c, first + d)]
    return nacre.Mesh(np.array(vertices, float), np.array(triangles))
