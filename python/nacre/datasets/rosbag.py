"""ROS 1 and 2 recordings (.bag, .mcap, .db3, folders of them), RealSense's among them; read by rosbags."""

from __future__ import annotations

import re
import weakref
from collections.abc import Generator
from contextlib import closing, suppress
from itertools import accumulate
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre._internal.warned import warn
from nacre.camera import Camera
from nacre.datasets.listing import describe
from nacre.datasets.open_file import OpenFile
from nacre.datasets.overrides import Overrides
from nacre.datasets.ros_messages import (
    CAMERA_INFO,
    COMPRESSED_IMAGE,
    IMAGE,
    camera_of,
    check_fields,
    color_of,
    depth_of,
    have_one_lens,
    pixels,
    without_tail,
)
from nacre.datasets.sequence import FrameSource, Sequence
from nacre.errors import FileFormatError
from nacre.io.images import decode_color
from nacre.io.raw import read_file, require_regular

FORMAT = "rosbag"
LAYOUT = (
    "a .bag (ROS 1, RealSense), .mcap or .db3 (ROS 2, RealSense) or a ROS 2 folder (metadata.yaml), "
    "with depth images and camera_info"
)
SUFFIXES = (".bag", ".mcap", ".db3")

_IMAGES = (IMAGE, COMPRESSED_IMAGE)
_MOST_METADATA = 1 << 18
_MOST_NESTED = 64
_MISSING = 'ROS recordings need rosbags: pip install "nacre[ros]"'


def recognise(path: Path) -> bool:
    """Say whether this is a ROS recording: a file of one, or a folder with metadata.yaml and bags."""
    if path.is_file():
        return path.suffix in SUFFIXES
    return (path / "metadata.yaml").is_file() and any(path.glob(pattern) for pattern in ("*.db3*", "*.mcap"))


def read(path: Path, given: Overrides) -> Sequence:
    """
    Open a ROS recording.

    The depth topic is the one that is aligned to the colours, if there is one. Images of 16 bits are
    millimetres unless a RealSense recording tells its depth units, or the caller does. Where there is a topic
    of confidence, pixels whose confidence is 0 are not used, others by what it is worth. Colours of a camera
    with other intrinsics do not lie over the depth images, and are left out.
    """
    if not recognise(path):
        holds = f"; the folder holds {describe(path)}" if path.is_dir() else ""
        raise FileFormatError(path, f"a ROS recording is {LAYOUT}{holds}")
    bag = _Bag(path, given.depth_scale)
    camera = given.camera or bag.camera()
    colors = bag.nearest(bag.color_topics, given.max_difference)
    confidence = bag.nearest(bag.confidence_topics, given.max_difference)
    return Sequence(
        path,
        format=FORMAT,
        camera=camera,
        depth_scale=bag.depth_scale,
        sources=[
            FrameSource(i, bag.place(bag.depth_topic, time), color, 1e-9 * time, confidence=sure)
            for i, (time, color, sure) in enumerate(zip(bag.times, colors, confidence, strict=True))
        ],
        load_depth=bag.depth,
        load_color=bag.color,
        load_confidence=bag.confidence,
    )


class _Bag(OpenFile):
    """An open recording; images are read when they are asked for."""

    def __init__(self, path: Path, depth_scale: float | None) -> None:
        self.path = path
        self._topics: dict[Path, str] = {}  # by where their images are named; some do not begin with a slash
        _check_metadata(path)
        super().__init__()
        topics = [c.topic for c in self._file.connections if c.msgtype in _IMAGES]
        sure = [topic for topic in topics if re.search("confidence", topic, re.IGNORECASE)]
        depth = [t for t in topics if re.search("depth", t, re.IGNORECASE) and t not in sure]
        if not depth:
            raise FileFormatError(
                path, f"no topic of depth images; there are {', '.join(sorted(topics)) or 'no images'}"
            )
        self.depth_topic = min(depth, key=_preference)
        self.confidence_topics = [topic for topic in sure if self._has_camera_of_depth(topic)]
        self.color_topics = [
            topic
            for topic in topics
            if re.search("colou?r|rgb", topic, re.IGNORECASE)
            and topic not in depth
            and self._has_camera_of_depth(topic)
        ]
        self.times = [time for _, time, _ in self._messages(self.depth_topic)]
        self.depth_scale = depth_scale if depth_scale is not None else self._depth_scale()

    def _open(self) -> Any:
        try:
            from rosbags.highlevel import AnyReader
            from rosbags.typesys import Stores, get_typestore
        except ImportError as error:
            raise ImportError(_MISSING) from error
        try:
            reader = AnyReader([self.path], default_typestore=get_typestore(Stores.ROS2_HUMBLE))
            reader.open()
            if not all(isinstance(name, str) for c in reader.connections for name in (c.topic, c.msgtype)):
                raise ValueError("a topic has no name")
        except Exception as error:  # rosbags has several, and lets through what damaged files cause
            if isinstance(error, UnicodeEncodeError) and str(self.path) in error.object:
                reason = "SQLite opens no file whose path is not UTF-8: rename it, or the folder it is in"
                raise FileFormatError(self.path, reason) from error
            hint = ""
            if self.path.suffix == ".mcap" and self.path.stat().st_size:
                hint = f" (ROS 2 is read; what was cut short: mcap recover {self.path.name} -o whole.mcap)"
            raise FileFormatError(self.path, f"not a whole ROS recording: {error}{hint}") from error
        weakref.finalize(self, reader.close)
        return reader

    def camera(self) -> Camera:
        """Return the camera of the depth images."""
        near = [c for c in self._file.connections if c.msgtype == CAMERA_INFO]
        if not near:
            raise FileFormatError(self.path, "no camera_info; give the camera")
        chosen = max(near, key=lambda c: _common(c.topic, self.depth_topic))
        info = self._first(chosen)
        if info is None:
            raise FileFormatError(self.path, f"{chosen.topic} is empty; give the camera")
        try:
            return camera_of(info, self.path)
        except ValueError as error:
            raise FileFormatError(self.path, f"{chosen.topic}: {error}") from error

    def _has_camera_of_depth(self, topic: str) -> bool:
        """Say whether an image's own camera is the depth images', as far as they tell their cameras."""
        infos = []
        for image in (self.depth_topic, topic):
            own = [
                c
                for c in self._file.connections
                if c.msgtype == CAMERA_INFO
                and image.startswith(c.topic.rpartition("/")[0].removesuffix("/info") + "/")
            ]
            info = self._first(max(own, key=lambda c: len(c.topic))) if own else None
            if info is None:
                return True
            infos.append(info)
        if have_one_lens(*infos):
            return True
        hint = (
            f"; nacre reconstruct realsense:{self.path} lays colours over depth"
            if "/device_" in topic
            else ""
        )
        warn(f"{self.path}: {topic} is left out: its camera is not that of {self.depth_topic}{hint}")
        return False

    def _first(self, connection: Any) -> Any:
        """Return the first message of a connection, or None."""
        for _, _, data in self._read([connection]):
            return self._decoded(connection, data, self.path / connection.topic.strip("/"))
        return None

    def nearest(self, topics: list[str], max_difference: float) -> list[Path | None]:
        """Return for each depth image the image of the best topic that is nearest in time."""
        for topic in sorted(topics, key=_preference):
            times = np.array([time for _, time, _ in self._messages(topic)])
            if not len(times):
                continue
            found: list[Path | None] = []
            for time in self.times:
                nearest = int(times[np.abs(times - time).argmin()])
                is_near = abs(nearest - time) <= 1e9 * max_difference
                found.append(self.place(topic, nearest) if is_near else None)
            return found
        return [None] * len(self.times)

    def place(self, topic: str, time: int) -> Path:
        """Name an image, for errors and for reading it."""
        place = self.path / topic.strip("/") / f"{time}"
        self._topics[place.parent] = topic
        return place

    def depth(self, place: Path) -> npt.NDArray[np.float32]:
        """Read a depth image [m]."""
        return depth_of(self._message(place), self.depth_scale, place)

    def color(self, place: Path) -> npt.NDArray[np.uint8]:
        """Read a colour image."""
        return color_of(self._message(place), place)

    def confidence(self, place: Path) -> npt.NDArray[np.uint8]:
        """Read how sure the camera is of its pixels."""
        message = self._message(place)
        if not hasattr(message, "encoding"):
            return np.asarray(decode_color(bytes(message.data), place).max(axis=2), np.uint8)
        return np.asarray(np.clip(pixels(message, place), 0, 255), np.uint8)

    def _depth_scale(self) -> float:
        for connection in self._file.connections:
            if connection.topic.endswith("option/Depth_Units/value"):
                message = self._first(connection)
                with suppress(
                    ValueError, TypeError, AttributeError, ZeroDivisionError
                ):  # a text in the SDK's .db3
                    scale = 1 / float(message.data)
                    if 0 < scale < np.inf:
                        return round(scale, 3)
        return 1000.0

    def _messages(self, topic: str, time: int | None = None) -> Generator[tuple[Any, int, bytes], None, None]:
        connections = [c for c in self._file.connections if c.topic == topic and c.msgtype in _IMAGES]
        return self._read(connections, time, None if time is None else time + 1)

    def _read(
        self, connections: list[Any], *times: int | None
    ) -> Generator[tuple[Any, int, bytes], None, None]:
        try:
            for message in self._file.messages(connections, *times):
                if message[0] not in connections:
                    raise ValueError(f"a message of {message[0].topic} in its index")
                yield message
        except Exception as error:  # rosbags', and those of its decompressors
            raise FileFormatError(self.path, f"damaged in {connections[0].topic}: {error}") from error

    def _message(self, place: Path) -> Any:
        with (
            self._turn(),
            closing(self._messages(self._topics[place.parent], int(place.name))) as found,
        ):
            message = next(found, None)
        if message is None:
            raise FileFormatError(place, "the message is missing")
        return self._decoded(message[0], message[2], place)

    def _decoded(self, connection: Any, data: bytes, place: Path) -> Any:
        if connection.msgtype == IMAGE and not self._file.is2:
            data = without_tail(data)
        try:
            message = self._file.deserialize(data, connection.msgtype)
        except Exception as error:  # rosbags' own, and whatever damaged lengths cause
            raise FileFormatError(place, f"the message is damaged: {error!r}") from error
        check_fields(message, connection.msgtype, place)
        return message


def _check_metadata(path: Path) -> None:
    """Refuse a metadata.yaml that would take the parser of YAML long."""
    if not path.is_dir():
        require_regular(path)
        return
    data = read_file(path / "metadata.yaml", _MOST_METADATA)
    if max(accumulate((+1 if c in b"[{" else -1 for c in data if c in b"[]{}"), initial=0)) > _MOST_NESTED:
        raise FileFormatError(path / "metadata.yaml", "not the metadata of a ROS recording: nested too deep")


def _preference(topic: str) -> tuple[bool, bool, str]:
    """Rank topics: aligned to the colours first, raw images before compressed ones."""
    return (
        re.search("aligned|registered", topic) is None,
        re.search("compressed", topic, re.IGNORECASE) is not None,
        topic,
    )


def _common(a: str, b: str) -> int:
    """Return how many parts of two topics are the same from the start."""
    parts = zip(a.split("/"), b.split("/"), strict=False)
    return next((i for i, (x, y) in enumerate(parts) if x != y), min(a.count("/"), b.count("/")) + 1)
