"""Somebody walks past before a still scene."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import test_loop_closure as loops

import nacre

Array = npt.NDArray[Any]

CAMERA = nacre.Camera(160, 120, 150, 150, 79.5, 59.5)
STEP = 0.01  # [m] between frames, to the right
NEAR = 0.8  # [m] nothing of the scene is as near
RADIUS = 0.12  # [m] of somebody


def relief() -> nacre.Mesh:
    """Return a rough wall a metre away."""
    x, y = np.meshgrid(np.linspace(-1, 2, 301), np.linspace(-1, 1, 201))
    z = 1 - 0.02 * (np.sin(19 * x) * np.cos(23 * y) + np.sin(11 * x + 17 * y) + np.cos(29 * x - 7 * y))
    rows = np.arange(x.size).reshape(x.shape)
    corner, right, below, last = rows[:-1, :-1], rows[:-1, 1:], rows[1:, :-1], rows[1:, 1:]
    triangles = [
        np.stack(three, axis=-1).reshape(-1, 3) for three in ((corner, below, right), (right, below, last))
    ]
    return nacre.Mesh(np.stack([x, y, z], axis=-1).reshape(-1, 3), np.concatenate(triangles).astype(np.int32))


WALL = relief()


def cylinder(x: float) -> Array:
    """Return the depth of an upright cylinder at x, 0.6 m away, in every column; inf beside it."""
    slope = (np.arange(CAMERA.width) - CAMERA.cx) / CAMERA.fx
    a, b, c = slope**2 + 1, slope * x + 0.6, x**2 + 0.6**2 - RADIUS**2
    inside = b**2 - a * c
    return np.where(inside > 0, (b - np.sqrt(np.maximum(inside, 0))) / a, np.inf)


def view(number: int, somebody: float | None) -> Array:
    """Return what the camera sees after so many steps, with noise of half a millimetre."""
    pose = np.eye(4)
    pose[0, 3] = STEP * number
    depth = WALL.simulate_depth(CAMERA, pose)
    if somebody is not None:
        depth = np.fmin(depth, cylinder(somebody)[None])
    return (depth + np.random.default_rng(number).normal(0, 0.0005, depth.shape)).astype(np.float32)


def passing(first: int, count: int = 24) -> list[Array]:
    """Return views past which somebody walks to the right, from outside of the image at frame `first` on."""
    return [view(i, -0.5 + 0.06 * (i - first) if i >= first else None) for i in range(count)]


def tracked(views: list[Array], **options: Any) -> nacre.Model:
    """Return what a model makes of views."""
    model = nacre.Model(CAMERA, **options)
    for depth in views:
        model.add_frame(depth)
    return model


def errors(model: nacre.Model) -> Array:
    """Return how far each camera is from where it was [m]."""
    truth = STEP * np.arange(len(model.frames))
    places = np.array([report.world_from_camera[:3, 3] for report in model.frames])
    return np.linalg.norm(places - truth[:, None] * [1, 0, 0], axis=1)


@pytest.fixture(scope="module")
def passed() -> nacre.Model:
    return tracked(passing(4))


def test_the_rest_of_the_scene_is_tracked_on(passed: nacre.Model) -> None:
    assert {report.status for report in passed.frames} == {"TRACKED"}
    assert errors(passed).max() < 0.002


def test_what_moves_is_left_out_and_said(passed: nacre.Model) -> None:
    moving = [report.num_moving for report in passed.frames]
    assert moving[:4] == [0] * 4
    pixels_of_somebody = (cylinder(0.0) < np.inf).sum() * CAMERA.height
    assert max(moving) == pytest.approx(pixels_of_somebody, rel=0.35)
    assert passed.frames[10].removed["moving"] == moving[10] > 0


def test_the_model_keeps_no_ghost(passed: nacre.Model) -> None:
    # But for a column at the image's border, where he came in, and which is not seen again.
    assert (passed.points[:, 2] < NEAR).mean() < 0.01
    assert not ((passed.points[:, 2] < NEAR) & (passed.points[:, 0] > -0.25)).any()


def test_who_was_there_from_the_start_is_no_ghost_when_he_has_left() -> None:
    model = tracked(passing(-7))
    registered = np.array([report.status in ("TRACKED", "RELOCALISED") for report in model.frames])
    assert registered.sum() >= 22  # that he moves cannot be known at once
    assert errors(model)[registered].max() < 0.002
    assert not (model.points[:, 2] < NEAR).any()


def test_what_is_put_down_becomes_part_of_the_scene() -> None:
    shelf = [view(i, None if i < 4 else 0.1 - STEP * (i - 4)) for i in range(60)]
    model = tracked(shelf)
    assert {report.status for report in model.frames} == {"TRACKED"}
    assert model.frames[5].num_moving > 0
    assert model.frames[-1].num_moving == 0
    assert (model.points[:, 2] < NEAR).sum() > 100


def test_nothing_moves_in_a_still_scene() -> None:
    model = tracked([view(i, None) for i in range(12)])
    assert [report.num_moving for report in model.frames] == [0] * 12


def test_the_same_bits_on_any_threads_and_after_a_rest(passed: nacre.Model, tmp_path: Path) -> None:
    views = passing(4)
    tracked(views[:11], num_threads=3).save(tmp_path / "model.nacre")
    model = nacre.Model.load(tmp_path / "model.nacre")
    for depth in views[11:]:
        model.add_frame(depth)
    assert [r.num_moving for r in model.frames] == [r.num_moving for r in passed.frames]
    assert np.array_equal(model.points, passed.points)


def office() -> nacre.Mesh:
    """Return a room four metres deep, with a desk, things on it, shelves, and boxes at its end."""
    random = np.random.default_rng(21)
    boxes = [
        ([0, 1.05, 2], [8, 0.1, 8], 0.0),
        ([0, -0.3, 4.5], [8, 3.4, 0.1], 0.0),
        ([2.1, -0.3, 2], [0.1, 3.4, 8], 0.05),
        ([-2.3, 0.2, 3], [0.5, 1.9, 1], 0.0),
        ([1.75, 0.2, 3.4], [0.5, 1.6, 0.8], 0.0),
        ([0, 0.4, 2.6], [1.6, 0.05, 0.8], 0.0),
    ]
    for _ in range(8):
        place = [random.uniform(-0.7, 0.7), 0.4 - random.uniform(0.05, 0.2), 2.6 + random.uniform(-0.3, 0.3)]
        boxes.append((place, random.uniform(0.08, 0.35, 3), random.uniform(0, 3)))
    for _ in range(5):
        place = [random.uniform(-2, 1.5), 0.6, 4.1]
        boxes.append((place, random.uniform(0.3, 0.9, 3), random.uniform(-0.5, 0.5)))
    return loops.merged([loops.box(*box) for box in boxes])


def test_who_stood_before_the_camera_and_walks_away_does_not_pull_it_along() -> None:
    camera = nacre.Camera(320, 240, 285, 285, 159.5, 119.5)
    still = office().simulate_depth(camera, np.eye(4))
    slope = (np.arange(camera.width) - camera.cx) / camera.fx

    def person(x: float, distance: float) -> Array:
        a, b, c = slope**2 + 1, slope * x + distance, x**2 + distance**2 - 0.2**2
        inside = b**2 - a * c
        return np.where(inside > 0, (b - np.sqrt(np.maximum(inside, 0))) / a, np.inf)

    model = nacre.Model(camera)
    for i in range(24):
        way = 0.03 * max(0, i - 9)
        depth = np.fmin(still, np.fmin(person(way - 0.25, 1.7), person(0.35 - way, 2.0))[None])
        noise = 0.001 * np.random.default_rng(i).normal(size=depth.shape)
        model.add_frame((depth + noise * depth**2).astype(np.float32))
    assert {report.status for report in model.frames} == {"TRACKED"}
    assert max(np.linalg.norm(report.world_from_camera[:3, 3]) for report in model.frames) < 0.005
    moving = [report.num_moving for report in model.frames]
    assert moving[:10] == [0] * 10
    assert min(moving[10:16]) > 10000
