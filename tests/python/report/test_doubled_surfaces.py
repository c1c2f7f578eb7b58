"""Doubled surfaces: found where no camera can have seen both, and only there."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
import pytest

import nacre
from nacre.report.doubled_surfaces import find_doubled_surfaces

Array = npt.NDArray[np.float64]

SPACING = 0.005


def sheet(size: float, z: float = 0.0) -> Array:
    """A square that faces against z, with a little noise."""
    side = np.arange(0, size, SPACING) - size / 2
    x, y = np.meshgrid(side, side)
    noise = np.random.default_rng(0).normal(0, 1e-4, x.size)
    return np.column_stack([x.ravel(), y.ravel(), z + noise])


def look(*sheets: Array) -> nacre.report.DoubledSurfaces:
    points = np.concatenate(sheets)
    return find_doubled_surfaces(points, np.tile([0.0, 0, -1], (len(points), 1)), spacing=SPACING)


def test_one_surface_is_not_doubled() -> None:
    found = look(sheet(0.5))
    assert found.fraction == 0
    assert math.isnan(found.distance)


@pytest.mark.parametrize("distance", [0.015, 0.03])
def test_a_second_one_behind_it_is(distance: float) -> None:
    found = look(sheet(0.6), sheet(0.2, distance))
    # Those behind and not seen past the rim, of all.
    assert found.fraction == pytest.approx(0.2**2 / (0.6**2 + 0.2**2), rel=0.15)
    assert found.distance == pytest.approx(distance, abs=5e-4)
    np.testing.assert_allclose(found.center, (0, 0, distance), atol=0.01)


def test_what_stands_before_a_wall_is_not() -> None:
    # A book of 10 cm, 3 cm before a wall: the wall beside it is seen past the rim.
    wall = sheet(0.6, 0.03)
    hidden = (np.abs(wall[:, :2]) < 0.05).all(axis=1)
    assert look(wall[~hidden], sheet(0.1)).fraction == 0


def test_surfaces_that_turn_their_backs_to_each_other_are_not() -> None:
    front, back = sheet(0.3), sheet(0.3, 0.02)
    normals = np.repeat([[0.0, 0, -1], [0, 0, 1]], len(front), axis=0)
    assert find_doubled_surfaces(np.concatenate([front, back]), normals, spacing=SPACING).fraction == 0


def test_a_frame_that_is_fused_at_a_wrong_pose_shows() -> None:
    camera = nacre.Camera(160, 120, 131, 131, 79.5, 59.5)
    wall = np.random.default_rng(0).normal(0.6, 0.0005, (120, 160)).astype(np.float32)
    model = nacre.Model(camera, depth={"noise": 0.0005})
    wrong = np.eye(4)
    wrong[2, 3] = -0.03
    fractions = []
    for pose in (np.eye(4), wrong):
        for _ in range(3):
            model.add_frame(wall, guess=pose, keep_guess=True)
        found = find_doubled_surfaces(model.points, model.normals, spacing=model.spacing)
        fractions.append(found.fraction)
    assert fractions[0] == 0
    assert fractions[1] > 0.05


def test_points_that_are_not_finite_and_hardly_any_are_left_out() -> None:
    assert find_doubled_surfaces(np.zeros((0, 3)), np.zeros((0, 3))).fraction == 0
    assert find_doubled_surfaces(np.full((50, 3), np.nan), np.zeros((50, 3))).fraction == 0
    points = sheet(0.3)
    points[::7] = np.nan
    assert look(points, sheet(0.1, 0.02)).fraction > 0


def test_illegal_arrays_are_named() -> None:
    with pytest.raises(ValueError, match=r"points must"):
        find_doubled_surfaces(np.zeros((5, 2)), np.zeros((5, 3)))
    with pytest.raises(ValueError, match=r"normals must have one row per point|normals must"):
        find_doubled_surfaces(np.zeros((5, 3)), np.zeros((4, 3)))
