"""Cameras in messages of ROS."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from nacre.datasets.ros_messages import camera_of

MATRIX = np.array([500.0, 0, 320, 0, 500, 240, 0, 0, 1])
RATIONAL = [0.5, -2.6, 0.0006, -0.0003, 1.5, 0.4, -2.4, 1.4]  # an Azure Kinect's: k1 k2 p1 p2 k3 k4 k5 k6


def camera_info(coefficients: list[float], model: str) -> SimpleNamespace:
    return SimpleNamespace(
        width=640, height=480, k=MATRIX, d=np.array(coefficients, np.float64), distortion_model=model
    )


def test_a_rational_lens_is_brought_into_the_cameras_form() -> None:
    camera = camera_of(camera_info(RATIONAL, "rational_polynomial"), Path("depth"))
    x, y = np.meshgrid(np.linspace(-0.6, 0.6, 13), np.linspace(-0.45, 0.45, 9))
    k1, k2, p1, p2, k3, k4, k5, k6 = RATIONAL
    r2 = x**2 + y**2
    ratio = (1 + k1 * r2 + k2 * r2**2 + k3 * r2**3) / (1 + k4 * r2 + k5 * r2**2 + k6 * r2**3)
    u = x * ratio + 2 * p1 * x * y + p2 * (r2 + 2 * x**2)
    v = y * ratio + p1 * (r2 + 2 * y**2) + 2 * p2 * x * y
    seen = camera.project(np.stack([x, y, np.ones_like(x)], axis=-1).reshape(-1, 3))
    np.testing.assert_allclose(seen, np.stack([320 + 500 * u, 240 + 500 * v], -1).reshape(-1, 2), atol=0.5)


@pytest.mark.parametrize("coefficients", [[], [0.0] * 4, [0.0] * 8])
def test_no_coefficients_are_no_distortion(coefficients: list[float]) -> None:
    camera = camera_of(camera_info(coefficients, "plumb_bob"), Path("depth"))
    assert tuple(camera.distortion) == (0.0,) * 5


@pytest.mark.parametrize(
    ("coefficients", "model"),
    [
        ([0.1, 0.01, 0.0, 0.0], "equidistant"),
        ([*RATIONAL, 0.001, 0.0, 0.0, 0.0], "rational_polynomial"),
        ([0.1] * 6, "plumb_bob"),
    ],
)
def test_a_lens_that_has_no_such_form_is_told(coefficients: list[float], model: str) -> None:
    message = rf"\({model}, {len(coefficients)} coefficients\) is left out"
    with pytest.warns(UserWarning, match=message):
        camera = camera_of(camera_info(coefficients, model), Path("depth"))
    assert tuple(camera.distortion) == (0.0,) * 5
