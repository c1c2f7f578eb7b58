"""What who follows a run is told of."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from nacre.run_data.frame_record import FrameRecord


@dataclass(frozen=True)
class StageBegun:
    """A stage begins, with so many frames to come; None: nobody knows."""

    name: Literal["frames", "lost frames"]
    num_frames: int | None = None


@dataclass(frozen=True)
class FrameDone:
    """A frame was run, or a lost one was tried again."""

    frame: FrameRecord


Step = StageBegun | FrameDone
