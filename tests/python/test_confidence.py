"""How sure a camera is of its pixels, and what that is worth."""

from __future__ import annotations

import functools
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
import test_depth_calibration as furnished
from test_depth_calibration import CAMERA

import nacre
from nacre.io.images import write_color_png

SURE = np.full((CAMERA.height, CAMERA.width), 2, np.uint8)
SURE[:, 120:200] = 1
SURE[80:120, :] = 1

Frames = tuple[list[npt.NDArray[np.float32]], list[npt.NDArray[np.float64]]]


@functools.cache
def frames() -> Frames:
    """Views of a room whose less sure pixels are wrong together: as where a network fills in."""
    depths, poses = furnished.room.__wrapped__()  # type: ignore[attr-defined]
    v, u = np.indices(SURE.shape)
    waves = [np.sin(u / 12 + 2 * i) * np.sin(v / 10 + 3 * i) for i in range(len(depths))]
    share = np.where(SURE == 1, 0.015, 0.0)
    wrong = [depth * (1 + share * wave) for depth, wave in zip(depths, waves, strict=True)]
    return [depth.astype(np.float32) for depth in wrong], poses


def grown(levels: npt.NDArray[np.uint8] | None, **options: int) -> nacre.Model:
    depths, poses = frames()
    model = nacre.Model(CAMERA, **options)
    for i, depth in enumerate(depths):
        model.add_frame(depth, confidence=levels, guess=poses[0] if i == 0 else None, keep_guess=i == 0)
    return model


@functools.cache
def known() -> nacre.Model:
    return grown(SURE)


def error(model: nacre.Model) -> float:
    """Return how far points are from the surface of right depth and poses, the median [m]."""
    depths, poses = furnished.room.__wrapped__()  # type: ignore[attr-defined]
    right = nacre.Model(CAMERA)
    for depth, pose in zip(depths, poses, strict=True):
        right.add_frame(depth, guess=pose, keep_guess=True)
    nearest = nacre.KdTree(right.points).query(model.points, 1)[1].ravel()
    offsets = np.einsum("ij,ij->i", model.points - right.points[nearest], right.normals[nearest])
    return float(np.median(np.abs(offsets)))


def test_what_is_less_sure_weighs_less() -> None:
    assert error(known()) < 0.6 * error(grown(None))


def test_what_levels_are_called_does_not_matter() -> None:
    """Residuals tell what a level is worth, not its number."""
    other = grown(np.where(SURE == 2, 17, 200).astype(np.uint8))
    np.testing.assert_array_equal(other.points, known().points)
    np.testing.assert_array_equal(other.confidence, known().confidence)


def test_one_level_says_nothing() -> None:
    np.testing.assert_array_equal(grown(np.full_like(SURE, 3)).points, grown(None).points)


def test_any_number_of_threads_gives_the_same_bits() -> None:
    np.testing.assert_array_equal(grown(SURE, num_threads=3).points, known().points)


def test_a_saved_model_goes_on_to_the_same_bits(tmp_path: Path) -> None:
    depths, poses = frames()
    model = nacre.Model(CAMERA)
    for i, depth in enumerate(depths):
        model.add_frame(depth, confidence=SURE, guess=poses[0] if i == 0 else None, keep_guess=i == 0)
        model.save(tmp_path / "model")
        model = nacre.Model.load(tmp_path / "model")
    np.testing.assert_array_equal(model.points, known().points)


@pytest.mark.parametrize("format", ["plain", "stray-scanner"])
def test_recordings_tell_it(tmp_path: Path, format: str) -> None:
    depths, poses = frames()
    nacre.write_recording(tmp_path, CAMERA, depths, depth_scale=5000, poses=poses)
    levels = SURE.copy()
    levels[:5] = 0
    (tmp_path / "confidence").mkdir()
    for i in range(len(depths)):
        image = np.repeat(levels[..., None], 3, axis=2)
        write_color_png(tmp_path / "confidence" / f"{i:06d}.png", image)
    if format != "plain":
        (tmp_path / "camera.json").unlink()
        (tmp_path / "camera_matrix.csv").write_text("260, 0, 159.5\n0, 260, 119.5\n0, 0, 1\n")
    sequence = nacre.open_sequence(tmp_path, format=format, depth_scale=5000)
    frame = sequence[3]
    assert "confidence" in repr(frame)
    np.testing.assert_array_equal(frame.confidence, levels)
    np.testing.assert_array_equal(frame.mask, levels > 0)
    done = nacre.reconstruct(sequence, retry=False)
    model = nacre.Model(sequence.camera)
    for view in sequence:
        model.add_frame(view.depth, mask=levels > 0, confidence=levels)
    np.testing.assert_array_equal(done.model.points, model.points)


@pytest.mark.parametrize(
    ("confidence", "message"),
    [
        (np.zeros((3, 4), np.uint8), r"confidence must have the depth image's shape"),
        (np.full(SURE.shape, 0.5), "confidence must be of integers from 0 to 255, got float64"),
        (np.full(SURE.shape, 256), "confidence must be of integers from 0 to 255"),
        (np.full(SURE.shape, -1), "confidence must be of integers from 0 to 255"),
        ("sure", "confidence must be"),
    ],
)
def test_no_other_confidence_is_taken(confidence: object, message: str) -> None:
    model = nacre.Model(CAMERA)
    with pytest.raises((TypeError, ValueError), match=message):
        model.add_frame(frames()[0][0], confidence=confidence)  # type: ignore[arg-type]
    assert len(model.frames) == 0
