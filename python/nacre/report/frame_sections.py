"""The sections on the trajectory and on single frames: errors, figures of the registration, time."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from nacre.evaluation import AbsoluteTrajectoryError
from nacre.report.charts import (
    Series,
    group_size,
    length_unit,
    line_chart,
    map_chart,
    stacked_chart,
)
from nacre.report.markup import chart, heading, keys, mark_keys, marks, positions, values
from nacre.report.reported_frame import ReportedFrame
from nacre.report.summary import is_tracked, total_milliseconds
from nacre.report.text import label, quantity

_STEPS = {
    "preprocess": "clean depth",
    "back_project": "points and normals",
    "fuse": "fuse into the model",
}


def trajectory_section(frames: Sequence[ReportedFrame], error: AbsoluteTrajectoryError | None) -> str:
    """Return the camera's path, with the truth and the errors where they are known."""
    path = positions(frames, lambda frame: frame.world_from_camera if is_tracked(frame) else None)
    if np.isfinite(path).all(axis=1).sum() < 2:
        return ""
    tracks = [("estimated", path, 0)]
    truth = positions(frames, lambda frame: frame.truth)
    key = '<span class="key"><i class="thin k0"></i>estimated</span>'
    if error is not None and np.isfinite(truth).any():
        rotation, translation = error.truth_from_estimated[:3, :3], error.truth_from_estimated[:3, 3]
        tracks.insert(0, ("truth", (truth - translation) @ rotation, 1))
        key += '<span class="key"><i class="thick k1"></i>truth, aligned</span>'
    key += '<span class="key">○ first frame</span>'
    extent = np.concatenate([track for _, track, _ in tracks])
    unit, factor = length_unit(float(np.nanmax(np.ptp(extent[np.isfinite(extent).all(axis=1)], axis=0))))
    maps = []
    for caption, axes, names in (
        ("From above", (0, 2), ("x, to the right", "z, forward")),
        ("From the side", (2, 1), ("z, forward", "y, down")),
    ):
        lines = [(name, track[:, axes], color) for name, track, color in tracks]
        svg = map_chart(
            lines, x_label=names[0], y_label=names[1], y_up=axes[1] == 2, unit=unit, factor=factor
        )
        maps.append(chart(f"Path of the camera, {caption[0].lower()}{caption[1:]}", svg, key))
    parts = [heading("Trajectory", "trajectory"), f'<div class="grid two">{"".join(maps)}</div>']
    errors = _error_charts(frames, error)
    parts.append(errors or '<p class="note">The recording has no true poses to compare with.</p>')
    return "".join(parts)


def _error_charts(frames: Sequence[ReportedFrame], error: AbsoluteTrajectoryError | None) -> str:
    translation = values(frames, lambda frame: frame.translation_error)
    rotation = values(frames, lambda frame: frame.rotation_error)
    if error is not None and not np.isfinite(translation).any() and len(error.errors) == len(frames):
        translation, rotation = error.errors, error.rotation_errors
    charts = []
    if np.isfinite(translation).any():
        unit, factor = length_unit(float(np.nanmax(translation)))
        charts.append(
            _line(frames, "Position error", [Series("", translation * factor)], f"position [{unit}]")
        )
    if np.isfinite(rotation).any():
        one = [Series("", np.degrees(rotation))]
        charts.append(_line(frames, "Rotation error", one, "rotation [\N{DEGREE SIGN}]"))
    return f'{mark_keys(frames)}<div class="grid two">{"".join(charts)}</div>' if charts else ""


def frames_section(frames: Sequence[ReportedFrame], parameters: Mapping[str, Any]) -> str:
    """Return what is known of each frame's registration, and the time of its steps."""
    if len(frames) < 2:
        return ""

    def registered(value: Callable[[ReportedFrame], float | None]) -> np.ndarray:
        return values(frames, lambda frame: value(frame) if frame.num_inliers != 0 else None)

    charts = []
    overlap, consistency = registered(lambda f: f.overlap), registered(lambda f: f.consistency)
    if np.isfinite(overlap).any():
        both = [
            Series("matches the model", 100 * overlap, 0),
            Series("not seen through", 100 * consistency, 2),
        ]
        both = [one for one in both if np.isfinite(one.values).any()]
        charts.append(_line(frames, "Overlap and consistency", both, "part of the frame [%]", y_max=100))
    score = registered(lambda frame: frame.score)
    if np.isfinite(score).any():
        least = parameters.get("min_score")
        told = f"a frame below {least:g} is lost" if isinstance(least, float) else ""
        charts.append(
            _line(
                frames,
                "Registration score",
                [Series("", score)],
                "registration score",
                note=told,
                level=least,
            )
        )
    rmse = registered(lambda frame: frame.rmse)
    if np.isfinite(rmse).any():
        unit, factor = length_unit(float(np.nanmax(rmse)))
        charts.append(
            _line(
                frames,
                "Residual of the registration (RMS)",
                [Series("", rmse * factor)],
                f"residual [{unit}]",
            )
        )
    num_points = values(frames, lambda frame: frame.num_points)
    if np.nanmax(num_points, initial=0) > 0:
        charts.append(_line(frames, "Size of the model", [Series("", num_points / 1000)], "thousand points"))
    parts = [f'{mark_keys(frames)}<div class="grid two">{"".join(charts)}</div>'] if charts else []
    size = group_size(len(frames))
    if size > 1:
        note = f"Lines are means over {size} frames, bands reach from the least to the greatest value."
        parts.append(f'<p class="note">{note}</p>')
    return heading("Frames", "frames") + "".join(parts) if parts else ""


def _line(
    frames: Sequence[ReportedFrame],
    caption: str,
    series: Sequence[Series],
    y_label: str,
    *,
    y_max: float | None = None,
    note: str = "",
    level: float | None = None,
) -> str:
    svg = line_chart(
        series,
        y_label=y_label,
        indices=[frame.index for frame in frames],
        marks=marks(frames),
        y_max=y_max,
        level=level,
    )
    return chart(caption, svg, keys(series) if len(series) > 1 else "", note)


def time_section(frames: Sequence[ReportedFrame]) -> str:
    """Return how long each step took, in each frame."""
    steps = _steps(frames)
    if not steps:
        return ""
    total = float(sum(np.nansum(step.values) for step in steps))
    told = [
        f"{quantity(float(np.nanmedian(step.values)), 'ms')}, "
        f"{quantity(float(np.nansum(step.values)) / total, 'fraction')}"
        for step in steps
    ]
    indices = [frame.index for frame in frames]
    svg = stacked_chart(steps, y_label="time [ms]", indices=indices, width=1080, height=210)
    title = "Time per step of each frame"
    return heading("Time", "time") + chart(
        title, svg, keys(steps, told), "median of a frame and part of the whole"
    )


def _steps(frames: Sequence[ReportedFrame]) -> list[Series]:
    """Return the time of each step that takes any; what the total has beyond the steps is the last layer."""
    names = list(dict.fromkeys(name for frame in frames for name in frame.milliseconds if name != "total"))
    times = {name: np.array([frame.milliseconds.get(name, np.nan) for frame in frames]) for name in names}
    rest = np.array([total_milliseconds(frame) for frame in frames])
    all_time = float(np.nansum(rest))
    steps = []
    for i, name in enumerate(names):
        if np.nansum(times[name]) > 0.001 * all_time:
            steps.append(Series(_STEPS.get(name, label(name).lower()), times[name], i))
            rest = rest - np.nan_to_num(times[name])
    if np.nanmax(rest, initial=0) > 0.01 and np.nansum(rest) > 0.001 * all_time:
        steps.append(Series("other" if steps else "total", np.maximum(rest, 0), 6 if steps else 0))
    return steps
