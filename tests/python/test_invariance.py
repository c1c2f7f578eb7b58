"""Answers that must not depend on where, how large and in which order points are."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
from hypothesis import given, settings
from hypothesis import strategies as st

import nacre
import nacre.evaluation

Array = npt.NDArray[Any]

COUNT = 400
SHIFTS = st.tuples(*[st.floats(-1e6, 1e6)] * 3)
SCALES = st.floats(-12, 12).map(lambda exponent: 10.0**exponent)
ORDERS = st.integers(0, 2**31 - 1).map(lambda seed: np.random.default_rng(seed).permutation(COUNT))


def surface() -> Array:
    xy = np.random.default_rng(1).uniform(-0.1, 0.1, (COUNT, 2))
    z = 0.02 * np.sin(30 * xy[:, 0]) * np.cos(25 * xy[:, 1]) + 0.2 * xy[:, 0]
    return np.column_stack([xy, z])


def samples() -> Array:
    return surface()[:60] + np.random.default_rng(2).normal(0, 0.001, (60, 3))


POINTS, SAMPLES = surface(), samples()
ABOVE = np.array([0.0, 0.0, 5.0])
MOTION = np.eye(4)
MOTION[:3, :3] = [[np.cos(0.05), -np.sin(0.05), 0], [np.sin(0.05), np.cos(0.05), 0], [0, 0, 1]]
MOTION[:3, 3] = (0.004, -0.003, 0.002)


@settings(max_examples=20)
@given(shift=SHIFTS, scale=SCALES, order=ORDERS)
def test_neighbours(shift: Any, scale: float, order: Array) -> None:
    distances, indices = nacre.KdTree(POINTS).query(SAMPLES, k=4)
    scaled, same = nacre.KdTree(scale * POINTS).query(scale * SAMPLES, k=4)
    assert (same == indices).all()
    np.testing.assert_allclose(scaled, scale * distances, rtol=1e-9)
    moved, _ = nacre.KdTree(POINTS + shift).query(SAMPLES + shift, k=4)
    np.testing.assert_allclose(moved, distances, atol=1e-9)
    shuffled, other = nacre.KdTree(POINTS[order]).query(SAMPLES, k=4)
    assert (shuffled == distances).all()
    assert (order[other] == indices).all()


@settings(max_examples=20)
@given(shift=SHIFTS, scale=SCALES, order=ORDERS)
def test_normals(shift: Any, scale: float, order: Array) -> None:
    normals = nacre.estimate_normals(POINTS, viewpoint=ABOVE)
    np.testing.assert_allclose(
        nacre.estimate_normals(scale * POINTS, viewpoint=scale * ABOVE), normals, atol=1e-6
    )
    np.testing.assert_allclose(
        nacre.estimate_normals(POINTS + shift, viewpoint=ABOVE + shift), normals, atol=1e-6
    )
    np.testing.assert_allclose(
        nacre.estimate_normals(POINTS[order], viewpoint=ABOVE), normals[order], atol=1e-9
    )


@settings(max_examples=15)
@given(shift=SHIFTS, scale=SCALES, order=ORDERS)
def test_consolidation(shift: Any, scale: float, order: Array) -> None:
    scale = 10.0 ** np.clip(np.log10(scale), -9, 9)  # the radius is from 1e-12 to 1e12
    moved = nacre.project_samples(SAMPLES, POINTS, radius=0.02, iterations=3)
    assert np.abs(moved - SAMPLES).max() > 1e-4
    larger = nacre.project_samples(scale * SAMPLES, scale * POINTS, radius=scale * 0.02, iterations=3)
    np.testing.assert_allclose(larger / scale, moved, atol=1e-6)
    away = nacre.project_samples(SAMPLES + shift, POINTS + shift, radius=0.02, iterations=3)
    np.testing.assert_allclose(away - shift, moved, atol=1e-6)
    shuffled = nacre.project_samples(SAMPLES, POINTS[order], radius=0.02, iterations=3)
    np.testing.assert_allclose(shuffled, moved, atol=1e-6)


@settings(max_examples=15)
@given(shift=SHIFTS, scale=st.floats(-6, 6).map(lambda exponent: 10.0**exponent))
def test_registration(shift: Any, scale: float) -> None:
    target = POINTS @ MOTION[:3, :3].T + MOTION[:3, 3]
    found = nacre.align(POINTS, target)
    assert found.converged
    np.testing.assert_allclose(found.target_from_source, MOTION, atol=1e-5)
    larger = nacre.align(scale * POINTS, scale * target).target_from_source
    np.testing.assert_allclose(larger[:3, :3], MOTION[:3, :3], atol=1e-4)
    np.testing.assert_allclose(larger[:3, 3] / scale, MOTION[:3, 3], atol=1e-4)
    first = np.eye(4)
    first[:3, 3] = shift
    away = nacre.align(POINTS, target + shift, initial=first).target_from_source
    np.testing.assert_allclose(away[:3, :3], MOTION[:3, :3], atol=1e-4)
    np.testing.assert_allclose(away[:3, 3] - shift, MOTION[:3, 3], atol=1e-4)


@settings(max_examples=15)
@given(shift=SHIFTS, scale=SCALES, order=ORDERS)
def test_measures(shift: Any, scale: float, order: Array) -> None:
    even, error = nacre.evaluation.uniformity(POINTS), nacre.evaluation.surface_accuracy(SAMPLES, POINTS)
    for points, others, factor in (
        (scale * POINTS, scale * SAMPLES, scale),
        (POINTS + shift, SAMPLES + shift, 1.0),
        (POINTS[order], SAMPLES, 1.0),
    ):
        np.testing.assert_allclose(nacre.evaluation.uniformity(points).mean, factor * even.mean, rtol=1e-6)
        found = nacre.evaluation.surface_accuracy(others, points)
        np.testing.assert_allclose(found.rms, factor * error.rms, rtol=1e-6)
