"""A depth camera on ROS 2, live: the images of its topics, by rclpy."""

from __future__ import annotations

import importlib
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre._internal.warned import warn
from nacre.datasets.closable import Closable
from nacre.datasets.ros_messages import METRES, camera_of, color_of, depth_of, have_one_lens
from nacre.datasets.sequence import SequenceFrame
from nacre.errors import CameraError, FileFormatError

_MISSING = (
    "ROS 2 topics need rclpy, which comes with ROS 2 and not from pip: source its setup.bash in this shell, "
    "and install nacre for the Python that it uses"
)
_TYPES = ("sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage")
_SPIN = 0.1  # s
_MAX_DIFFERENCE = 0.02  # s, between the stamps of a depth image and its colours
_WAIT_FOR_COLOR = 0.2  # s
_MAX_WAITING = 30  # messages
_SCALE_OF_FLOATS = 5000.0  # stored units per metre: 0.2 mm, up to 13 m
_MILLIMETRES = 1000.0


class RosTopic(Closable):
    """
    A depth camera that other programs run on ROS 2.

    Iterating it waits for frames; put :class:`nacre.datasets.LiveQueue` around it. The camera is that of
    ``camera_info`` beside the depth images, and time stamps are those of their headers; an image that is not
    stamped after the one before is left out.

    Parameters
    ----------
    depth : str
        The topic of depth images, raw (16UC1 in millimetres, 32FC1 in metres) or compressed.
    color : str, optional
        A topic of colour images that lie over the depth images: those stamped within 20 ms of a depth image
        are used. Where they have another size or another camera, they are left out, with a warning.
    timeout : float
        How long to wait for the topics, and for an image [s].

    Attributes
    ----------
    name, serial : str
        The topic of depth images, and nothing.
    camera : Camera
        The depth camera.
    depth_scale : float
        Stored units per metre.

    Raises
    ------
    ImportError
        There is no rclpy; with what to do.
    CameraError
        No such topic, no images or no camera_info on it, images that are no depth images, or no more images.
    """

    serial = ""

    def __init__(self, depth: str, color: str | None = None, *, timeout: float = 5.0) -> None:
        self._ros = _library()
        self.name = depth
        self.timeout = timeout
        self._color_topic = color
        self._last: float | None = None
        self._turn = threading.Lock()  # of who spins or closes
        self._closed = False
        self._context = self._ros.Context()
        self._ros.init(args=[], context=self._context)
        self._node = self._ros.create_node("nacre", context=self._context)
        self._executor = self._ros.Executor(context=self._context)
        self._executor.add_node(self._node)
        try:
            self._depths, info = self._subscribed(depth)
            self._colors: deque[Any] = deque()
            if color is not None:
                self._colors, color_info = self._subscribed(color)
            silence = f"came for {timeout:g} s: is it published?"
            self._wait(lambda: info, f"no camera_info of {depth} {silence}")
            self._wait(lambda: self._depths, f"no image on {depth} {silence}")
            self.camera = self._told(camera_of, info[0], Path(depth))
            is_metric = getattr(self._depths[0], "encoding", "") in METRES
            self.depth_scale = _SCALE_OF_FLOATS if is_metric else _MILLIMETRES
            self._depth(self._depths[0])
            if color is not None:
                self._wait(lambda: self._colors, f"no image on {color} {silence}")
                if color_info and not have_one_lens(info[0], color_info[0]):
                    self._leave_out_color(f"its camera is not that of {depth}")
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Leave the topics."""
        with self._turn:
            if self._closed:
                return
            self._closed = True
            self._executor.shutdown()
            self._node.destroy_node()
            with suppress(RuntimeError):  # somebody has shut ROS down
                self._context.shutdown()

    def __iter__(self) -> Iterator[SequenceFrame]:
        index = 0
        silence = f"no image came on {self.name} for {self.timeout:g} s: is the camera still there?"
        while True:
            self._wait(lambda: self._depths, silence)
            if self._closed:
                return
            message = self._depths.popleft()
            stamp = _stamp(message)
            if self._last is not None and stamp <= self._last:
                continue
            self._last = stamp
            yield SequenceFrame(index, self._depth(message), self.camera, stamp, self._color_at(stamp), None)
            index += 1

    def _subscribed(self, topic: str) -> tuple[deque[Any], deque[Any]]:
        """Return where the images of a topic and the camera_info beside them arrive."""
        kinds: list[str] = []

        def is_there() -> bool:
            kinds[:] = dict(self._node.get_topic_names_and_types()).get(topic, [])
            return bool(kinds)

        self._wait(is_there, lambda: f"there is no topic {topic}; {self._known()}")
        kind = kinds[0]
        if kind not in _TYPES:
            raise CameraError(f"{topic} has no images, but {kind}; {self._known()}")
        plain = (
            topic if kind == _TYPES[0] else topic.rpartition("/")[0]
        )  # without the name of the compression
        found = deque[Any](maxlen=_MAX_WAITING), deque[Any](maxlen=1)
        self._subscribe(kind, topic, found[0])
        self._subscribe("sensor_msgs/msg/CameraInfo", plain.rpartition("/")[0] + "/camera_info", found[1])
        return found

    def _subscribe(self, kind: str, topic: str, arrived: deque[Any]) -> None:
        message = getattr(self._ros.messages, kind.rpartition("/")[2])
        self._node.create_subscription(message, topic, arrived.append, self._ros.qos)

    def _known(self) -> str:
        topics = [name for name, kinds in self._node.get_topic_names_and_types() if set(kinds) & set(_TYPES)]
        return f"images are on {', '.join(sorted(topics))}" if topics else "there are no topics of images"

    def _wait(self, is_there: Callable[[], Any], failure: str | Callable[[], str]) -> None:
        """Wait until something is there, or this is closed."""
        end = time.monotonic() + self.timeout
        while not is_there():
            if not self._spin():
                return
            if time.monotonic() > end and not is_there():
                raise CameraError(failure if isinstance(failure, str) else failure())

    def _spin(self) -> bool:
        """Take messages that arrive; False: this is closed."""
        with self._turn:
            if self._closed:
                return False
            try:
                self._executor.spin_once(timeout_sec=_SPIN)
            except Exception as error:  # rclpy's own, where ROS is shut down
                raise CameraError(f"ROS ended while {self.name} was read: {error}") from error
            return True

    def _depth(self, message: Any) -> npt.NDArray[np.float32]:
        depth: npt.NDArray[np.float32] = self._told(depth_of, message, self.depth_scale, Path(self.name))
        expected = (self.camera.height, self.camera.width)
        if depth.shape != expected:
            raise CameraError(
                f"images on {self.name} are {depth.shape[1]} x {depth.shape[0]}, and its camera_info says "
                f"{expected[1]} x {expected[0]}"
            )
        return depth

    def _color_at(self, stamp: float) -> npt.NDArray[np.uint8] | None:
        """Return the colours of a moment; waits a little for those that are on their way."""
        if self._color_topic is None:
            return None
        end = time.monotonic() + _WAIT_FOR_COLOR
        while not (self._colors and _stamp(self._colors[-1]) >= stamp) and time.monotonic() < end:
            if not self._spin():
                return None
        near = min(self._colors, key=lambda message: abs(_stamp(message) - stamp), default=None)
        if near is None or abs(_stamp(near) - stamp) > _MAX_DIFFERENCE:
            return None
        color: npt.NDArray[np.uint8] = self._told(color_of, near, Path(self._color_topic))
        depth_shape = self.camera.height, self.camera.width
        if color.shape[:2] == depth_shape:
            return color
        size, wanted = (f"{width} x {height}" for height, width in (color.shape[:2], depth_shape))
        self._leave_out_color(f"its images are {size}, and the depth images {wanted}")
        return None

    def _leave_out_color(self, reason: str) -> None:
        topic, self._color_topic = self._color_topic, None
        warn(f"colours of {topic} are left out: {reason}; align them to the depth images")

    def _told(self, read: Callable[..., Any], *arguments: Any) -> Any:
        """Read a message; what is wrong with it is the camera's error."""
        try:
            return read(*arguments)
        except FileFormatError as error:
            raise CameraError(str(error)) from error
        except ValueError as error:
            raise CameraError(f"camera_info of {self.name}: {error}") from error


def _stamp(message: Any) -> float:
    stamp = message.header.stamp
    return float(stamp.sec + 1e-9 * stamp.nanosec)


def _library() -> Any:
    """Return what is used of ROS."""
    try:
        rclpy, context, executors, qos, messages = map(
            importlib.import_module,
            ("rclpy", "rclpy.context", "rclpy.executors", "rclpy.qos", "sensor_msgs.msg"),
        )
    except ImportError as error:
        raise ImportError(_MISSING) from error
    return SimpleNamespace(
        init=rclpy.init,
        create_node=rclpy.create_node,
        Context=context.Context,
        Executor=executors.SingleThreadedExecutor,
        qos=qos.qos_profile_sensor_data,
        messages=messages,
    )
