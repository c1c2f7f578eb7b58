"""A camera on ROS 2, with a node that is not there and the messages of a bag; what is missing or wrong."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from io import BytesIO
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import nacre
from nacre.datasets import RosTopic, ros_topic

sys.path.insert(0, str(Path(__file__).parents[1]))
from fake_ros import COMPRESSED, HEIGHT, IMAGE, INFO, WIDTH, Ros, compressed, image, info

from nacre.io.images import encode_jpeg

DEPTH, COLOR = "/camera/depth/image_raw", "/camera/color/image_raw"
DEPTH_INFO, COLOR_INFO = "/camera/depth/camera_info", "/camera/color/camera_info"
TOPICS = {DEPTH: IMAGE, DEPTH_INFO: INFO, COLOR: IMAGE, COLOR_INFO: INFO}
LENS = nacre.Camera(WIDTH, HEIGHT, 60, 61, 31.5, 23.5)


def millimetres(i: int, shape: tuple[int, int] = (HEIGHT, WIDTH)) -> np.ndarray:
    depth = np.full(shape, 700 + i, np.uint16)
    depth[0], depth[1] = 0, 65535
    return depth


def rgb(i: int, shape: tuple[int, int] = (HEIGHT, WIDTH)) -> np.ndarray:
    return np.broadcast_to(np.array([200, 10, i], np.uint8), (*shape, 3)).copy()


def messages(count: int = 4, encoding: str = "16UC1") -> Iterator[tuple[str, Any]]:
    """Give depth images 0.1 s apart, each before its colours, which are stamped 5 ms later."""
    yield DEPTH_INFO, info()
    yield COLOR_INFO, info()
    for i in range(count):
        depth = millimetres(i) if encoding == "16UC1" else (millimetres(i) / 1000).astype(np.float32)
        yield DEPTH, image(7 + i / 10, depth, encoding)
        if i != 1:
            yield COLOR, image(7.005 + i / 10, rgb(i), "rgb8")


@pytest.fixture(autouse=True)
def there_is_time(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ros_topic, "_WAIT_FOR_COLOR", 60)  # all colours come, or later ones


def frames_of(topic: RosTopic, count: int) -> list[nacre.SequenceFrame]:
    with topic:
        return list(islice(topic, count))


@pytest.mark.parametrize(("encoding", "scale"), [("16UC1", 1000), ("32FC1", 5000)])
def test_depth_of_both_encodings(encoding: str, scale: float, monkeypatch: pytest.MonkeyPatch) -> None:
    ros = Ros(TOPICS, messages(encoding=encoding)).install(monkeypatch)
    topic = RosTopic(DEPTH)
    assert (topic.name, topic.serial, topic.camera, topic.depth_scale) == (DEPTH, "", LENS, scale)
    for i, frame in enumerate(frames_of(topic, 4)):
        assert frame.index == i
        assert frame.timestamp == pytest.approx(7 + i / 10)
        assert frame.color is None
        np.testing.assert_allclose(frame.depth[2:], 0.7 + 0.001 * i, rtol=1e-6)
        assert np.isnan(frame.depth[0]).all()
    assert ros.closed


def test_colours_of_the_same_moment(monkeypatch: pytest.MonkeyPatch) -> None:
    Ros(TOPICS, messages()).install(monkeypatch)
    for i, frame in enumerate(frames_of(RosTopic(DEPTH, COLOR), 4)):
        if i == 1:  # whose colours were lost
            assert frame.color is None
        else:
            np.testing.assert_array_equal(frame.color, rgb(i))


@pytest.mark.parametrize("storage", ["SQLITE3", "MCAP"])
def test_the_messages_of_a_bag_give_what_the_bag_gives(
    storage: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("rosbags")
    pytest.importorskip("PIL")
    from ros_recorder import Recorder
    from rosbags.highlevel import AnyReader
    from rosbags.rosbag2 import StoragePlugin

    recorder = Recorder(tmp_path / "bag", 2, StoragePlugin[storage])
    recorder.info(DEPTH_INFO)
    recorder.info(COLOR_INFO)
    for i in range(3):
        recorder.image(DEPTH, 1 + i / 30, millimetres(i), "16UC1")
        recorder.image(COLOR, 1.004 + i / 30, rgb(i)[..., ::-1].copy(), "bgr8")
    recorder.close()
    with AnyReader([tmp_path / "bag"]) as bag:
        topics = {connection.topic: connection.msgtype for connection in bag.connections}
        replayed = [(c.topic, bag.deserialize(data, c.msgtype)) for c, _, data in bag.messages()]
    Ros(topics, replayed).install(monkeypatch)
    topic = RosTopic(DEPTH, COLOR)
    recorded = nacre.open_sequence(tmp_path / "bag")
    assert (topic.camera, topic.depth_scale) == (recorded.camera, recorded.depth_scale)
    for live, read in zip(frames_of(topic, 3), recorded, strict=True):
        np.testing.assert_array_equal(live.depth, read.depth)
        np.testing.assert_array_equal(live.color, read.color)
        assert live.timestamp == pytest.approx(read.timestamp, abs=1e-6)


def test_compressed_images(monkeypatch: pytest.MonkeyPatch) -> None:
    pillow = pytest.importorskip("PIL.Image")
    depth, color = "/camera/depth/image_raw/compressedDepth", "/camera/color/image_raw/compressed"
    png = BytesIO()
    pillow.fromarray(millimetres(3)).save(png, "PNG")
    sent = [
        (DEPTH_INFO, info()),
        (color, compressed(1.0, encode_jpeg(rgb(0)), "rgb8; jpeg compressed bgr8")),
        (depth, compressed(1.0, bytes(12) + png.getvalue(), "16UC1; compressedDepth png")),
    ]
    Ros({depth: COMPRESSED, color: COMPRESSED}, sent).install(monkeypatch)
    (frame,) = frames_of(RosTopic(depth, color), 1)
    np.testing.assert_allclose(frame.depth[2:], 0.703, rtol=1e-6)
    assert frame.color is not None
    np.testing.assert_allclose(frame.color.astype(int), rgb(0), atol=4)


def test_images_that_are_not_newer_are_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    stamps = [1.0, 1.1, 1.1, 1.05, 1.2]
    sent = [(DEPTH_INFO, info())] + [(DEPTH, image(t, millimetres(i), "16UC1")) for i, t in enumerate(stamps)]
    Ros(TOPICS, sent).install(monkeypatch)
    assert [frame.timestamp for frame in frames_of(RosTopic(DEPTH), 3)] == pytest.approx([1.0, 1.1, 1.2])


@pytest.mark.parametrize(
    ("lens", "shape", "reason"),
    [
        (info(90.0), (HEIGHT, WIDTH), "its camera is not that of /camera/depth"),
        (info(), (24, 32), "its images are 32 x 24, and the depth images 64 x 48"),
    ],
)
def test_colours_of_another_camera_or_size_are_left_out(
    lens: Any, shape: tuple[int, int], reason: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    sent = [(DEPTH_INFO, info()), (COLOR_INFO, lens), (COLOR, image(7, rgb(0, shape), "rgb8"))]
    sent += [(DEPTH, image(7 + i / 10, millimetres(i), "16UC1")) for i in range(2)]
    Ros(TOPICS, sent).install(monkeypatch)
    with pytest.warns(UserWarning, match=f"colours of {COLOR} are left out: {reason}") as told:
        frames = frames_of(RosTopic(DEPTH, COLOR), 2)
    assert [frame.color for frame in frames] == [None, None]
    assert len(told) == 1


@pytest.mark.parametrize(
    ("topics", "sent", "arguments", "message"),
    [
        (TOPICS, [], ["/nothing"], "there is no topic /nothing; images are on /camera/color/image_raw, "),
        ({}, [], [DEPTH], f"there is no topic {DEPTH}; there are no topics of images"),
        (TOPICS, [], [DEPTH_INFO], "has no images, but sensor_msgs/msg/CameraInfo; images are on"),
        (TOPICS, [], [DEPTH], r"no camera_info of /camera/depth/image_raw came for 0\.2 s"),
        (TOPICS, [(DEPTH_INFO, info())], [DEPTH], r"no image on /camera/depth/image_raw came for 0\.2 s"),
        (TOPICS, [*messages(1)][:3], [DEPTH, COLOR], r"no image on /camera/color/image_raw came for 0\.2 s"),
        (
            TOPICS, [(DEPTH_INFO, info()), (DEPTH, image(1, rgb(0), "rgb8"))], [DEPTH],
            "depth images are 16UC1, mono16, Z16, 32FC1, this one is rgb8",
        ),
        (
            TOPICS, [(DEPTH_INFO, info(width=640)), (DEPTH, image(1, millimetres(0), "16UC1"))], [DEPTH],
            "are 64 x 48, and its camera_info says 640 x 48",
        ),
        (
            TOPICS, [(DEPTH_INFO, info(0.0)), (DEPTH, image(1, millimetres(0), "16UC1"))], [DEPTH],
            "camera_info of /camera/depth/image_raw: .*fx",
        ),
    ],
)  # fmt: skip
def test_what_cannot_be_used(
    topics: Any, sent: Any, arguments: list[str], message: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    ros = Ros(topics, sent).install(monkeypatch)
    with pytest.raises(nacre.CameraError, match=message):
        RosTopic(*arguments, timeout=0.2)
    assert ros.closed


@pytest.mark.parametrize(
    ("broken", "timeout", "message"),
    [(False, 0.2, r"no image came on .* for 0\.2 s"), (True, 5, "ROS ended while .* was read: context")],
)
def test_it_ends_with_an_error_after_what_came(
    broken: bool, timeout: float, message: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    Ros(TOPICS, messages(2), broken=broken).install(monkeypatch)
    with RosTopic(DEPTH, timeout=timeout) as topic:
        frames = iter(topic)
        assert [next(frames).index, next(frames).index] == [0, 1]
        with pytest.raises(nacre.CameraError, match=message):
            next(frames)


def test_a_message_that_is_cut_short(monkeypatch: pytest.MonkeyPatch) -> None:
    short = image(9, millimetres(0), "16UC1")
    short.data = short.data[:100]
    Ros(TOPICS, [*messages(1), (DEPTH, short)]).install(monkeypatch)
    with RosTopic(DEPTH) as topic:
        frames = iter(topic)
        next(frames)
        with pytest.raises(nacre.CameraError, match="the image of 64 x 48 is cut short"):
            next(frames)


def test_closing_ends_it(monkeypatch: pytest.MonkeyPatch) -> None:
    Ros(TOPICS, messages(2)).install(monkeypatch)
    topic = RosTopic(DEPTH)
    frames = iter(topic)
    next(frames)
    topic.close()
    topic.close()
    assert len(list(frames)) <= 1


def test_without_ros(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "rclpy", None)
    with pytest.raises(ImportError, match=r"need rclpy, which comes with ROS 2 .* setup\.bash"):
        RosTopic(DEPTH)


def test_the_command(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    pytest.importorskip("PIL")
    from command_line import run

    sent = [(DEPTH_INFO, info()), (COLOR_INFO, info())]
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH]
    for i in range(8):
        depth = (700 - i + 30 * np.sin(x / 6) * np.cos(y / 7)).astype(np.uint16)
        sent += [(COLOR, image(3 + i / 30, rgb(i), "rgb8")), (DEPTH, image(3 + i / 30, depth, "16UC1"))]
    Ros(TOPICS, sent, broken=True).install(monkeypatch)
    out = tmp_path / "out"
    quick = ("--no-window", "--no-report", "--set", "binning=1")
    done = run("record", f"ros2:{DEPTH},{COLOR}", "-o", out, *quick)
    assert done.code == 1
    assert "error: ROS ended while /camera/depth/image_raw was read" in done.err
    assert "what there is was written" in done.err
    kept = nacre.open_sequence(out / "recording")
    assert len(kept) == 8
    assert kept.has_color
    assert nacre.read_points(out / "model.ply").colors is not None
    assert run("record", "ros2", "-o", out).code == 2
