"""Positions and directions in few bytes come back."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from nacre.io.quantization import octahedral, quantized, unit_vectors


def test_positions_are_true_to_half_a_step() -> None:
    points = np.random.default_rng(2).uniform(-3, 5, (1000, 3)).astype(np.float32)
    rows, origin, step = quantized(points)
    assert step == pytest.approx(np.ptp(points, axis=0).max() / 65535)
    assert np.abs(origin + step * rows - points).max() <= 0.51 * step


@pytest.mark.parametrize("points", [np.zeros((0, 3)), np.ones((1, 3)), np.full((4, 3), 7.0)])
def test_positions_without_extent(points: np.ndarray[Any, Any]) -> None:
    rows, origin, step = quantized(points)
    np.testing.assert_allclose(np.asarray(origin) + step * rows, points)


def test_normals_are_true_to_a_degree() -> None:
    normals = np.random.default_rng(3).normal(size=(2000, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    back = unit_vectors(octahedral(normals))
    np.testing.assert_allclose(np.linalg.norm(back, axis=1), 1, rtol=1e-6)
    assert np.degrees(np.arccos(np.clip((back * normals).sum(axis=1), -1, 1))).max() < 1
