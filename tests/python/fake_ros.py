"""ROS 2 that is not there: as much of rclpy as the reader uses, with messages that come one by one."""

from __future__ import annotations

import array
import sys
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pytest

IMAGE, COMPRESSED, INFO = (f"sensor_msgs/msg/{name}" for name in ("Image", "CompressedImage", "CameraInfo"))
WIDTH, HEIGHT = 64, 48


def stamped(time: float) -> Any:
    return SimpleNamespace(stamp=SimpleNamespace(sec=int(time), nanosec=round(time % 1 * 1e9)))


def image(time: float, pixels: np.ndarray, encoding: str) -> Any:
    """Return a message as rclpy has it: its data are an array of Python's."""
    rows = pixels.reshape(len(pixels), -1).view(np.uint8)
    return SimpleNamespace(
        header=stamped(time), height=pixels.shape[0], width=pixels.shape[1], encoding=encoding,
        is_bigendian=0, step=rows.shape[1], data=array.array("B", rows.tobytes()),
    )  # fmt: skip


def compressed(time: float, data: bytes, format: str) -> Any:
    return SimpleNamespace(header=stamped(time), format=format, data=array.array("B", data))


def info(fx: float = 60.0, width: int = WIDTH, height: int = HEIGHT) -> Any:
    matrix = np.array([fx, 0, 31.5, 0, 61.0, 23.5, 0, 0, 1])
    return SimpleNamespace(width=width, height=height, k=matrix, d=array.array("d", [0.0] * 5))


@dataclass
class Ros:
    """Topics with their types, and messages ``(topic, message)``, of which each spin delivers one."""

    topics: dict[str, str]
    messages: Iterable[tuple[str, Any]]
    broken: bool = False  # somebody shuts ROS down when they have come
    closed: bool = False
    callbacks: dict[str, Callable[[Any], None]] = field(default_factory=dict)

    def install(self, monkeypatch: pytest.MonkeyPatch) -> Ros:
        """Put the modules where they are imported from."""
        self.messages = iter(self.messages)
        modules: dict[str, dict[str, Any]] = {
            "rclpy": {"init": lambda *, args, context: None, "create_node": lambda name, *, context: self},
            "rclpy.context": {"Context": lambda: SimpleNamespace(shutdown=lambda: None)},
            "rclpy.executors": {"SingleThreadedExecutor": lambda *, context: self},
            "rclpy.qos": {"qos_profile_sensor_data": "best effort"},
            "sensor_msgs": {},
            "sensor_msgs.msg": {"Image": IMAGE, "CompressedImage": COMPRESSED, "CameraInfo": INFO},
        }
        for name, content in modules.items():
            module = ModuleType(name)
            vars(module).update(content)
            monkeypatch.setitem(sys.modules, name, module)
        return self

    def add_node(self, node: Any) -> None:
        assert node is self

    def get_topic_names_and_types(self) -> list[tuple[str, list[str]]]:
        return [(topic, [kind]) for topic, kind in self.topics.items()]

    def create_subscription(self, kind: str, topic: str, callback: Callable[[Any], None], qos: str) -> None:
        assert self.topics.get(topic, kind) == kind
        assert qos == "best effort"
        self.callbacks[topic] = callback

    def spin_once(self, timeout_sec: float) -> None:
        for topic, message in self.messages:
            if topic in self.callbacks:
                self.callbacks[topic](message)
                return
        if self.broken:
            raise RuntimeError("context is not valid")
        time.sleep(min(timeout_sec, 0.01))

    def shutdown(self) -> None:
        self.closed = True

    def destroy_node(self) -> None:
        assert self.closed
