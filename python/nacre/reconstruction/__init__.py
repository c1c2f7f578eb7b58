"""Recordings run through models: one orchestration, which Python and the command line share."""

from nacre.reconstruction.batch.result import BatchResult
from nacre.reconstruction.frame_record import FrameRecord
from nacre.reconstruction.reconstruction import Reconstruction

__all__ = ["BatchResult", "FrameRecord", "Reconstruction"]
