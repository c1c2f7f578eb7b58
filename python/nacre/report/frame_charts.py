"""Charts of single frames: the trajectory and its errors, figures of the registration, time."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.evaluation import AbsoluteTrajectoryError
from nacre.report.charts import Mark, Series, group_size, grouped, line_chart, map_chart, runs, stacked_chart
from nacre.report.deformation import explained_part
from nacre.report.limits import MIN_EXPLAINED
from nacre.run_data.reported_frame import ReportedFrame
from nacre.run_data.text import label, length_unit, quantity

Array = npt.NDArray[np.float64]

#: Frames that charts set off, by class of the style sheet.
_MARKED: dict[str, tuple[str, Callable[[ReportedFrame], bool]]] = {
    "lost": ("LOST", lambda frame: frame.status == "LOST"),
    "weak": ("WEAK", lambda frame: frame.status == "WEAK"),
    "relocalised": ("RELOCALISED", lambda frame: frame.status == "RELOCALISED"),
    "loop": ("loop closed", lambda frame: frame.loop_frame is not None),
}
_STEPS = {
    "preprocess": "clean depth",
    "back_project": "points and normals",
    "fuse": "fuse into the model",
}


@dataclass(frozen=True)
class ChartFigure:
    """A chart with its title, the meaning of its colours, and a word about it."""

    caption: str
    svg: str
    keys: Sequence[tuple[str, str]] = ()  #: class of the style sheet, words
    note: str = ""


def values(frames: Sequence[ReportedFrame], name: str) -> Array:
    """Return a figure of every frame; NaN where it is not known."""
    known = (getattr(frame, name) for frame in frames)
    return np.array([np.nan if value is None else value for value in known], dtype=np.float64)


def stacked_figure(
    frames: Sequence[ReportedFrame],
    caption: str,
    series: Sequence[Series],
    y_label: str,
    notes: Sequence[str] = (),
    note: str = "",
) -> ChartFigure:
    """Return a broad chart of layers, one bar per frame, with a word about each layer."""
    svg = stacked_chart(
        series, y_label=y_label, indices=[frame.index for frame in frames], width=1080, height=190
    )
    told = notes or [""] * len(series)
    keys = [(f"k{one.color}", f"{one.name} {more}".rstrip()) for one, more in zip(series, told, strict=True)]
    return ChartFigure(caption, svg, keys, note)


def trajectory_charts(
    frames: Sequence[ReportedFrame], error: AbsoluteTrajectoryError | None
) -> dict[str, Any] | None:
    """Return the camera's path, with the truth and the errors where they are known."""
    path = _positions([frame.world_from_camera if frame.is_tracked else None for frame in frames])
    if np.isfinite(path).all(axis=1).sum() < 2:
        return None
    tracks, keys = [("estimated", path, 0)], [("thin k0", "estimated")]
    truth = _positions([frame.truth for frame in frames])
    if error is not None and np.isfinite(truth).any():
        rotation, translation = error.truth_from_estimated[:3, :3], error.truth_from_estimated[:3, 3]
        tracks.insert(0, ("truth", (truth - translation) @ rotation, 1))
        keys.append(("thick k1", "truth, aligned"))
    keys.append(("ring", "first frame"))
    unit, factor = length_unit(
        float(np.nanmax(np.ptp(_finite(np.concatenate([t for _, t, _ in tracks])), axis=0)))
    )
    maps = []
    for caption, axes, names in (
        ("from above", (0, 2), ("x, to the right", "z, forward")),
        ("from the side", (2, 1), ("z, forward", "y, down")),
    ):
        seen = [(name, track[:, axes], color) for name, track, color in tracks]
        svg = map_chart(seen, x_label=names[0], y_label=names[1], y_up=axes[1] == 2, unit=unit, factor=factor)
        maps.append(ChartFigure(f"Camera trajectory, {caption}", svg, keys))
    return {"maps": maps, "errors": _error_charts(frames, error), "marked": _marked(frames)}


def _error_charts(
    frames: Sequence[ReportedFrame], error: AbsoluteTrajectoryError | None
) -> list[ChartFigure]:
    translation, rotation = values(frames, "translation_error"), values(frames, "rotation_error")
    if error is not None and not np.isfinite(translation).any() and len(error.errors) == len(frames):
        translation, rotation = error.errors, error.rotation_errors
    charts = []
    if np.isfinite(translation).any():
        charts.append(_length_figure(frames, "Position error (ATE)", translation, "position"))
    if np.isfinite(rotation).any():
        one = Series("", np.degrees(rotation))
        charts.append(_line_figure(frames, "Rotation error", [one], "rotation [\N{DEGREE SIGN}]"))
    return charts


def registration_charts(
    frames: Sequence[ReportedFrame], parameters: Mapping[str, Any]
) -> dict[str, Any] | None:
    """Return what is known of each frame's registration, and how the model grew."""
    if len(frames) < 2:
        return None
    registered = np.array([frame.num_inliers != 0 for frame in frames])

    def known(name: str) -> Array:
        return np.where(registered, values(frames, name), np.nan)

    charts = []
    overlap, consistency, score, rmse = map(known, ("overlap", "consistency", "score", "rmse"))
    if np.isfinite(overlap).any():
        both = [
            Series("inlier ratio", 100 * overlap, 0),
            Series("free-space violations", 100 * (1 - consistency), 5),
        ]
        both = [one for one in both if np.isfinite(one.values).any()]
        title = "Inlier ratio and free-space violations"
        charts.append(_line_figure(frames, title, both, "part [%]", y_max=100))
    if np.isfinite(score).any():
        least = parameters.get("min_score")
        note = f"a frame below {least:g} is lost" if isinstance(least, float) else ""
        title, one = "Registration score", Series("", score)
        charts.append(_line_figure(frames, title, [one], title.lower(), note=note, level=least))
    if np.isfinite(rmse).any():
        charts.append(_length_figure(frames, "Inlier RMSE", rmse, "RMSE"))
    num_points = values(frames, "num_points")
    if np.nanmax(num_points, initial=0) > 0:
        one = Series("", num_points / 1000)
        charts.append(_line_figure(frames, "Size of the model", [one], "thousand points"))
    if not charts:
        return None
    return {"charts": charts, "marked": _marked(frames), "group_size": group_size(len(frames))}


def deformation_charts(frames: Sequence[ReportedFrame]) -> dict[str, Any] | None:
    """Return what each frame showed of a model that deforms, and how far it was strained."""
    if len(frames) < 2:
        return None
    parts = np.array([np.nan if (part := explained_part(frame)) is None else part for frame in frames])
    strains = np.array([(frame.deformation or {}).get("strain", np.nan) for frame in frames], np.float64)
    charts = []
    if np.isfinite(parts).any():
        one, level = Series("", 100 * parts), 100 * MIN_EXPLAINED
        charts.append(_line_figure(frames, "Explained", [one], "part [%]", y_max=100, level=level))
    if np.isfinite(strains).any():
        charts.append(_line_figure(frames, "Strain", [Series("", 100 * strains)], "strain [%]"))
    return {"charts": charts, "marked": _marked(frames), "group_size": group_size(len(frames))}


def time_chart(frames: Sequence[ReportedFrame]) -> ChartFigure | None:
    """Return how long each step took, in each frame."""
    steps = _steps(frames)
    if not steps:
        return None
    total = float(sum(np.nansum(step.values) for step in steps))
    notes = [
        f"{quantity(float(np.nanmedian(step.values)), 'ms')}, "
        f"{quantity(float(np.nansum(step.values)) / total, 'fraction')}"
        for step in steps
    ]
    title, note = "Time per step of each frame", "median of a frame and part of the whole"
    return stacked_figure(frames, title, steps, "time [ms]", notes, note)


def _steps(frames: Sequence[ReportedFrame]) -> list[Series]:
    """Return the time of each step that takes any; what the total has beyond the steps is the last layer."""
    names = list(dict.fromkeys(name for frame in frames for name in frame.milliseconds if name != "total"))
    rest = values(frames, "total_milliseconds")
    all_time = float(np.nansum(rest))
    steps = []
    for i, name in enumerate(names):
        times = np.array([frame.milliseconds.get(name, np.nan) for frame in frames])
        if np.nansum(times) > 0.001 * all_time:
            steps.append(Series(_STEPS.get(name, label(name).lower()), times, i))
            rest = rest - np.nan_to_num(times)
    if np.nanmax(rest, initial=0) > 0.01 and np.nansum(rest) > 0.001 * all_time:
        steps.append(Series("other" if steps else "total", np.maximum(rest, 0), 6 if steps else 0))
    return steps


def _length_figure(frames: Sequence[ReportedFrame], caption: str, metres: Array, y_label: str) -> ChartFigure:
    unit, factor = length_unit(float(np.nanmax(metres)))
    return _line_figure(frames, caption, [Series("", metres * factor)], f"{y_label} [{unit}]")


def _line_figure(
    frames: Sequence[ReportedFrame],
    caption: str,
    series: Sequence[Series],
    y_label: str,
    *,
    note: str = "",
    **more: Any,
) -> ChartFigure:
    indices = [frame.index for frame in frames]
    svg = line_chart(series, y_label=y_label, indices=indices, marks=_marks(frames), **more)
    keys = [(f"k{one.color}", one.name) for one in series] if len(series) > 1 else []
    return ChartFigure(caption, svg, keys, note)


def _marks(frames: Sequence[ReportedFrame]) -> list[Mark]:
    """Return the frames that charts set off; where they draw groups, each group that has one."""
    size, last = group_size(len(frames)), len(frames) - 1
    found = []
    for kind, (_, chosen) in _MARKED.items():
        groups = grouped(np.array([chosen(frame) for frame in frames], dtype=np.float64))[2] > 0
        found += [Mark(first * size, min(end * size - 1, last), kind) for first, end in runs(groups)]
    return found


def _marked(frames: Sequence[ReportedFrame]) -> list[tuple[str, str]]:
    """Return what the marks mean that occur."""
    return [(kind, name) for kind, (name, chosen) in _MARKED.items() if any(map(chosen, frames))]


def _positions(poses: Sequence[Any]) -> Array:
    """Return where poses are, (F, 3); NaN where it is not known."""
    rows = [np.full(3, np.nan) if pose is None else np.asarray(pose, np.float64)[:3, 3] for pose in poses]
    return np.array(rows).reshape(-1, 3)


def _finite(rows: Array) -> Array:
    return rows[np.isfinite(rows).all(axis=1)]
