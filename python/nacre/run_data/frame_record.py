"""What became of one frame of a recording."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre._internal.value_equality import Value
from nacre.errors import FileFormatError
from nacre.frame_report import FrameReport


@dataclass(frozen=True, eq=False, repr=False)
class FrameRecord(Value):
    """
    What became of one frame of a recording.

    Attributes
    ----------
    index : int
        Its place in the recording, from 0.
    timestamp : float or None
        [s].
    status, reason : str
        The model's, or LOST and why for a frame that never came to the model.
    report : FrameReport or None
        The model's; None for a frame that could not be read or that the model refused.
    truth : (4, 4) float64 or None
        The true ``world_from_camera``.
    error : Exception or None
        What reading the frame, or handing it to the model, raised.
    """

    index: int
    timestamp: float | None
    status: str
    reason: str
    report: FrameReport | None
    truth: npt.NDArray[np.float64] | None
    error: Exception | None = None

    @property
    def world_from_camera(self) -> npt.NDArray[np.float64] | None:
        """The camera's pose; None where it is not known."""
        return self.report.world_from_camera if self.report is not None and self.report.tracked else None

    @property
    def fused_index(self) -> int:
        """Which of the model's frames it is; -1 where it did not change the model."""
        is_fused = self.report is not None and self.status in ("TRACKED", "RELOCALISED")
        return self.report.index if self.report is not None and is_fused else -1

    def renewed(self, report: FrameReport) -> FrameRecord:
        """Return it with what the model says of it now."""
        return replace(self, status=report.status, reason=report.reason, report=report)

    @property
    def refused(self) -> bool:
        """Whether the frame was read, but the model cannot use it: wrong size or wrong depth scale."""
        return self.error is not None and not isinstance(self.error, FileFormatError)

    def as_dict(self) -> dict[str, Any]:
        """Return what is known of the frame by name: the report's figures, or None for each, and the rest."""
        names = [field.name for field in fields(FrameReport) if field.name != "information"]
        unknown = dict.fromkeys(names) | {"removed": {}}
        figures = unknown if self.report is None else self.report.as_dict()
        own = {
            "index": self.index,
            "status": self.status,
            "reason": self.reason,
            "timestamp": self.timestamp,
            "world_from_camera": self.world_from_camera,
            "truth": self.truth,
        }
        return own | {name: value for name, value in figures.items() if name not in own}
