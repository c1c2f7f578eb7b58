"""The colours of the model."""

import numpy as np
from model_scenes import FLAT, Array, flat_grid, relief, shifted

import nacre


def coloured() -> Array:
    """Return an image whose left half is red and whose right half is blue."""
    color = np.zeros((80, 100, 3), np.uint8)
    color[:, :50] = (200, 20, 30)
    color[:, 50:] = (10, 40, 220)
    return color


def test_two_colours_stay_two() -> None:
    model = nacre.Model(FLAT)
    for x in (0.0, 0.004, -0.003):
        pose = shifted(x)
        color = np.where(flat_grid(pose)[0][..., None] < 0, (200, 20, 30), (10, 40, 220)).astype(np.uint8)
        model.add_frame(relief(pose), color, guess=pose, keep_guess=True)
    x, colors = model.points[:, 0], model.colors
    assert colors is not None
    assert colors.dtype == np.uint8
    assert colors.shape == model.points.shape
    assert (np.abs(colors[x < -0.006] - np.array([200, 20, 30])) <= 1).all()
    assert (np.abs(colors[x > 0.006] - np.array([10, 40, 220])) <= 1).all()


def test_no_colour_without_coloured_frames() -> None:
    model = nacre.Model(FLAT)
    assert model.colors is None
    model.add_frame(relief())
    assert model.colors is None


def test_frames_without_colour_leave_the_colours() -> None:
    model = nacre.Model(FLAT)
    model.add_frame(relief(), coloured())
    before = model.colors
    model.add_frame(relief(), guess=np.eye(4), keep_guess=True)
    assert before is not None
    assert model.colors is not None
    assert (model.colors[: len(before)] == before).all()


def test_colour_that_comes_late_is_taken() -> None:
    model = nacre.Model(FLAT)
    model.add_frame(relief())
    model.add_frame(relief(), coloured(), guess=np.eye(4), keep_guess=True)
    x, colors = model.points[:, 0], model.colors
    assert colors is not None
    assert len(colors) == len(model)
    assert (np.abs(colors[x < -0.006] - np.array([200, 20, 30])) <= 1).all()


def test_colours_follow_thinning() -> None:
    model = nacre.Model(FLAT, max_points=300)
    model.add_frame(relief(), coloured())
    assert model.colors is not None
    assert model.colors.shape == model.points.shape
    assert (np.abs(model.colors[model.points[:, 0] < -0.006] - np.array([200, 20, 30])) <= 1).all()
