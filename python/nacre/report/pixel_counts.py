"""Where the points were lost: how many pixels came through each step, of all frames and of each."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from nacre.pictures.colormap import reason_color
from nacre.report.charts import Series
from nacre.report.frame_charts import ChartFigure, stacked_figure, values
from nacre.run_data.reported_frame import ReportedFrame
from nacre.run_data.text import label, quantity

_USED, _MISSING, _DROPPED, _OUTSIDE = 7, 6, 8, 9  # indices of the palette


class Row(NamedTuple):
    """How many pixels are left after a step, and how many it took."""

    name: str
    num: int
    lost: str = ""  #: in words


def pixel_counts(frames: Sequence[ReportedFrame]) -> dict[str, Any] | None:
    """Return how many pixels came through each step; None where that is not known."""
    known = [frame for frame in frames if frame.num_pixels and frame.num_measured is not None]
    if not known:
        return None
    total, measured = (
        sum(getattr(frame, name) for frame in known) for name in ("num_pixels", "num_measured")
    )
    gone = {name: sum(frame.removed.get(name, 0) for frame in known) for name in _reasons(known)}
    outside = gone.pop("outside", 0)
    clean = measured - sum(gone.values())
    fused = sum(_num_usable(frame) for frame in known if _is_fused(frame))
    rows = [
        Row("Pixels of all frames", total),
        Row("with a measurement", measured, _lost(total - measured, total)),
        Row("after cleaning", clean, _lost(measured - clean, total, gone)),
        Row("in frames that were fused", fused, _lost(clean - outside - fused, total)),
    ]
    if outside:
        rows.insert(3, Row("in the region of interest", clean - outside, _lost(outside, total)))
    return {
        "rows": rows,
        "moved": sum(frame.num_updated or 0 for frame in known),
        "added": sum(frame.num_inserted or 0 for frame in known),
        "left": next((f.num_points for f in reversed(known) if f.num_points is not None), None),
        "chart": _chart(frames) if len(frames) > 1 else None,
    }


def removed_chart(frames: Sequence[ReportedFrame]) -> ChartFigure | None:
    """Return how many pixels cleaning removed from each frame, by reason."""
    series = [one for name, one in _removed(frames).items() if name != "outside"]
    if len(frames) < 2 or not series:
        return None
    return stacked_figure(frames, "Pixels that cleaning removed from each frame", series, "thousand pixels")


def _lost(num: int, total: int, reasons: dict[str, int] | None = None) -> str:
    if not num:
        return ""
    causes = [
        f"{label(name).lower()} {quantity(n / total, 'fraction')}" for name, n in (reasons or {}).items()
    ]
    more = f": {', '.join(causes)}" if len(causes) > 1 else ""
    return f"\N{MINUS SIGN}{quantity(num / total, 'fraction')}{more}"


def _chart(frames: Sequence[ReportedFrame]) -> ChartFigure:
    usable = np.array([_num_usable(frame) for frame in frames]) / 1000
    fused = np.array([_is_fused(frame) for frame in frames])
    measured, pixels = values(frames, "num_measured"), values(frames, "num_pixels")
    series = [
        Series("fused", usable * fused, _USED),
        Series("usable, but LOST or WEAK", usable * ~fused, _DROPPED),
        *(Series(one.name.lower(), one.values, one.color) for one in _removed(frames).values()),
        Series("not measured", (pixels - measured) / 1000, _MISSING),
    ]
    series = [one for one in series if np.nansum(one.values) > 0]
    return stacked_figure(frames, "What became of the pixels of each frame", series, "thousand pixels")


def _removed(frames: Sequence[ReportedFrame]) -> dict[str, Series]:
    return {
        name: Series(
            label(name),
            np.array([frame.removed.get(name, 0) / 1000 for frame in frames]),
            _OUTSIDE if name == "outside" else reason_color(name, i),
        )
        for i, name in enumerate(_reasons(frames))
    }


def _reasons(frames: Sequence[ReportedFrame]) -> list[str]:
    return list(dict.fromkeys(name for frame in frames for name, num in frame.removed.items() if num))


def _num_usable(frame: ReportedFrame) -> int:
    return (frame.num_measured or 0) - sum(frame.removed.values())


def _is_fused(frame: ReportedFrame) -> bool:
    return frame.status in ("TRACKED", "RELOCALISED")
