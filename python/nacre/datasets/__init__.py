"""Recordings of depth cameras: one reader for each format behind :func:`open_sequence`; and live cameras."""

from nacre.datasets.detect import open_sequence
from nacre.datasets.growing import GrowingRecording
from nacre.datasets.live import LiveQueue
from nacre.datasets.plain import write_recording
from nacre.datasets.real_time import in_real_time
from nacre.datasets.realsense import RealSense
from nacre.datasets.sequence import Sequence, SequenceFrame

__all__ = [
    "GrowingRecording",
    "LiveQueue",
    "RealSense",
    "Sequence",
    "SequenceFrame",
    "in_real_time",
    "open_sequence",
    "write_recording",
]
