"""What a run knows beside its model, as plain values and back."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre._internal.arrays import as_count, as_number, as_vector
from nacre.errors import FileFormatError
from nacre.frame_report import FrameReport
from nacre.run_data.frame_record import FrameRecord

_STATUSES = {"TRACKED": ("TRACKED", "RELOCALISED")}  # of a report: those of a frame, which may be found later


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
    """Return the record; ValueError, TypeError, KeyError or IndexError say what is wrong with the values."""
    number, timestamp, truth = state["report"], state["timestamp"], state["truth"]
    if number is not None and as_count("report", number) >= len(reports):
        raise ValueError(f"there is no report {number!r}")
    report = None if number is None else reports[number]
    told = "LOST" if report is None else report.status
    if state["status"] not in _STATUSES.get(told, (told,)):
        raise ValueError(f"no frame is {state['status']!r} whose report says {told}")
    return FrameRecord(
        as_count("index", state["index"]),
        None if timestamp is None else as_number("timestamp", timestamp),
        state["status"],
        _text("reason", state["reason"]),
        report,
        None if truth is None else pose_from(truth),
        _error_from(state.get("error")),
    )


def pose_from(values: Any) -> npt.NDArray[np.float64]:
    """Return a pose that was written row by row."""
    return as_vector("pose", values, 16).reshape(4, 4)


def _error_from(state: Any) -> Exception | None:
    if state is None:
        return None
    if state[0] == "file":
        path, reason, line, offset = state[1:]
        for place in (line, offset):
            if place is not None and type(place) is not int:
                raise TypeError(f"{place!r} is no place in a file")
        return FileFormatError(_text("path", path), _text("reason", reason), line=line, offset=offset)
    return ValueError(_text("error", state[1]))


def _text(name: str, value: Any) -> str:
    if not isinstance(value, str):
        raise TypeError(f"{name} must be a text, got {value!r}")
    return value
