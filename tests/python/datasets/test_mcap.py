"""Single .mcap files, as rosbag2 and as the format's own library write them; what is cut short or not ROS."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import nacre

pytest.importorskip("rosbags")
pytest.importorskip("PIL")

WIDTH, HEIGHT = 64, 48
HEADER = """
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
{line}
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""
IMAGE = """std_msgs/Header header
uint32 height
uint32 width
string encoding
uint8 is_bigendian
uint32 step
uint8[] data
{line}"""
INFO = """std_msgs/Header header
uint32 height
uint32 width
string distortion_model
float64[] d
float64[9] k
float64[9] r
float64[12] p
uint32 binning_x
uint32 binning_y
sensor_msgs/RegionOfInterest roi
{line}
MSG: sensor_msgs/RegionOfInterest
uint32 x_offset
uint32 y_offset
uint32 height
uint32 width
bool do_rectify
{line}"""


def write(path: Path, compression: str = "ZSTD") -> Path:
    """Write three depth images and their camera with the format's own library."""
    writer_module = pytest.importorskip("mcap_ros2.writer")
    from mcap.writer import CompressionType

    line = "=" * 80

    def header(time: float) -> dict[str, Any]:
        return {"stamp": {"sec": int(time), "nanosec": int(time % 1 * 1e9)}, "frame_id": "camera"}

    with path.open("wb") as stream:
        writer = writer_module.Writer(stream, compression=CompressionType[compression])
        image = writer.register_msgdef("sensor_msgs/msg/Image", (IMAGE + HEADER).format(line=line))
        info = writer.register_msgdef("sensor_msgs/msg/CameraInfo", (INFO + HEADER).format(line=line))
        matrix = [60.0, 0, 31.5, 0, 61.0, 23.5, 0, 0, 1]
        roi = {"x_offset": 0, "y_offset": 0, "height": 0, "width": 0, "do_rectify": False}
        message = {
            "header": header(1), "height": HEIGHT, "width": WIDTH, "distortion_model": "plumb_bob",
            "d": [0.1, 0.0, 0.0, 0.0, 0.0], "k": matrix, "r": [0.0] * 9, "p": [0.0] * 12, "binning_x": 0,
            "binning_y": 0, "roi": roi,
        }  # fmt: skip
        writer.write_message("/depth/camera_info", info, message, log_time=10**9, publish_time=10**9)
        for i in range(3):
            pixels = np.full((HEIGHT, WIDTH), 700 + i, np.uint16)
            time = 1 + i / 30
            message = {
                "header": header(time), "height": HEIGHT, "width": WIDTH, "encoding": "16UC1",
                "is_bigendian": 0, "step": 2 * WIDTH, "data": pixels.tobytes(),
            }  # fmt: skip
            stamp = int(1e9 * time)
            writer.write_message("/depth/image", image, message, log_time=stamp, publish_time=stamp)
        writer.finish()
    return path


@pytest.mark.parametrize("compression", ["NONE", "LZ4", "ZSTD"])
def test_a_file_alone_is_read(compression: str, tmp_path: Path) -> None:
    sequence = nacre.open_sequence(write(tmp_path / "a.mcap", compression))
    assert (sequence.format, len(sequence), sequence.depth_scale) == ("rosbag", 3, 1000)
    assert sequence.camera == nacre.Camera(WIDTH, HEIGHT, 60, 61, 31.5, 23.5, distortion=[0.1, 0, 0, 0, 0])
    for i, frame in enumerate(sequence):
        assert frame.depth[5, 5] == pytest.approx(0.7 + 0.001 * i)
        assert frame.timestamp == pytest.approx(1 + i / 30)


@pytest.mark.parametrize("storage", ["mcap", "db3"])
def test_a_file_of_rosbag2_without_its_folder(storage: str, tmp_path: Path) -> None:
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    types = get_typestore(Stores.ROS2_HUMBLE)
    plugin = StoragePlugin.MCAP if storage == "mcap" else StoragePlugin.SQLITE3
    with Writer(tmp_path / "bag", version=9, storage_plugin=plugin) as writer:
        kind = "sensor_msgs/msg/Image"
        connection = writer.add_connection("/depth/image", kind, typestore=types)
        stamp = types.types["builtin_interfaces/msg/Time"](1, 0)
        message = types.types[kind](
            header=types.types["std_msgs/msg/Header"](stamp=stamp, frame_id=""), height=HEIGHT, width=WIDTH,
            encoding="32FC1", is_bigendian=0, step=4 * WIDTH,
            data=np.full((HEIGHT, WIDTH), 0.75, np.float32).view(np.uint8).reshape(-1),
        )  # fmt: skip
        writer.write(connection, 10**9, types.serialize_cdr(message, kind))
    camera = nacre.Camera(WIDTH, HEIGHT, 60, 61, 31.5, 23.5)
    (tmp_path / "bag" / "metadata.yaml").unlink()
    (file,) = (tmp_path / "bag").iterdir()
    assert nacre.open_sequence(file, camera=camera)[0].depth[5, 5] == 0.75
    with pytest.raises(
        nacre.FileFormatError, match=f"metadata.yaml, which is missing; give a file alone: {file.name}"
    ):
        nacre.open_sequence(tmp_path / "bag", camera=camera)


@pytest.mark.parametrize("part", [0.1, 0.5, 0.99])
def test_a_file_that_is_cut_short(part: float, tmp_path: Path) -> None:
    path = write(tmp_path / "a.mcap")
    path.write_bytes(path.read_bytes()[: int(part * path.stat().st_size)])
    with pytest.raises(
        nacre.FileFormatError, match=r"not a whole ROS recording: .* mcap recover a\.mcap -o whole"
    ):
        nacre.open_sequence(path)


def test_messages_that_are_not_of_ros(tmp_path: Path) -> None:
    writer_module = pytest.importorskip("mcap.writer")
    with (tmp_path / "a.mcap").open("wb") as stream:
        writer = writer_module.Writer(stream)
        writer.start()
        schema = writer.register_schema("foxglove.RawImage", "jsonschema", b"{}")
        channel = writer.register_channel("/depth", "json", schema)
        writer.add_message(channel, 1, b"{}", 1)
        writer.finish()
    with pytest.raises(nacre.FileFormatError, match=r"Profile is not ros2.*\(ROS 2 is read"):
        nacre.open_sequence(tmp_path / "a.mcap")


def test_info_tells_of_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    from nacre.cli.app import run

    path = shutil.move(write(tmp_path / "a.mcap"), tmp_path / "b.mcap")
    assert run(["info", str(path)]) == 0
    told = capsys.readouterr().out
    assert "rosbag" in told
    assert "3" in told


def test_flipped_bytes_give_nothing_but_nacres_own_error(tmp_path: Path) -> None:
    whole = write(tmp_path / "a.mcap", "NONE").read_bytes()
    generator = np.random.default_rng(0)
    num_broken = 0
    for _ in range(40):
        data = np.frombuffer(whole, np.uint8).copy()
        data[generator.integers(len(data), size=3)] = generator.integers(256, size=3)
        (tmp_path / "a.mcap").write_bytes(data.tobytes())
        try:
            list(nacre.open_sequence(tmp_path / "a.mcap"))
        except nacre.FileFormatError:
            num_broken += 1
    assert num_broken > 5
