"""Recordings of Stray Scanner: written here as the app writes them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import nacre

Image = pytest.importorskip("PIL.Image")
HEADER = "timestamp, frame, x, y, z, qx, qy, qz, qw\n"


def write(folder: Path) -> Path:
    for name in ("depth", "confidence"):
        (folder / name).mkdir(parents=True)
    lines = []
    for i in range(3):
        depth = np.full((192, 256), 1500 + i, np.uint16)
        depth[0] = 0
        confidence = np.full((192, 256), 2, np.uint8)
        confidence[:, :10], confidence[:, 10:20] = 0, 1
        Image.fromarray(depth).save(folder / "depth" / f"{i:06d}.png")
        Image.fromarray(confidence).save(folder / "confidence" / f"{i:06d}.png")
        lines.append(f"{10.5 + i / 60}, {i:06d}, {0.1 * i}, 0, 0, 0, 0, 0, 1\n")
    (folder / "camera_matrix.csv").write_text("1500.0, 0.0, 959.5\n0.0, 1500.0, 719.5\n0.0, 0.0, 1.0\n")
    (folder / "odometry.csv").write_text(HEADER + "".join(lines))
    (folder / "rgb.mp4").write_bytes(b"not read")
    return folder


def test_it_is_recognised_and_read(tmp_path: Path) -> None:
    sequence = nacre.open_sequence(write(tmp_path / "71de12f9"))
    assert (sequence.format, len(sequence), sequence.depth_scale) == ("stray-scanner", 3, 1000)
    frame = sequence[1]
    assert frame.depth.shape == (192, 256)
    assert np.isnan(frame.depth[0]).all()
    assert frame.depth[5, 5] == pytest.approx(1.501)
    assert frame.timestamp == pytest.approx(10.5 + 1 / 60)
    assert frame.truth is None
    assert sequence.estimate is not None
    np.testing.assert_allclose(sequence.estimate.poses[2][:3, 3], [0.2, 0, 0])


def test_the_cameras_pixels_are_wider_than_the_videos(tmp_path: Path) -> None:
    camera = nacre.open_sequence(write(tmp_path / "r")).camera
    assert (camera.width, camera.height) == (256, 192)
    assert camera.fx == pytest.approx(200.0)
    assert (camera.cx, camera.cy) == pytest.approx((127.5, 95.5))  # the middle stays the middle


def test_pixels_of_the_lowest_confidence_are_masked(tmp_path: Path) -> None:
    mask = nacre.open_sequence(write(tmp_path / "r"))[0].mask
    assert mask is not None
    assert not mask[:, :10].any()
    assert mask[:, 10:].all()


def test_confidence_and_odometry_may_be_missing(tmp_path: Path) -> None:
    folder = write(tmp_path / "r")
    (folder / "odometry.csv").unlink()
    for path in (folder / "confidence").iterdir():
        path.unlink()
    sequence = nacre.open_sequence(folder)
    assert sequence[0].mask is None
    assert sequence[0].timestamp is None
    assert sequence.estimate is None


@pytest.mark.parametrize(
    ("file", "text", "message"),
    [
        ("camera_matrix.csv", "1, 2\n3, 4\n", "a camera matrix with positive focal lengths was expected"),
        ("camera_matrix.csv", "a, b, c\n", "three lines of three numbers were expected"),
        ("camera_matrix.csv", "-1,0,1\n0,1,1\n0,0,1\n", "positive focal lengths"),
        ("odometry.csv", "time, x\n", "odometry.csv, line 1: the first line must name timestamp, frame"),
        ("odometry.csv", HEADER + "1, 0, 0, 0\n", "odometry.csv, line 2: nine numbers were expected"),
        ("odometry.csv", HEADER + "1, 0, 0, 0, 0, 0, 0, 0, 0\n", "odometry.csv, line 2: nine numbers"),
    ],
)
def test_broken_files(file: str, text: str, message: str, tmp_path: Path) -> None:
    folder = write(tmp_path / "r")
    (folder / file).write_text(text)
    with pytest.raises(nacre.FileFormatError, match=message):
        nacre.open_sequence(folder)


def test_without_depth_images(tmp_path: Path) -> None:
    folder = write(tmp_path / "r")
    for path in (folder / "depth").iterdir():
        path.unlink()
    with pytest.raises(nacre.FileFormatError, match="needs depth images in depth/"):
        nacre.open_sequence(folder)


@pytest.mark.parametrize("lacking", ["camera_matrix.csv", "depth"])
def test_a_folder_that_is_almost_one(lacking: str, tmp_path: Path) -> None:
    folder = write(tmp_path / "r")
    (folder / lacking).rename(tmp_path / "elsewhere")
    with pytest.raises(
        nacre.FileFormatError, match=f"almost a Stray Scanner recording: {lacking}/? is missing"
    ):
        nacre.open_sequence(folder)
