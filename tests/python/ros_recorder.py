"""Writes ROS recordings with rosbags."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_typestore

SECOND = 1_000_000_000


class Recorder:
    """Writes messages of a ROS version."""

    def __init__(self, path: Path, version: int, storage: StoragePlugin = StoragePlugin.SQLITE3) -> None:
        self.version = version
        self.types = get_typestore(Stores.ROS1_NOETIC if version == 1 else Stores.ROS2_HUMBLE)
        self.writer: Any = Writer1(path) if version == 1 else Writer2(path, version=9, storage_plugin=storage)
        self.connections: dict[str, Any] = {}
        self.writer.open()

    def close(self) -> None:
        self.writer.close()

    def write(self, topic: str, kind: str, time: float, tail: bytes = b"", **fields: Any) -> None:
        if topic not in self.connections:
            self.connections[topic] = self.writer.add_connection(topic, kind, typestore=self.types)
        message = self.types.types[kind](**fields)
        serialize = self.types.serialize_ros1 if self.version == 1 else self.types.serialize_cdr
        self.writer.write(self.connections[topic], int(time * SECOND), bytes(serialize(message, kind)) + tail)

    def header(self, time: float) -> Any:
        stamp = self.types.types["builtin_interfaces/msg/Time"](int(time), int(time % 1 * SECOND))
        extra = {"seq": 0} if self.version == 1 else {}
        return self.types.types["std_msgs/msg/Header"](stamp=stamp, frame_id="camera", **extra)

    def image(
        self, topic: str, time: float, pixels: np.ndarray, encoding: str, step: int = 0, tail: bytes = b""
    ) -> None:
        row = pixels.reshape(len(pixels), -1).view(np.uint8)
        self.write(
            topic, "sensor_msgs/msg/Image", time, header=self.header(time), height=pixels.shape[0],
            width=pixels.shape[1], encoding=encoding, is_bigendian=0, step=step or row.shape[1],
            data=row.reshape(-1), tail=tail,
        )  # fmt: skip

    def compressed(self, topic: str, time: float, data: bytes, format: str) -> None:
        self.write(
            topic, "sensor_msgs/msg/CompressedImage", time, header=self.header(time), format=format,
            data=np.frombuffer(data, np.uint8),
        )  # fmt: skip

    def info(self, topic: str, fx: float = 60.0, width: int = 64, height: int = 48) -> None:
        roi = self.types.types["sensor_msgs/msg/RegionOfInterest"](0, 0, 0, 0, False)
        matrix = np.array([fx, 0, 31.5, 0, 61.0, 23.5, 0, 0, 1])
        capital = str.upper if self.version == 1 else str
        fields = {"d": np.zeros(5), "k": matrix, "r": np.eye(3).reshape(-1), "p": np.zeros(12)}
        self.write(
            topic, "sensor_msgs/msg/CameraInfo", 1.0, header=self.header(1.0), height=height, width=width,
            distortion_model="plumb_bob", binning_x=0, binning_y=0, roi=roi,
            **{capital(name): value for name, value in fields.items()},
        )  # fmt: skip
