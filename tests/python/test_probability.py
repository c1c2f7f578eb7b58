"""How probable it is that a registration is right, as its report tells."""

from __future__ import annotations

import math

import numpy as np
import pytest

import nacre

CAMERA = nacre.Camera(80, 60, 75, 75, 39.5, 29.5)


def view(shift: float) -> np.ndarray:
    """Return a rough wall a metre away, seen from so far to the right [m]."""
    v, u = np.indices((60, 80))
    x, y = (u - 39.5) / 75 + shift, (v - 29.5) / 75
    return (1 + 0.05 * np.sin(9 * x + 1) * np.cos(7 * y) + 0.03 * np.sin(5 * y + 3 * x**2)).astype(np.float32)


def test_a_registration_that_fits_is_almost_certain() -> None:
    model = nacre.Model(CAMERA)
    model.add_frame(view(0.0))
    report = model.add_frame(view(0.01))
    assert report.status == "TRACKED"
    assert 0.95 < report.probability <= 1.0
    assert report.as_dict()["probability"] == report.probability


def test_it_follows_from_the_score() -> None:
    model = nacre.Model(CAMERA)
    model.add_frame(view(0.0))
    report = model.add_frame(view(0.01))
    assert report.probability == pytest.approx(1 / (1 + (0.092 / report.score) ** 3.13), rel=1e-6)


def test_of_a_lost_frame_it_is_small() -> None:
    model = nacre.Model(CAMERA)
    model.add_frame(view(0.0))
    report = model.add_frame(np.flip(view(0.0), axis=0) + np.float32(0.5))
    assert report.status == "LOST"
    assert report.probability < 0.5


def test_where_nothing_was_registered_there_is_none() -> None:
    model = nacre.Model(CAMERA)
    first = model.add_frame(view(0.0))
    given = model.add_frame(view(0.01), guess=np.eye(4), keep_guess=True)
    assert math.isnan(first.probability)
    assert math.isnan(given.probability)


def test_a_frame_without_measurements_has_probability_zero() -> None:
    model = nacre.Model(CAMERA)
    model.add_frame(view(0.0))
    assert model.add_frame(np.zeros((60, 80), np.float32)).probability == 0.0
