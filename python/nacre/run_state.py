"""What a run knows beside its model, as plain values and back."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.depth_calibration import DepthCalibration
from nacre.errors import FileFormatError
from nacre.frame_record import STATUSES, FrameRecord
from nacre.frame_report import FrameReport


def record_state(record: FrameRecord) -> dict[str, Any]:
    """Return a record as plain values; its report by the model's number."""
    state: dict[str, Any] = {
        "index": record.index,
        "timestamp": record.timestamp,
        "status": record.status,
        "reason": record.reason,
        "report": None if record.report is None else record.report.index,
        "truth": None if record.truth is None else record.truth.ravel().tolist(),
    }
    if isinstance(record.error, FileFormatError):
        error = record.error
        state["error"] = ["file", str(error.path), error.reason, error.line, error.offset]
    elif record.error is not None:
        state["error"] = ["refused", str(record.error)]
    return state


def record_from(state: Any, reports: Sequence[FrameReport]) -> FrameRecord:
    """Return the record; a ValueError says what is wrong with the values."""
    number, truth = state["report"], state["truth"]
    if state["status"] not in STATUSES or not isinstance(state["reason"], str):
        raise ValueError(f"no frame is {state['status']!r}")
    if number is not None and not 0 <= int(number) < len(reports):
        raise ValueError(f"there is no report {number!r}")
    if state["timestamp"] is not None and not isinstance(state["timestamp"], (int, float)):
        raise ValueError(f"{state['timestamp']!r} is no time")
    return FrameRecord(
        int(state["index"]),
        state["timestamp"],
        state["status"],
        state["reason"],
        None if number is None else reports[int(number)],
        None if truth is None else pose_from(truth),
        _error_from(state.get("error")),
    )


def calibration_from(state: Any) -> DepthCalibration:
    """Return a calibration of depth that was written as plain values."""
    return DepthCalibration(float(state["tilt"]), float(state["sigma"]), int(state["num_pairs"]))


def pose_from(values: Any) -> npt.NDArray[np.float64]:
    """Return a pose that was written row by row."""
    return np.array(values, np.float64).reshape(4, 4)


def _error_from(state: Any) -> Exception | None:
    if state is None:
        return None
    if state[0] == "file":
        _, path, reason, line, offset = state
        return FileFormatError(path, str(reason), line=line, offset=offset)
    return ValueError(str(state[1]))
