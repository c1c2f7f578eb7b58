"""Where lines from camera to camera are drawn."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from nacre.report import ReportedFrame
from nacre.viewer.camera_path import make_path


def frames_at(centers: Sequence[Sequence[float]], **figures: object) -> list[ReportedFrame]:
    """Return tracked frames of cameras at the centers."""
    frames = []
    for index, center in enumerate(centers):
        pose = np.eye(4)
        pose[:3, 3] = center
        frames.append(ReportedFrame(index, "TRACKED", world_from_camera=pose, **figures))
    return frames


def ring(degrees: float) -> list[tuple[float, float, float]]:
    """Return cameras once around the origin, so far apart."""
    angles = np.radians(np.arange(0, 360, degrees))
    return [(float(np.cos(a)), 0.0, float(np.sin(a))) for a in angles]


def test_cameras_in_order_make_a_path_and_the_same_ones_shuffled_do_not() -> None:
    order = np.random.default_rng(0).permutation(24)
    around = ring(15)
    assert make_path(frames_at(around))
    assert make_path(frames_at(2 * around))  # twice around
    assert not make_path(frames_at([around[i] for i in order]))


@pytest.mark.parametrize(("degrees", "expected"), [(60, True), (90, False)])
def test_views_from_all_sides_follow_each_other_where_steps_are_short(degrees: float, expected: bool) -> None:
    # Squares of the steps, and of the distances between any two: 1 and 2.4, 2 and 2.67.
    assert make_path(frames_at(ring(degrees))) is expected


def test_a_camera_that_stands_still_has_none() -> None:
    trembling = np.random.default_rng(1).normal(scale=1e-3, size=(50, 3))
    assert not make_path(frames_at(trembling.tolist()))
    assert not make_path(frames_at([(0, 0, 0)] * 5))
    assert not make_path(frames_at([(0, 0, 0)]))
    assert not make_path([ReportedFrame(0, "LOST")])


def test_poses_relative_to_what_bends_are_none() -> None:
    along = [(0.1 * i, 0, 0) for i in range(10)]
    assert make_path(frames_at(along))
    assert not make_path(frames_at(along, deformation={"num_nodes": 20, "strain": 0.1}))
