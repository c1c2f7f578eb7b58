"""Recordings of depth cameras: one reader for each format behind :func:`open_sequence`."""

from nacre.datasets.detect import open_sequence
from nacre.datasets.plain import write_recording
from nacre.datasets.sequence import Sequence, SequenceFrame

__all__ = ["Sequence", "SequenceFrame", "open_sequence", "write_recording"]
