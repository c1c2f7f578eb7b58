"""A sheet with relief that is rolled up, frame by frame."""

import numpy as np

import nacre

CAMERA = nacre.Camera(160, 120, 140, 140, 79.5, 59.5)
CURVATURES = (0.0, 0.25, 0.5, 0.75, 1.0, 1.25)  # of a sheet, frame by frame [1/m]


def sheet(curvature: float) -> nacre.Mesh:
    """Return a sheet with relief, rolled up around an axis along y without stretching."""
    x, y = np.meshgrid(np.linspace(-0.25, 0.25, 101), np.linspace(-0.2, 0.2, 81))
    height = 0.012 * np.sin(35 * x) * np.cos(30 * y)
    angle = curvature * x
    along = x * np.sinc(angle / np.pi)
    back = x * np.sin(angle / 2) * np.sinc(angle / 2 / np.pi)
    vertices = np.stack(
        [along + height * np.sin(angle), y, 0.6 + back - height * np.cos(angle)], axis=-1
    ).reshape(-1, 3)
    rows = np.arange(81 * 101).reshape(81, 101)
    a, b, c, d = (part.ravel() for part in (rows[:-1, :-1], rows[:-1, 1:], rows[1:, :-1], rows[1:, 1:]))
    triangles = np.concatenate([np.stack([a, b, c], axis=-1), np.stack([b, d, c], axis=-1)])
    return nacre.Mesh(vertices.astype(np.float32), triangles.astype(np.int32))
