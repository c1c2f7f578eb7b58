"""Positions and directions in few bytes."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt


def quantized(
    points: npt.NDArray[np.floating[Any]], least: float = 1e-6
) -> tuple[npt.NDArray[np.uint16], list[float], float]:
    """
    Return points as whole multiples of a step from an origin.

    Parameters
    ----------
    points : (N, D) array
        Such as positions [m].
    least : float
        No step is smaller.

    Returns
    -------
    rows : (N, D) uint16
    origin : list of D float
    step : float
        The longest side of the points' box by 65535.
    """
    exact = points.astype(np.float64)
    origin = exact.min(axis=0, initial=np.inf) if len(exact) else np.zeros(points.shape[1])
    step = max(float(np.max(exact - origin, initial=0.0)) / 65535, least)
    return np.rint((exact - origin) / step).astype(np.uint16), origin.tolist(), step


def octahedral(normals: npt.NDArray[np.floating[Any]]) -> npt.NDArray[np.uint8]:
    """
    Return unit vectors as two bytes each, true to a degree.

    Notes
    -----
    The octahedron, folded flat, of Meyer et al. 2010, "On floating-point normal vectors".
    """
    n = normals / np.maximum(np.abs(normals).sum(axis=1, keepdims=True), 1e-12)
    folded = np.where(n[:, :2] < 0, -1, 1) * (1 - np.abs(n[:, 1::-1]))
    flat = np.where(n[:, 2:] < 0, folded, n[:, :2])
    return np.asarray(np.rint(127.5 * (flat + 1))).astype(np.uint8)


def unit_vectors(flat: npt.NDArray[np.floating[Any] | np.uint8]) -> npt.NDArray[np.float32]:
    """Return the (N, 3) unit vectors of :func:`octahedral` ones, (N, 2), or of blends of two of them."""
    x, y = (flat.astype(np.float32) / 127.5 - 1).T
    z = 1 - np.abs(x) - np.abs(y)
    fold = np.maximum(-z, 0)
    n = np.stack([x - np.copysign(fold, x), y - np.copysign(fold, y), z], axis=1)
    return np.asarray(n / np.linalg.norm(n, axis=1, keepdims=True), np.float32)
