"""What the tables of the page hold: the figures of the evaluation, and those of every frame."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from nacre.evaluation import AbsoluteTrajectoryError
from nacre.evaluation.result import Result
from nacre.report.data import ReportData
from nacre.run_data.reported_frame import ReportedFrame
from nacre.run_data.text import flatten, label, quantity

_MAX_ROWS = 300
_COLUMNS = (
    ("Inliers", "num_inliers", "count"),
    ("Inlier ratio", "overlap", "fraction"),
    ("Registration score", "score", "number"),
    ("Probability", "probability", "fraction"),
    ("Inlier RMSE", "rmse", "m"),
    ("Position error", "translation_error", "m"),
    ("Rotation error", "rotation_error", "rad"),
    ("Model points", "num_points", "count"),
    ("Time", "total_milliseconds", "ms"),
)


def result_tables(data: ReportData, trajectory: AbsoluteTrajectoryError | None) -> list[dict[str, Any]]:
    """Return the evaluation's results, each as a table."""
    results = dict(data.evaluation)
    if trajectory is not None and not any(result is trajectory for result in results.values()):
        results["Absolute trajectory error"] = trajectory
    tables = [_table(str(name), result) for name, result in results.items() if not _is_empty(result)]
    return tables + ([_table("Further figures", data.figures)] if data.figures else [])


def _is_empty(result: Any) -> bool:
    """Return whether a result says nothing: no frames or pairs were there to compare."""
    return getattr(result, "num_compared", 1) == 0 or getattr(result, "num_pairs", 1) == 0


def _table(title: str, result: Any) -> dict[str, Any]:
    """Return a result's lists as columns with heads, and its numbers as rows of name and number."""
    if not isinstance(result, Result):
        return {"title": title, "columns": [], "rows": flatten(result)}
    units = result.units()
    fields = {name: getattr(result, name) for name in units}
    columns = {name: value for name, value in fields.items() if isinstance(value, tuple)}
    return {
        "title": title,
        "heads": [label(name) for name in columns],
        "columns": list(
            zip(
                *([quantity(item, units[name]) for item in value] for name, value in columns.items()),
                strict=True,
            )
        ),
        "rows": [
            (label(name), quantity(value, units[name]))
            for name, value in fields.items()
            if not isinstance(value, (tuple, np.ndarray))
        ],
    }


def frame_table(frames: Sequence[ReportedFrame]) -> dict[str, Any] | None:
    """Return every frame; of long recordings only those that were not simply tracked."""
    chosen, title = list(frames), "Every frame"
    if len(frames) > _MAX_ROWS:
        chosen = [frame for frame in frames if frame.status != "TRACKED"][:_MAX_ROWS]
        title = f"Frames that were not simply tracked (the first {_MAX_ROWS} at most)"
    if not chosen:
        return None
    columns = [column for column in _COLUMNS if any(_is_known(getattr(f, column[1])) for f in chosen)]
    return {"title": title, "frames": chosen, "columns": columns}


def _is_known(value: float | None) -> bool:
    return value is not None and bool(np.isfinite(value))
