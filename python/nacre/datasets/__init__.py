"""Recordings of depth cameras: one reader for each format behind :func:`open_sequence`; and live cameras."""

import importlib
from typing import TYPE_CHECKING, Any

from nacre.datasets.colmap import write_colmap
from nacre.datasets.detect import open_sequence
from nacre.datasets.nerfstudio import write_nerfstudio
from nacre.datasets.plain import write_recording
from nacre.datasets.sequence import Sequence, SequenceFrame

if TYPE_CHECKING:
    from nacre.datasets.live_queue import LiveQueue
    from nacre.datasets.opencv_camera import OpenCVCamera
    from nacre.datasets.real_time import in_real_time
    from nacre.datasets.realsense import RealSense
    from nacre.datasets.recorder import GrowingRecording
    from nacre.datasets.ros_topic import RosTopic

__all__ = [
    "GrowingRecording",
    "LiveQueue",
    "OpenCVCamera",
    "RealSense",
    "RosTopic",
    "Sequence",
    "SequenceFrame",
    "in_real_time",
    "open_sequence",
    "write_colmap",
    "write_nerfstudio",
    "write_recording",
]

_LIVE = {
    "GrowingRecording": "recorder",
    "LiveQueue": "live_queue",
    "OpenCVCamera": "opencv_camera",
    "RealSense": "realsense",
    "RosTopic": "ros_topic",
    "in_real_time": "real_time",
}


def __getattr__(name: str) -> Any:
    """Import what live cameras need only when it is asked for."""
    if name in _LIVE:
        return getattr(importlib.import_module(f"nacre.datasets.{_LIVE[name]}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
