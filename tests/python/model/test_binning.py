"""Images of more pixels than are needed: blocks of them are averaged."""

from __future__ import annotations

import functools
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from model_scenes import FLAT
from test_depth_calibration import boxes

import nacre

CAMERA = nacre.Camera(640, 480, 525, 525, 319.5, 239.5)
Array = npt.NDArray[Any]


def turned(i: int) -> Array:
    pose = np.eye(4)
    a, b = 0.03 * i, 0.01 * i
    pose[:3, :3] = np.array([[np.cos(a), 0, np.sin(a)], [0, 1, 0], [-np.sin(a), 0, np.cos(a)]])
    pose[:3, 3] = (0.02 * i, b, 0.01 * i)
    return pose


@functools.cache
def views() -> tuple[nacre.Mesh, list[Array]]:
    """Return furniture before walls, which fill the image, and what a Kinect sees of them."""
    rng = np.random.default_rng(0)
    places = rng.uniform((-1.5, -1.0, 1.2), (1.5, 1.0, 2.4), (12, 3))
    sides = rng.uniform(0.1, 0.3, (12, 3))
    furniture = [(place - side, place + side) for place, side in zip(places, sides, strict=True)]
    mesh = boxes(((-3, -2, -1), (3, 2, 3)), *furniture)
    depths = [mesh.simulate_depth(CAMERA, turned(i), noise="kinect", seed=i) for i in range(5)]
    return mesh, depths


def grown(**options: Any) -> nacre.Model:
    model = nacre.Model(CAMERA, **options)
    for i, depth in enumerate(views()[1]):
        model.add_frame(depth, guess=turned(0) if i == 0 else None, keep_guess=i == 0)
    return model


@functools.cache
def averaged() -> nacre.Model:
    return grown()


def test_full_images_are_averaged_and_tracked_as_well() -> None:
    model, whole = averaged(), grown(binning=1)
    assert (model.binning, whole.binning) == (2, 1)
    assert model.camera == CAMERA
    assert model.spacing == pytest.approx(whole.spacing, rel=0.02)
    mesh = views()[0]
    errors = []
    for some in (model, whole):
        assert [frame.status for frame in some.frames] == ["TRACKED"] * 5
        errors.append(np.linalg.norm(some.frames[4].world_from_camera[:3, 3] - turned(4)[:3, 3]))
    assert errors[0] < 0.002
    off = [np.sqrt(np.mean(mesh.distance(np.asarray(some.points, float)) ** 2)) for some in (model, whole)]
    assert off[0] < 1.1 * off[1]
    assert 0.5 * len(whole) < len(model) < len(whole)


def test_small_images_regions_and_other_cameras_are_left_as_they_are() -> None:
    small = nacre.Camera(320, 240, 262, 262, 159.5, 119.5)
    model = nacre.Model(small)
    model.add_frame(np.full((240, 320), 1.0, np.float32))
    assert model.binning == 1
    model = nacre.Model(CAMERA, region={"max_z": 3.0})
    model.add_frame(views()[1][0])
    assert model.binning == 1
    flat = nacre.Camera.orthographic(640, 480, 0.002)
    model = nacre.Model(flat)
    model.add_frame(np.full((480, 640), 1.0, np.float32))
    assert model.binning == 1


def test_the_first_image_decides_and_a_refused_one_does_not() -> None:
    model = nacre.Model(CAMERA)
    with pytest.raises(ValueError, match="depth"):
        model.add_frame(np.full((240, 320), 1.0, np.float32))
    with pytest.raises(ValueError, match="color"):
        model.add_frame(views()[1][0], color=np.zeros((240, 320, 3), np.uint8))
    assert len(model.frames) == 0
    model.add_frame(views()[1][0])
    assert model.binning == 2
    part = np.full((480, 640), np.nan, np.float32)
    part[:100] = views()[1][1][:100]
    model.add_frame(part)
    assert model.binning == 2


def test_what_comes_with_pixels_is_averaged_too() -> None:
    color = np.zeros((480, 640, 3), np.uint8)
    color[:, :, 0] = 200
    color[::2, :, 1] = 100
    values = np.indices((480, 640))[1].astype(np.float32)
    mask = np.zeros((480, 640), np.uint8)
    mask[40:, 40:] = 1
    model = nacre.Model(CAMERA)
    model.add_frame(
        views()[1][0], color=color, mask=mask, attributes={"column": values}, confidence=mask + np.uint8(1)
    )
    assert model.binning == 2
    off = np.abs(np.asarray(model.colors)[:, :2].astype(int) - (200, 50))
    assert off[:, 0].max() == 0
    assert np.median(off[:, 1]) <= 1  # where surfaces end some of a block are taken
    columns = np.asarray(model.attributes["column"]).ravel()
    expected = CAMERA.project(np.asarray(model.points, float))[:, 0]
    assert np.median(np.abs(columns - expected)) < 1
    assert expected.min() > 38


def test_what_is_filled_in_between_lines_that_were_measured_has_colours() -> None:
    depth = views()[1][0].copy()
    depth.reshape(240, 2, 640)[::2] = np.nan  # each other pair of lines, as structured light leaves them out
    model = nacre.Model(CAMERA)
    model.add_frame(depth, color=np.full((480, 640, 3), 200, np.uint8))
    assert model.binning == 2
    assert (np.asarray(model.colors) == 200).all()


def test_it_goes_on_to_the_same_bits(tmp_path: Path) -> None:
    depths = views()[1]
    model = nacre.Model(CAMERA)
    for i, depth in enumerate(depths[:3]):
        model.add_frame(depth, guess=turned(0) if i == 0 else None, keep_guess=i == 0)
    model.save(tmp_path / "model")
    other = nacre.Model.load(tmp_path / "model")
    assert (other.binning, other.camera) == (2, CAMERA)
    for some in (model, other):
        for depth in depths[3:]:
            some.add_frame(depth)
    for some in (other, grown(num_threads=1), grown(num_threads=3)):
        assert np.asarray(some.points).tobytes() == np.asarray(model.points).tobytes()


@pytest.mark.parametrize(
    ("camera", "binning", "message"),
    [
        (CAMERA, -1, "binning must be 0 .automatic. or more, got -1"),
        (CAMERA, 481, "binning must be at most the sides of the image, got 481"),
        (FLAT, 2, "binning must be 0 or 1 unless the camera is a pinhole, got 2"),
    ],
)
def test_what_cannot_be_is_named(camera: nacre.Camera, binning: int, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        nacre.Model(camera, binning=binning)
