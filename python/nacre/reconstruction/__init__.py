"""Recordings run through models: one orchestration, which Python and the command line share."""

from nacre.reconstruction.batch.result import BatchResult
from nacre.reconstruction.reconstruction import Reconstruction
from nacre.run_data.frame_record import FrameRecord

__all__ = ["BatchResult", "FrameRecord", "Reconstruction"]
