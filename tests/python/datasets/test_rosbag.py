"""ROS recordings, written here with rosbags: raw, compressed, RealSense's; and what is missing or damaged."""

from __future__ import annotations

import io
import os
import struct
from contextlib import nullcontext
from pathlib import Path

import numpy as np
import pytest

import nacre

Image = pytest.importorskip("PIL.Image")
pytest.importorskip("rosbags")
from ros_recorder import Recorder  # noqa: E402
from rosbags.rosbag2 import StoragePlugin  # noqa: E402

WIDTH, HEIGHT, FRAMES = 64, 48, 3


def depth_image(i: int) -> np.ndarray:
    image = np.full((HEIGHT, WIDTH), 700 + i, np.uint16)
    image[0], image[1] = 0, 65535
    return image


def color_image(i: int) -> np.ndarray:
    image = np.zeros((HEIGHT, WIDTH, 3), np.uint8)
    image[..., 0], image[..., 2] = 200, i
    return image


def png(image: np.ndarray) -> bytes:
    stream = io.BytesIO()
    Image.fromarray(image).save(stream, format="PNG")
    return stream.getvalue()


def record(path: Path, version: int, storage: StoragePlugin = StoragePlugin.SQLITE3) -> Path:
    recorder = Recorder(path, version, storage)
    recorder.info("/camera/depth/camera_info", 40.0)
    recorder.info("/camera/aligned_depth_to_color/camera_info")
    for i in range(FRAMES):
        time = 1.0 + i / 30
        recorder.image("/camera/depth/image_rect_raw", time, depth_image(50), "16UC1")
        recorder.image("/camera/aligned_depth_to_color/image_raw", time, depth_image(i), "16UC1")
        if i != 1:
            recorder.image("/camera/color/image_raw", time + 0.005, color_image(i), "rgb8")
    recorder.close()
    return path


@pytest.mark.parametrize(("name", "version"), [("a.bag", 1), ("two", 2)])
def test_topics_need_not_begin_with_a_slash(name: str, version: int, tmp_path: Path) -> None:
    recorder = Recorder(tmp_path / name, version)
    recorder.info("camera/info/camera_info")
    for i in range(FRAMES):
        recorder.image("camera/depth/image_raw", 1.0 + i, depth_image(i), "16UC1")
        recorder.image("camera/color/image_raw", 1.0 + i, color_image(i), "rgb8")
    recorder.close()
    sequence = nacre.open_sequence(tmp_path / name)
    for i, frame in enumerate(sequence):
        np.testing.assert_allclose(frame.depth[2:], 0.7 + 0.001 * i, rtol=1e-6)
        np.testing.assert_array_equal(frame.color, color_image(i))
    assert len(sequence) == FRAMES


@pytest.mark.parametrize("storage", [StoragePlugin.SQLITE3, StoragePlugin.MCAP])
def test_a_folder_whose_name_is_no_text(storage: StoragePlugin, tmp_path: Path) -> None:
    folder = tmp_path / os.fsdecode(b"r\xff")
    try:
        folder.mkdir()
    except OSError:
        pytest.skip("file names here are text")
    recording = record(tmp_path / "two", 2, storage).rename(folder / "two")
    if storage == StoragePlugin.SQLITE3:
        with pytest.raises(nacre.FileFormatError, match="SQLite opens no file whose path is not UTF-8"):
            nacre.open_sequence(recording)
    else:
        assert len(nacre.open_sequence(recording)) == FRAMES


@pytest.mark.parametrize(("name", "version"), [("a.bag", 1), ("two", 2)])
def test_a_topic_may_have_other_messages_than_images(name: str, version: int, tmp_path: Path) -> None:
    recorder = Recorder(tmp_path / name, version)
    recorder.info("/camera/depth/image_raw")
    recorder.connections.clear()
    for i in range(FRAMES):
        recorder.image("/camera/depth/image_raw", 1.0 + i, depth_image(i), "16UC1")
    recorder.close()
    sequence = nacre.open_sequence(tmp_path / name)
    assert [frame.depth[5, 5] for frame in sequence] == pytest.approx([0.700, 0.701, 0.702])


@pytest.mark.parametrize(
    ("name", "version", "storage"),
    [("a.bag", 1, None), ("two", 2, StoragePlugin.SQLITE3), ("three", 2, StoragePlugin.MCAP)],
)
def test_both_versions_are_recognised_and_read(
    name: str, version: int, storage: StoragePlugin | None, tmp_path: Path
) -> None:
    sequence = nacre.open_sequence(record(tmp_path / name, version, storage or StoragePlugin.SQLITE3))
    assert (sequence.format, len(sequence), sequence.depth_scale) == ("rosbag", FRAMES, 1000)
    assert sequence.camera == nacre.Camera(WIDTH, HEIGHT, 60, 61, 31.5, 23.5)
    frames = list(sequence)
    for i, frame in enumerate(frames):
        assert np.isnan(frame.depth[:2]).all()
        assert frame.depth[5, 5] == pytest.approx(0.7 + 0.001 * i)
        assert frame.timestamp == pytest.approx(1.0 + i / 30)
    assert frames[1].color is None
    assert frames[2].color is not None
    assert frames[2].color[0, 0].tolist() == [200, 0, 2]
    assert sequence[2].depth[5, 5] == pytest.approx(0.702)
    assert [frame.index for frame in sequence[1:]] == [1, 2]


def test_the_units_of_a_realsense_recording(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path / "d435.bag", 1)
    recorder.info("/device_0/sensor_0/Depth_0/info/camera_info")
    recorder.write("/device_0/sensor_0/option/Depth_Units/value", "std_msgs/msg/Float32", 1.0, data=0.0001)
    tail = struct.pack("<f", 0.0001)  # the recorder's, up to version 2.56 of the SDK
    recorder.image("/device_0/sensor_0/Depth_0/image/data", 1.0, depth_image(0) * 10, "mono16", tail=tail)
    recorder.close()
    sequence = nacre.open_sequence(tmp_path / "d435.bag")
    assert sequence.depth_scale == pytest.approx(10000)
    assert sequence[0].depth[5, 5] == pytest.approx(0.7)
    scaled = nacre.open_sequence(tmp_path / "d435.bag", depth_scale=5000)
    assert scaled[0].depth[5, 5] == pytest.approx(1.4)


def test_float_images_are_metres(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path / "r", 2)
    recorder.info("/depth/camera_info")
    recorder.image("/depth/image", 1.0, np.full((HEIGHT, WIDTH), 0.75, np.float32), "32FC1")
    recorder.close()
    assert nacre.open_sequence(tmp_path / "r")[0].depth[5, 5] == 0.75


def test_compressed_images(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path / "r", 2)
    recorder.info("/depth/camera_info")
    topic = "/depth/image_raw/compressedDepth"
    recorder.compressed(topic, 1.0, bytes(12) + png(depth_image(0)), "16UC1; compressedDepth png")
    recorder.compressed("/color/image_raw/compressed", 1.0, png(color_image(7)), "rgb8; png compressed bgr8")
    recorder.close()
    frame = nacre.open_sequence(tmp_path / "r")[0]
    assert frame.depth[5, 5] == pytest.approx(0.7)
    assert frame.color is not None
    assert frame.color[0, 0].tolist() == [200, 0, 7]


def test_rows_may_be_padded_and_channels_swapped(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path / "r", 2)
    recorder.info("/depth/camera_info")
    padded = np.concatenate([depth_image(0), np.zeros((HEIGHT, 4), np.uint16)], axis=1)
    fields = {"height": HEIGHT, "width": WIDTH, "encoding": "16UC1", "is_bigendian": 0}
    recorder.write(
        "/depth/image", "sensor_msgs/msg/Image", 1.0, header=recorder.header(1.0), step=2 * WIDTH + 8,
        data=padded.view(np.uint8).reshape(-1), **fields,
    )  # fmt: skip
    recorder.image("/color/image", 1.0, color_image(3)[..., ::-1], "bgr8")
    recorder.close()
    frame = nacre.open_sequence(tmp_path / "r")[0]
    assert frame.depth[-1, -1] == pytest.approx(0.7)
    assert frame.color is not None
    assert frame.color[0, 0].tolist() == [200, 0, 3]


def test_pixels_of_no_confidence_are_masked(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path / "l515.bag", 1)
    recorder.info("/device_0/sensor_0/Depth_0/info/camera_info")
    recorder.image("/device_0/sensor_0/Depth_0/image/data", 1.0, depth_image(0), "mono16")
    confidence = np.full((HEIGHT, WIDTH), 240, np.uint8)
    confidence[:, :10] = 0
    recorder.image("/device_0/sensor_0/Confidence_0/image/data", 1.001, confidence, "8UC1")
    recorder.close()
    frame = nacre.open_sequence(tmp_path / "l515.bag")[0]
    assert frame.color is None
    assert frame.mask is not None
    assert not frame.mask[:, :10].any()
    assert frame.mask[:, 10:].all()


@pytest.mark.parametrize(("fx", "are_used"), [(60.2, True), (90.0, False)])
def test_colours_of_another_camera_do_not_lie_over_depth(fx: float, are_used: bool, tmp_path: Path) -> None:
    recorder = Recorder(tmp_path / "d435.bag", 1)
    recorder.info("/device_0/sensor_0/Depth_0/info/camera_info", 60.0)
    recorder.info("/device_0/sensor_1/Color_0/info/camera_info", fx)
    recorder.image("/device_0/sensor_0/Depth_0/image/data", 1.0, depth_image(0), "mono16")
    recorder.image("/device_0/sensor_1/Color_0/image/data", 1.0, color_image(0), "rgb8")
    recorder.close()
    with nullcontext() if are_used else pytest.warns(UserWarning, match="its camera is not that of"):
        assert nacre.open_sequence(tmp_path / "d435.bag").has_color == are_used


class TestBroken:
    def test_no_depth(self, tmp_path: Path) -> None:
        recorder = Recorder(tmp_path / "r.bag", 1)
        recorder.image("/color/image", 1.0, color_image(0), "rgb8")
        recorder.close()
        with pytest.raises(nacre.FileFormatError, match="no topic of depth images; there are /color/image"):
            nacre.open_sequence(tmp_path / "r.bag")

    def test_no_camera(self, tmp_path: Path) -> None:
        recorder = Recorder(tmp_path / "r.bag", 1)
        recorder.image("/depth/image", 1.0, depth_image(0), "16UC1")
        recorder.close()
        with pytest.raises(nacre.FileFormatError, match="no camera_info; give the camera"):
            nacre.open_sequence(tmp_path / "r.bag")
        camera = nacre.Camera(WIDTH, HEIGHT, 60, 60, 31.5, 23.5)
        assert nacre.open_sequence(tmp_path / "r.bag", camera=camera)[0].depth.shape == (HEIGHT, WIDTH)

    def test_another_encoding(self, tmp_path: Path) -> None:
        recorder = Recorder(tmp_path / "r.bag", 1)
        recorder.info("/depth/camera_info")
        recorder.image("/depth/image", 1.0, depth_image(0).astype(np.uint8), "8UC1")
        recorder.close()
        with pytest.raises(nacre.FileFormatError, match=r"depth images are 16UC1, .*, this one is 8UC1"):
            nacre.open_sequence(tmp_path / "r.bag")[0]

    def test_an_image_that_is_cut_short(self, tmp_path: Path) -> None:
        recorder = Recorder(tmp_path / "r.bag", 1)
        recorder.info("/depth/camera_info")
        recorder.image("/depth/image", 1.0, depth_image(0), "16UC1", step=4 * WIDTH)
        recorder.close()
        with pytest.raises(nacre.FileFormatError, match="64 x 48 is cut short"):
            nacre.open_sequence(tmp_path / "r.bag")[0]

    @pytest.mark.parametrize("part", [0.0, 0.3, 0.9])
    def test_a_file_that_is_cut_short(self, part: float, tmp_path: Path) -> None:
        whole = record(tmp_path / "r.bag", 1).read_bytes()
        (tmp_path / "r.bag").write_bytes(whole[: int(part * len(whole))])
        with pytest.raises(nacre.FileFormatError, match=r"r\.bag: not a whole ROS recording"):
            nacre.open_sequence(tmp_path / "r.bag")

    def test_without_rosbags(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        import sys

        path = record(tmp_path / "r.bag", 1)
        monkeypatch.setitem(sys.modules, "rosbags.highlevel", None)
        with pytest.raises(ImportError, match=r'pip install "nacre\[ros\]"'):
            nacre.open_sequence(path)
