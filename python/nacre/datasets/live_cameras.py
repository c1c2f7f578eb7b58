"""Live cameras, opened by the names that the command line gives them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Protocol

from nacre._internal.camera_names import CameraKind, kind_of
from nacre.camera import Camera
from nacre.datasets.sequence import SequenceFrame
from nacre.errors import RunError


class LiveCamera(Protocol):
    """What every live camera has."""

    name: str
    serial: str
    camera: Camera
    depth_scale: float
    timeout: float

    def __iter__(self) -> Iterator[SequenceFrame]:
        """Yield frames as they come; a CameraError says that no more will."""
        ...

    def close(self) -> None:
        """Stop the camera."""
        ...


def _realsense(which: str, color: bool) -> LiveCamera:
    from nacre.datasets.realsense import RealSense

    is_file = bool(Path(which).suffix) or (which != "" and Path(which).exists())
    return RealSense(None if is_file else which or None, file=which if is_file else None, color=color)


def _opencv(driver: str | None) -> Callable[[str, bool], LiveCamera]:
    def opener(which: str, color: bool) -> LiveCamera:
        from nacre.datasets.opencv_camera import OpenCVCamera

        if which and not which.isdecimal():
            raise RunError(f"{driver or 'opencv'} needs the camera's index, 0 or more, got {which!r}", 2)
        return OpenCVCamera(int(which or 0), driver=driver, color=color)

    return opener


def _ros(which: str, color: bool) -> LiveCamera:
    from nacre.datasets.ros_topic import RosTopic

    depth, _, colors = which.partition(",")
    if not depth:
        raise RunError("ros2 needs a topic of depth images: ros2:/camera/depth/image_raw", 2)
    return RosTopic(depth, colors if color and colors else None)


_OPENERS: dict[CameraKind, Callable[[str, bool], LiveCamera]] = {
    "realsense": _realsense,
    "opencv": _opencv(None),
    "openni": _opencv("openni"),
    "orbbec": _opencv("orbbec"),
    "ros2": _ros,
}


def open_camera(source: Path, color: bool = True) -> LiveCamera:
    """Start a camera: the name of its kind, and behind a colon which of them."""
    kind, which = kind_of(source)
    return _OPENERS[kind](which, color)
