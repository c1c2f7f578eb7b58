"""The sections with tables: frames to look at, figures, parameters, every frame."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from html import escape
from typing import Any

import numpy as np

from nacre.evaluation.result import Result
from nacre.report.data import ReportData
from nacre.report.markup import heading, scrolled, table, values
from nacre.report.reported_frame import ReportedFrame
from nacre.report.summary import Summary, total_milliseconds
from nacre.report.text import count, flatten, label, quantity
from nacre.report.verdict import stretches

_MAX_ROWS = 300
_MAX_STRETCHES = 8


def attention_section(frames: Sequence[ReportedFrame]) -> str:
    """Return which frames to look at, and why."""
    found = stretches(frames)
    if not found:
        return ""
    rows = "".join(
        f"<tr><td>{_span(s.first, s.last)}</td><td>{count(s.num_frames)}</td>"
        f'<td class="status-{s.status}">{s.status}</td><td>{escape(s.reason)}</td></tr>'
        for s in found[:_MAX_STRETCHES]
    )
    rest = sum(s.num_frames for s in found[_MAX_STRETCHES:])
    more = f'<p class="note">And {count(rest)} more frames, in shorter stretches.</p>' if rest else ""
    head = "".join(f'<th scope="col">{name}</th>' for name in ("Frames", "How many", "State", "Why"))
    return (
        heading("Frames to look at", "look")
        + scrolled(f"<table><tr>{head}</tr>{rows}</table>", "Frames to look at")
        + more
    )


def _span(first: int, last: int) -> str:
    return str(first) if first == last else f"{first} to {last}"


def figures_section(data: ReportData, summary: Summary) -> str:
    """Return the evaluation's results."""
    results = {name: result for name, result in data.evaluation.items() if not _is_empty(result)}
    if (
        summary.trajectory is not None
        and not _is_empty(summary.trajectory)
        and not any(result is summary.trajectory for result in results.values())
    ):
        results["Absolute trajectory error"] = summary.trajectory
    if data.figures:
        results["Further figures"] = data.figures
    tables = [
        f"<div><h3>{escape(str(name))}</h3>{_result_table(result)}</div>" for name, result in results.items()
    ]
    return heading("Figures", "figures") + f'<div class="figures">{"".join(tables)}</div>' if tables else ""


def _is_empty(result: Any) -> bool:
    """Return whether a result says nothing: no frames or pairs were there to compare."""
    return getattr(result, "num_compared", 1) == 0 or getattr(result, "num_pairs", 1) == 0


def _result_table(result: Any) -> str:
    if not isinstance(result, Result):
        return table([], flatten(result))
    units = result.units()
    fields = {name: getattr(result, name) for name in units}
    columns = {name: value for name, value in fields.items() if isinstance(value, tuple)}
    single = [
        (label(name), quantity(value, units[name]))
        for name, value in fields.items()
        if not isinstance(value, (tuple, np.ndarray))
    ]
    shown = ""
    if columns:
        heads = [label(name) for name in columns]
        rows = zip(
            *([quantity(item, units[name]) for item in value] for name, value in columns.items()), strict=True
        )
        shown = table(heads, rows)
    return shown + (table([], single) if single else "")


def parameters_section(data: ReportData) -> str:
    """Return the parameters of the run."""
    rows = flatten(data.parameters)
    if not rows:
        return ""
    entries = "".join(f"<div><dt>{escape(name)}</dt><dd>{escape(value)}</dd></div>" for name, value in rows)
    return (
        heading("Parameters", "parameters")
        + f"<details><summary>All {len(rows)} of them</summary>"
        + f'<dl class="parameters">{entries}</dl></details>'
    )


def frames_table_section(frames: Sequence[ReportedFrame]) -> str:
    """Return the figures of every frame; of long recordings only of those that were not simply tracked."""
    if not frames:
        return ""
    chosen, title = list(frames), "Every frame"
    if len(frames) > _MAX_ROWS:
        chosen = [frame for frame in frames if frame.status.upper() != "TRACKED"][:_MAX_ROWS]
        title = f"Frames that were not simply tracked (the first {_MAX_ROWS} at most)"
        if not chosen:
            return ""
    columns: list[tuple[str, Callable[[ReportedFrame], Any], str]] = [
        ("Inliers", lambda frame: frame.num_inliers, "count"),
        ("Overlap", lambda frame: frame.overlap, "fraction"),
        ("Registration score", lambda frame: frame.score, "number"),
        ("Residual", lambda frame: frame.rmse, "m"),
        ("Position error", lambda frame: frame.translation_error, "m"),
        ("Rotation error", lambda frame: frame.rotation_error, "rad"),
        ("Model points", lambda frame: frame.num_points, "count"),
        ("Time", total_milliseconds, "ms"),
    ]
    columns = [column for column in columns if np.isfinite(values(chosen, column[1])).any()]
    heads = "".join(f'<th class="number" scope="col">{name}</th>' for name, _, _ in columns)
    head = (
        f'<tr><th class="number" scope="col">Frame</th><th scope="col">State</th>{heads}'
        '<th scope="col">Remark</th></tr>'
    )
    rows = []
    for frame in chosen:
        status = escape(frame.status.upper())
        cells = "".join(
            f'<td class="number">{quantity(value(frame), unit)}</td>' for _, value, unit in columns
        )
        rows.append(
            f'<tr><td class="number">{frame.index}</td><td class="status-{status}">{status}</td>'
            f"{cells}<td>{escape(_remark(frame))}</td></tr>"
        )
    return (
        heading("Table of frames", "table")
        + f'<details class="screen"><summary>{title}</summary>'
        + scrolled(f"<table>{head}{''.join(rows)}</table>", "Table of frames")
        + "</details>"
    )


def _remark(frame: ReportedFrame) -> str:
    loop = "" if frame.loop_frame is None else f"closes a loop with frame {frame.loop_frame}"
    return "; ".join(part for part in (frame.reason, loop) if part)
