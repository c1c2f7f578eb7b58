"""The page: one self-contained HTML file."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Sequence
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre import __version__
from nacre.evaluation import AbsoluteTrajectoryError
from nacre.evaluation.result import Result
from nacre.io.atomic import atomic_writer
from nacre.report.charts import (
    Mark,
    Series,
    group_size,
    length_unit,
    line_chart,
    map_chart,
    runs,
    stacked_chart,
)
from nacre.report.colormap import CATEGORIES
from nacre.report.data import DepthExample, FrameEntry, ReportData
from nacre.report.pictures import ModelPictures, Picture, draw_depth, draw_model, is_logarithmic, reason_color
from nacre.report.summary import Summary, is_tracked, summarize, total_milliseconds
from nacre.report.text import count, flatten, label, quantity

Array = npt.NDArray[np.float64]

_MAX_ROWS = 300


def write_report(path: str | os.PathLike[str], data: ReportData) -> None:
    """
    Write a reconstruction's report: one HTML file with its pictures inside, without network or script.

    Parameters
    ----------
    path : path-like
        The file to write, usually ``report.html``; its folder must exist. It appears only when it is
        complete.
    data : ReportData
        What to show. Whatever is missing is left out.

    Notes
    -----
    The same data gives the same bytes. Errors of the poses are worked out from ``frames`` where
    ``evaluation`` holds no trajectory error.
    """
    page = render_page(data)
    with atomic_writer(path) as stream:
        stream.write(page.encode())


def render_page(data: ReportData) -> str:
    """Return the report as HTML text."""
    summary = summarize(data)
    model = draw_model(data.model, data.frames) if data.model is not None else None
    sections = [
        _header(data, summary, model),
        _model_section(model),
        _depth_section(data.depth, data.frames),
        _trajectory_section(data.frames, summary.trajectory),
        _frames_section(data.frames),
        _figures_section(data, summary),
        _parameters_section(data),
        _table_section(data.frames),
    ]
    style = Path(__file__).with_name("style.css").read_text(encoding="utf-8")
    return (
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{escape(data.title)}</title>\n<style>\n{style}</style>\n</head>\n<body>\n<main>\n"
        + "\n".join(section for section in sections if section)
        + f"\n<footer>Made by nacre {escape(__version__)}. Poses are camera to world.</footer>\n"
        "</main>\n</body>\n</html>\n"
    )


def _header(data: ReportData, summary: Summary, model: ModelPictures | None) -> str:
    tiles = "".join(
        f"<div><dt>{escape(tile.label)}</dt><dd>{escape(tile.value)}"
        + (f"<small>{escape(tile.note)}</small>" if tile.note else "")
        + "</dd></div>"
        for tile in summary.tiles
    )
    verdict = f'<p class="verdict {summary.level}">{escape(summary.sentence)}</p>' if summary.sentence else ""
    picture = f'<img src="{model.main.uri}" alt="The model">' if model else ""
    source = f'<p class="source">{escape(data.source)}</p>' if data.source else ""
    return (
        f'<header class="intro{"" if model else " alone"}"><div><p class="brand">nacre reconstruction</p>'
        f"<h1>{escape(data.title)}</h1>{source}{verdict}"
        f'<dl class="tiles">{tiles}</dl></div>{picture}</header>'
    )


def _model_section(model: ModelPictures | None) -> str:
    if model is None:
        return ""
    length, part = model.scale_bar
    parts = [_heading("Model")]
    if model.cameras:
        parts.append(_pictures(model.cameras, "three"))
    parts.append(_pictures(model.sides, "three"))
    parts.append(
        f'<div class="grid three"><p class="scale"><i style="width:{100 * part:.2f}%"></i>{escape(length)}, '
        "in all six pictures</p></div>"
        '<p class="note">Front is what the first camera saw. Brown: reverse sides of surfaces.</p>'
    )
    attributes = model.colors + model.confidence
    if attributes:
        parts.append(_pictures(attributes, "two" if len(attributes) == 2 else "four"))
    if model.confidence:
        low, high = model.confidence_range
        scale = ", logarithmic" if is_logarithmic(low, high) else ""
        parts.append(f'<p class="note">Confidence {low:.4g}<span class="ramp"></span>{high:.4g}{scale}</p>')
    return "".join(parts)


def _depth_section(example: DepthExample | None, frames: Sequence[FrameEntry]) -> str:
    if example is None:
        return ""
    drawn = draw_depth(example)
    low, high = drawn.range
    keys = "".join(
        f'<span class="key"><i style="background:{CATEGORIES[color % len(CATEGORIES)]}"></i>'
        f"{escape(label(name))} {quantity(num / max(drawn.num_measured, 1), 'fraction')}</span>"
        for name, color, num in drawn.removed
        if num
    )
    parts = [
        _heading("Depth image before and after cleaning"),
        f'<p class="note">Frame {example.index}. Depth {quantity(low, "m")}<span class="ramp near"></span>'
        f"{quantity(high, 'm')}. Removed, of {count(drawn.num_measured)} measured pixels: "
        f"{keys or 'none'}</p>",
        _pictures(drawn.pictures, "three", "depth"),
    ]
    reasons = list(dict.fromkeys(name for frame in frames for name, num in frame.removed.items() if num))
    if reasons and len(frames) > 1:
        series = [
            Series(
                label(reason),
                np.array([frame.removed.get(reason, 0) / 1000 for frame in frames]),
                reason_color(reason, i),
            )
            for i, reason in enumerate(reasons)
        ]
        chart = stacked_chart(
            series,
            y_label="thousand pixels",
            indices=[frame.index for frame in frames],
            width=1080,
            height=170,
        )
        parts.append(_chart("Pixels removed from each frame", chart, _keys(series)))
    return "".join(parts)


def _trajectory_section(frames: Sequence[FrameEntry], error: AbsoluteTrajectoryError | None) -> str:
    positions = _positions(frames, lambda frame: frame.world_from_camera if is_tracked(frame) else None)
    if not np.isfinite(positions).any():
        return ""
    tracks = [("estimated", positions, 0)]
    truth = _positions(frames, lambda frame: frame.truth)
    keys = '<span class="key"><i class="thin k0"></i>estimated</span>'
    if error is not None and np.isfinite(truth).any():
        rotation, translation = error.truth_from_estimated[:3, :3], error.truth_from_estimated[:3, 3]
        tracks.insert(0, ("truth", (truth - translation) @ rotation, 1))
        keys += '<span class="key"><i class="thick k1"></i>truth, aligned</span>'
    keys += '<span class="key">○ first frame</span>'
    extent = np.concatenate([track for _, track, _ in tracks])
    unit, factor = length_unit(float(np.nanmax(np.ptp(extent[np.isfinite(extent).all(axis=1)], axis=0))))
    maps = []
    for caption, axes, names in (
        ("From above", (0, 2), ("x, to the right", "z, forward")),
        ("From the side", (2, 1), ("z, forward", "y, down")),
    ):
        lines = [(name, track[:, axes], color) for name, track, color in tracks]
        chart = map_chart(
            lines, x_label=names[0], y_label=names[1], y_up=axes[1] == 2, unit=unit, factor=factor
        )
        maps.append(_chart(caption, chart, keys))
    parts = [_heading("Trajectory"), f'<div class="grid two">{"".join(maps)}</div>']
    parts.append(_error_charts(frames, error))
    return "".join(parts)


def _error_charts(frames: Sequence[FrameEntry], error: AbsoluteTrajectoryError | None) -> str:
    translation = _values(frames, lambda frame: frame.translation_error)
    rotation = _values(frames, lambda frame: frame.rotation_error)
    if error is not None and not np.isfinite(translation).any() and len(error.errors) == len(frames):
        translation, rotation = error.errors, error.rotation_errors
    charts = []
    indices, marks = [frame.index for frame in frames], _marks(frames)
    if np.isfinite(translation).any():
        unit, factor = length_unit(float(np.nanmax(translation)))
        one = [Series("", translation * factor)]
        chart = line_chart(one, y_label=f"position [{unit}]", indices=indices, marks=marks)
        charts.append(_chart("Position error", chart))
    if np.isfinite(rotation).any():
        one = [Series("", np.degrees(rotation))]
        chart = line_chart(one, y_label="rotation [\N{DEGREE SIGN}]", indices=indices, marks=marks)
        charts.append(_chart("Rotation error", chart))
    return f'{_mark_keys(frames)}<div class="grid two">{"".join(charts)}</div>' if charts else ""


def _frames_section(frames: Sequence[FrameEntry]) -> str:
    if len(frames) < 2:
        return ""
    indices, marks = [frame.index for frame in frames], _marks(frames)
    charts = []
    overlap = _values(frames, lambda frame: frame.overlap)
    if np.isfinite(overlap).any():
        one = [Series("", 100 * overlap)]
        chart = line_chart(one, y_label="overlap [%]", indices=indices, marks=marks, y_max=100)
        charts.append(_chart("Part of the frame that matches the model", chart))
    inliers = _values(frames, lambda frame: frame.num_inliers)
    if np.isfinite(inliers).any():
        one = [Series("", inliers / 1000)]
        chart = line_chart(one, y_label="thousand pairs", indices=indices, marks=marks)
        charts.append(_chart("Pairs used for the registration", chart))
    rmse = _values(frames, lambda frame: frame.rmse)
    if np.isfinite(rmse).any():
        unit, factor = length_unit(float(np.nanmax(rmse)))
        one = [Series("", rmse * factor)]
        chart = line_chart(one, y_label=f"residual [{unit}]", indices=indices, marks=marks)
        charts.append(_chart("Residual of the registration (RMS)", chart))
    num_points = _values(frames, lambda frame: frame.num_points)
    if np.isfinite(num_points).any():
        one = [Series("", num_points / 1000)]
        chart = line_chart(one, y_label="thousand points", indices=indices, marks=marks)
        charts.append(_chart("Size of the model", chart))
    parts = [f'{_mark_keys(frames)}<div class="grid two">{"".join(charts)}</div>'] if charts else []
    steps = _steps(frames)
    if steps:
        chart = stacked_chart(steps, y_label="time [ms]", indices=indices, width=1080, height=210)
        parts.append(f'<div class="grid">{_chart("Time per frame", chart, _keys(steps))}</div>')
    if not parts:
        return ""
    size = group_size(len(frames))
    if size > 1:
        note = f"Lines are means over {size} frames, bands reach from the least to the greatest value."
        parts.append(f'<p class="note">{note}</p>')
    return _heading("Frames") + "".join(parts)


def _steps(frames: Sequence[FrameEntry]) -> list[Series]:
    """Return the time of each step; what the total has beyond the steps is the last layer."""
    names = [
        n for n in dict.fromkeys(name for frame in frames for name in frame.milliseconds) if n != "total"
    ]
    steps = [
        Series(label(name), np.array([frame.milliseconds.get(name, np.nan) for frame in frames]), i)
        for i, name in enumerate(names)
    ]
    rest = np.array([total_milliseconds(frame) for frame in frames])
    for step in steps:
        rest = rest - np.nan_to_num(step.values)
    if np.nanmax(rest, initial=0) > 0.01:
        steps.append(Series("Other" if steps else "Total", np.maximum(rest, 0), 6 if steps else 0))
    return steps


def _figures_section(data: ReportData, summary: Summary) -> str:
    results = dict(data.evaluation)
    if summary.trajectory is not None and not any(
        result is summary.trajectory for result in results.values()
    ):
        results["Absolute trajectory error"] = summary.trajectory
    if data.figures:
        results["Further figures"] = data.figures
    tables = [
        f"<div><h3>{escape(str(name))}</h3>{_result_table(result)}</div>" for name, result in results.items()
    ]
    return _heading("Figures") + f'<div class="figures">{"".join(tables)}</div>' if tables else ""


def _result_table(result: Any) -> str:
    if not isinstance(result, Result):
        return _table([], flatten(result))
    units = result.units()
    values = {name: getattr(result, name) for name in units}
    columns = {name: value for name, value in values.items() if isinstance(value, tuple)}
    single = [
        (label(name), quantity(value, units[name]))
        for name, value in values.items()
        if not isinstance(value, (tuple, np.ndarray))
    ]
    table = ""
    if columns:
        heads = [label(name) for name in columns]
        rows = zip(
            *([quantity(item, units[name]) for item in value] for name, value in columns.items()), strict=True
        )
        table = _table(heads, rows)
    return table + (_table([], single) if single else "")


def _parameters_section(data: ReportData) -> str:
    rows = flatten(data.parameters)
    if not rows:
        return ""
    entries = "".join(f"<div><dt>{escape(name)}</dt><dd>{escape(value)}</dd></div>" for name, value in rows)
    return _heading("Parameters") + f'<dl class="parameters">{entries}</dl>'


def _table_section(frames: Sequence[FrameEntry]) -> str:
    if not frames:
        return ""
    chosen, title = list(frames), "Every frame"
    if len(frames) > _MAX_ROWS:
        chosen = [frame for frame in frames if frame.status.upper() != "TRACKED"][:_MAX_ROWS]
        title = f"Frames that were not simply tracked (the first {_MAX_ROWS} at most)"
        if not chosen:
            return ""
    columns: list[tuple[str, Callable[[FrameEntry], Any], str]] = [
        ("Inliers", lambda frame: frame.num_inliers, "count"),
        ("Overlap", lambda frame: frame.overlap, "fraction"),
        ("Residual", lambda frame: frame.rmse, "m"),
        ("Position error", lambda frame: frame.translation_error, "m"),
        ("Rotation error", lambda frame: frame.rotation_error, "rad"),
        ("Model points", lambda frame: frame.num_points, "count"),
        ("Time", total_milliseconds, "ms"),
    ]
    columns = [column for column in columns if np.isfinite(_values(chosen, column[1])).any()]
    heads = "".join(f'<th class="number">{name}</th>' for name, _, _ in columns)
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
        f'<h2>Table of frames</h2><details><summary>{title}</summary><div class="wide"><table>'
        f'<tr><th class="number">Frame</th><th>Status</th>{heads}<th></th></tr>{"".join(rows)}'
        "</table></div></details>"
    )


def _remark(frame: FrameEntry) -> str:
    loop = "" if frame.loop_frame is None else f"closes a loop with frame {frame.loop_frame}"
    return "; ".join(part for part in (frame.reason, loop) if part)


def _heading(text: str) -> str:
    return f"<h2>{escape(text)}</h2>"


def _pictures(pictures: Iterable[Picture], layout: str, kind: str = "") -> str:
    figures = "".join(
        f'<figure class="{kind}"><img src="{picture.uri}" alt="{escape(picture.caption, quote=True)}">'
        f"<figcaption><b>{escape(picture.caption)}</b>{escape(f', {picture.note}' if picture.note else '')}"
        "</figcaption></figure>"
        for picture in pictures
    )
    return f'<div class="grid {layout}">{figures}</div>'


def _chart(caption: str, svg: str, keys: str = "") -> str:
    lines = f"<b>{escape(caption)}</b>" + (f"<br>{keys}" if keys else "")
    return f'<figure class="chart"><figcaption>{lines}</figcaption>{svg}</figure>'


def _keys(series: Sequence[Series]) -> str:
    return "".join(
        f'<span class="key"><i class="k{one.color}"></i>{escape(one.name)}</span>' for one in series
    )


def _table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    cells = "".join(f'<th class="number">{escape(name)}</th>' for name in heads)
    head = f"<tr>{cells}</tr>" if heads else ""
    body = "".join(
        "<tr>"
        + "".join(
            f'<td class="number">{escape(cell)}</td>' if i or heads else f"<th>{escape(cell)}</th>"
            for i, cell in enumerate(row)
        )
        + "</tr>"
        for row in rows
    )
    return f"<table>{head}{body}</table>"


def _values(frames: Sequence[FrameEntry], value: Callable[[FrameEntry], float | None]) -> Array:
    return np.array([np.nan if (v := value(frame)) is None else v for frame in frames], dtype=np.float64)


def _positions(frames: Sequence[FrameEntry], pose: Callable[[FrameEntry], Any]) -> Array:
    missing = np.full(3, np.nan)
    rows = [
        missing if (p := pose(frame)) is None else np.asarray(p, dtype=np.float64)[:3, 3] for frame in frames
    ]
    return np.array(rows).reshape(-1, 3)


def _marks(frames: Sequence[FrameEntry]) -> list[Mark]:
    return [
        Mark(first, end - 1, kind)
        for kind, (_, chosen) in _MARKED.items()
        for first, end in runs(np.array([chosen(frame) for frame in frames], dtype=bool))
    ]


def _mark_keys(frames: Sequence[FrameEntry]) -> str:
    keys = "".join(
        f'<span class="key"><i class="k-{kind}"></i>{name}</span>'
        for kind, (name, chosen) in _MARKED.items()
        if any(chosen(frame) for frame in frames)
    )
    return f'<p class="note">{keys}</p>' if keys else ""


_MARKED: dict[str, tuple[str, Callable[[FrameEntry], bool]]] = {
    "lost": ("LOST", lambda frame: frame.status.upper() == "LOST"),
    "weak": ("WEAK", lambda frame: frame.status.upper() == "WEAK"),
    "relocalised": ("RELOCALISED", lambda frame: frame.status.upper() == "RELOCALISED"),
    "loop": ("loop closed", lambda frame: frame.loop_frame is not None),
}
"""Frames that charts set off, by class of the style sheet."""
