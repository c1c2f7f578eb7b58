"""Which points go, and which stay."""

import numpy as np
from model_scenes import FLAT, flat_grid, relief, rms

import nacre


def test_the_two_sides_of_a_thin_sheet_stay_two() -> None:
    """A sheet of 3 mm at 2 mm spacing, seen from both sides in turn."""
    rng = np.random.default_rng(4)
    behind = np.diag([-1.0, 1, -1, 1])
    behind[2, 3] = 0.6
    model = nacre.Model(FLAT)
    for index in range(6):
        front = index % 2 == 0
        depth = np.full((80, 100), 0.2985) + rng.normal(0, 0.0003, (80, 100))
        model.add_frame(depth, guess=np.eye(4) if front else behind, keep_guess=True)
    z, n = model.points[:, 2] - 0.3, model.normals[:, 2]
    assert (n < -0.9).sum() > 1000
    assert (n > 0.9).sum() > 1000
    assert (np.abs(n) > 0.9).all()
    assert np.abs(z + 0.0015 * np.sign(-n)).max() < 0.0006
    assert rms(z + 0.0015 * np.sign(-n)) < 0.0002


def test_points_that_are_seen_through_vanish() -> None:
    """A disc before a wall is taken away."""
    x, y = flat_grid()
    wall = relief() + 0.1
    with_disc = np.where(x**2 + y**2 < 0.015**2, wall - 0.1, wall)
    model = nacre.Model(FLAT)
    model.add_frame(with_disc)
    on_disc = [int((model.points[:, 2] < 0.34).sum())]
    for _ in range(3):
        report = model.add_frame(wall, guess=np.eye(4), keep_guess=True)
        on_disc.append(int((model.points[:, 2] < 0.34).sum()))
    assert on_disc[0] > 50
    assert on_disc[1] == on_disc[2] == on_disc[0]  # fewer than max_free_space_violations
    assert on_disc[3] == 0
    assert report.num_removed == on_disc[0]


def test_points_that_are_never_confirmed_vanish() -> None:
    """A small hill that one frame saw, too low to be seen through from above."""
    x, y = flat_grid()
    hill = np.hypot(x, y) < 0.012
    # Without its rim: the normals there lean towards the plain, which then moves the points instead.
    model = nacre.Model(FLAT, spacing=0.002, depth={"planar_keep_sigmas": 0.0})
    model.add_frame(np.where(hill, 0.297, 0.3), guess=np.eye(4), keep_guess=True)
    in_front = [int((model.points[:, 2] < 0.2975).sum())]
    for _ in range(4):
        model.add_frame(np.full_like(x, 0.3), guess=np.eye(4), keep_guess=True)
        in_front.append(int((model.points[:, 2] < 0.2975).sum()))
    assert in_front[0] == in_front[2] > 30  # fewer than max_free_space_violations
    assert in_front[3:] == [0, 0]


def test_a_part_that_is_not_looked_at_again_stays() -> None:
    """What one frame saw is no less true because the camera has turned away."""
    x, _ = flat_grid()
    part = np.where(x > 0, relief(), np.nan)
    model = nacre.Model(FLAT)
    model.add_frame(relief())
    before = int((model.points[:, 0] < -0.006).sum())
    for _ in range(12):
        model.add_frame(part, guess=np.eye(4), keep_guess=True)
    assert int((model.points[:, 0] < -0.006).sum()) == before > 300


def test_points_in_front_of_nothing_measured_stay() -> None:
    """A missing measurement is no evidence."""
    model = nacre.Model(FLAT)
    model.add_frame(relief())
    confirmed = len(model)
    half = relief()
    half[:, 40:] = np.nan
    for _ in range(12):
        model.add_frame(half, guess=np.eye(4), keep_guess=True)
    assert len(model) >= confirmed
