"""Depth images in memory, and by their paths, as recordings."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import nacre
from nacre.datasets.held_frames import HeldFrames, first_of

CAMERA = nacre.Camera(24, 18, 20.0, 20.0, 11.5, 8.5)
DEPTH = np.full((18, 24), 0.5, np.float32)
MILLIMETRES = np.full((18, 24), 500, np.uint16)
COLOR = np.full((18, 24, 3), 7, np.uint8)


def test_frames_are_made_of_what_is_held() -> None:
    held = HeldFrames(CAMERA, None, 1000.0, [DEPTH, (MILLIMETRES, COLOR)])
    assert len(held) == 2
    np.testing.assert_allclose([frame.depth[0, 0] for frame in held], 0.5)
    assert held[0].color is None
    np.testing.assert_array_equal(held[-1].color, COLOR)
    assert [frame.index for frame in held[::-1]] == [1, 0]
    with pytest.raises(IndexError):
        held[2]


def test_an_array_of_images_is_a_sequence_of_them() -> None:
    held = HeldFrames(CAMERA, 1000.0, items=np.stack([MILLIMETRES] * 3))
    assert [frame.index for frame in held] == [0, 1, 2]
    assert held[2].depth[0, 0] == np.float32(0.5)


def test_frames_come_one_by_one_and_stay() -> None:
    taken = []

    def images() -> Iterator[np.ndarray]:
        for i in range(3):
            taken.append(i)
            yield DEPTH + i

    held = HeldFrames(CAMERA)
    indices = held.receive(images())
    assert (next(indices), taken, len(held)) == (0, [0], 1)
    assert list(indices) == [1, 2]
    assert [float(frame.depth[0, 0]) for frame in held] == [0.5, 1.5, 2.5]


def test_the_first_of_a_generator_is_not_lost() -> None:
    first, items = first_of(i for i in range(3))
    assert (first, list(items)) == (0, [0, 1, 2])
    assert first_of([5, 6]) == (5, [5, 6])


@pytest.mark.parametrize(
    ("camera", "item", "words"),
    [
        (None, DEPTH, r"camera must be given .*from_fov.*source\[0\] got none"),
        (
            CAMERA,
            DEPTH[:9],
            r"source\[0\] must be a depth image of the camera's shape \(18, 24\), got \(9, 24\)",
        ),
        (CAMERA, DEPTH[0], r"source must be a list of depth images: give \[depth\]"),
        (CAMERA, "a.png", r"source\[0\] must be an array of real numbers"),
        (CAMERA, MILLIMETRES, r"depth_scale must be given .*1000 for millimetres.*got None and uint16"),
        (CAMERA, (DEPTH, COLOR[:9]), r"the colours of source\[0\] must have shape \(18, 24, 3\)"),
        (CAMERA, (DEPTH, COLOR, 3), r"source\[0\] must be an array"),
    ],
)
def test_misuse(camera: nacre.Camera | None, item: Any, words: str) -> None:
    with pytest.raises((TypeError, ValueError), match=words):
        HeldFrames(camera, items=[item])[0]


@pytest.fixture
def files(tmp_path: Path) -> list[Path]:
    nacre.write_recording(tmp_path, CAMERA, [DEPTH, 2 * DEPTH], depth_scale=1000, colors=[COLOR, COLOR])
    return sorted((tmp_path / "depth").glob("*.png"))


def test_paths_of_images_are_a_recording(files: list[Path]) -> None:
    sequence = nacre.open_sequence(reversed(files), camera=CAMERA, depth_scale=1000)
    assert [float(frame.depth[0, 0]) for frame in sequence] == [1.0, 0.5]
    assert sequence.format == "images"
    colors = [path.parents[1] / "color" / path.name for path in files]
    assert nacre.open_sequence(zip(files, colors, strict=True), camera=CAMERA, depth_scale=1000).has_color


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"path": []}, "path must have at least one depth image, got none"),
        ({"path": 3}, "path must be a path, or paths of depth images, got int"),
        ({"path": [3]}, r"path\[0\] must be a path, or a pair of depth and colour, got 3"),
        ({"path": [(None, "a.png")]}, r"path\[0\] must be a path, or a pair"),
        ({"path": ["no.png"]}, "none of its 1 depth images can be read; the first: no.png"),
        ({"format": "tum"}, "format must be None or 'images' for a list of images, got 'tum'"),
        ({"camera": None}, "camera not known: .*Give camera= and depth_scale="),
        ({"depth_scale": None}, "depth_scale not known: .*1000 for millimetres"),
        ({"depth_scale": -1}, "depth_scale must be a positive number"),
        ({"camera": nacre.Camera(640, 480, 500, 500, 320, 240)}, "the camera is 640 by 480"),
    ],
)
def test_misuse_of_paths(files: list[Path], change: dict[str, Any], words: str) -> None:
    arguments = {"path": files, "camera": CAMERA, "depth_scale": 1000} | change
    with pytest.raises((TypeError, ValueError), match=words):
        nacre.open_sequence(arguments.pop("path"), **arguments)
