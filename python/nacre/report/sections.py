"""The sections on the model and on depth images."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

import numpy as np

from nacre.report.charts import Series, stacked_chart
from nacre.report.colormap import CATEGORIES
from nacre.report.data import DepthExample
from nacre.report.depth_pictures import draw_depth, reason_color
from nacre.report.markup import chart, color_bar, heading, keys, pictures, values
from nacre.report.pictures import Attribute, ModelPictures, is_logarithmic
from nacre.report.reported_frame import ReportedFrame
from nacre.report.text import count, label, quantity

_USED, _MISSING, _DROPPED, _OUTSIDE = 7, 6, 8, 9  # indices of the palette


def model_section(model: ModelPictures | None) -> str:
    """Return the model from all sides, and what its points tell as colour."""
    if model is None:
        return ""
    length, part = model.scale_bar
    parts = [heading("Model", "model")]
    if model.cameras:
        parts.append(pictures(model.cameras, "three"))
    parts.append(
        '<p class="note">From six sides, at one scale. Front is what the first camera saw; brown are reverse '
        "sides of surfaces.</p>"
    )
    parts.append(pictures(model.sides, "three"))
    parts.append(
        f'<div class="grid three"><p class="scale"><i style="width:{100 * part:.2f}%"></i>{escape(length)}, '
        "in all six pictures</p></div>"
    )
    low, high = model.spacing.range
    log = is_logarithmic(low, high)
    bar = color_bar("Distance to the nearest point", low, high, "m", logarithmic=log) if high > 0 else ""
    typical = quantity(model.spacing.typical, "m")
    told = f"Half of the points have a neighbour within {typical}; even colour is even sampling."
    parts.append(_attribute("How evenly the points are spread", model.spacing, bar, told))
    if model.confidence is not None:
        low, high = model.confidence.range
        bar = color_bar(
            "Frontal observations that a point stands for",
            low,
            high,
            "",
            logarithmic=is_logarithmic(low, high),
        )
        typical = f"{model.confidence.typical:.3g}"
        told = f"The median is {typical}. Dark is what few frames saw, from afar or at a slant."
        parts.append(_attribute("How well each point is known", model.confidence, bar, told))
    if model.colors:
        parts.append('<h3 class="sub">Colour</h3>' + pictures(model.colors, "two"))
    return "".join(parts)


def _attribute(title: str, attribute: Attribute, bar: str, told: str) -> str:
    return (
        f'<div class="attribute"><h3 class="sub">{escape(title)}</h3>{bar}<p class="note">{escape(told)}</p>'
        f"{pictures(attribute.pictures, 'two')}</div>"
    )


def depth_section(examples: Sequence[DepthExample], frames: Sequence[ReportedFrame]) -> str:
    """Return depth images before and after cleaning, and what was removed from each frame."""
    if not examples:
        return ""
    parts = [heading("Depth before and after cleaning", "depth")]
    parts += [_depth_example(example) for example in examples]
    reasons = _reasons(frames)
    if reasons and len(frames) > 1:
        series = [
            Series(
                label(reason),
                np.array([frame.removed.get(reason, 0) / 1000 for frame in frames]),
                reason_color(reason, i),
            )
            for i, reason in enumerate(reasons)
            if reason != "outside"
        ]
        if any(one.values.any() for one in series):
            svg = stacked_chart(
                series,
                y_label="thousand pixels",
                indices=[frame.index for frame in frames],
                width=1080,
                height=170,
            )
            parts.append(chart("Pixels that cleaning removed from each frame", svg, keys(series)))
    return "".join(parts)


def _depth_example(example: DepthExample) -> str:
    drawn = draw_depth(example)
    low, high = drawn.range
    told = "".join(
        f'<span class="key"><i style="background:{CATEGORIES[color % len(CATEGORIES)]}"></i>'
        f"{escape(label(name))} {quantity(num / max(drawn.num_measured, 1), 'fraction')}</span>"
        for name, color, num in drawn.removed
        if num
    )
    note = f", {example.note}" if example.note else ""
    part = quantity(drawn.num_measured / max(np.size(example.before), 1), "fraction")
    bar = color_bar("Depth", low, high, "m", kind="near", inverse=True) if drawn.num_measured else ""
    return (
        f'<h3 class="sub">Frame {example.index}{escape(note)}</h3>{bar}'
        f'<p class="note">{part} of the pixels have a measurement. Removed of these: {told or "none"}</p>'
        + pictures(drawn.pictures, "three", "depth")
    )


def funnel_section(frames: Sequence[ReportedFrame]) -> str:
    """Return how many pixels came through each step, of all frames and of each."""
    known = [frame for frame in frames if frame.num_pixels and frame.num_measured is not None]
    if not known:
        return ""
    total = sum(frame.num_pixels or 0 for frame in known)
    left = total
    rows = [_funnel_row("Pixels of all frames", left, total)]
    measured = sum(frame.num_measured or 0 for frame in known)
    rows.append(_funnel_row("with a measurement", measured, total, left - measured))
    left, reasons = measured, _reasons(known)
    for name, chosen in (
        ("after cleaning", [reason for reason in reasons if reason != "outside"]),
        ("in the region of interest", [reason for reason in reasons if reason == "outside"]),
    ):
        if chosen or name == "after cleaning":
            gone = {reason: sum(frame.removed.get(reason, 0) for frame in known) for reason in chosen}
            left -= sum(gone.values())
            rows.append(_funnel_row(name, left, total, sum(gone.values()), gone))
    dropped = sum(_num_usable(frame) for frame in known if not _is_folded_in(frame))
    rows.append(_funnel_row("in frames that were fused", left - dropped, total, dropped))
    moved = sum(frame.num_updated or 0 for frame in known)
    added = sum(frame.num_inserted or 0 for frame in known)
    points = next((frame.num_points for frame in reversed(known) if frame.num_points is not None), None)
    told = (
        f"These pixels moved points of the model {count(moved)} times and added {count(added)} points"
        + (f", of which {count(points)} are left" if points is not None and points <= added else "")
        + ". A point stands for many pixels: it is moved again by each frame that sees it."
        if added
        else "Nothing came into the model."
    )
    parts = [heading("Where the points were lost", "funnel"), f'<div class="funnel">{"".join(rows)}</div>']
    parts.append(f'<p class="note">{told}</p>')
    if len(frames) > 1:
        parts.append(_funnel_chart(frames, reasons))
    return "".join(parts)


def _funnel_row(name: str, num: int, total: int, gone: int = 0, reasons: dict[str, int] | None = None) -> str:
    causes = ", ".join(
        f"{label(reason).lower()} {quantity(number / total, 'fraction')}"
        for reason, number in (reasons or {}).items()
        if number
    )
    lost = (
        f"\N{MINUS SIGN}{quantity(gone / total, 'fraction')}{f': {causes}' if ',' in causes else ''}"
        if gone
        else ""
    )
    return (
        f'<div class="row"><span>{escape(name)}</span>'
        f'<div class="track"><i style="width:{100 * num / total:.2f}%"></i></div>'
        f"<b>{quantity(num / total, 'fraction')}</b><small>{count(num)}</small>"
        f"<small>{escape(lost)}</small></div>"
    )


def _funnel_chart(frames: Sequence[ReportedFrame], reasons: Sequence[str]) -> str:
    folded = [_num_usable(frame) if _is_folded_in(frame) else 0 for frame in frames]
    dropped = [0 if _is_folded_in(frame) else _num_usable(frame) for frame in frames]
    missing = values(frames, lambda f: None if f.num_pixels is None else f.num_pixels - (f.num_measured or 0))
    layers = [
        ("fused", np.array(folded, float), _USED),
        ("usable, but LOST or WEAK", np.array(dropped, float), _DROPPED),
        *(
            (
                label(reason).lower(),
                np.array([float(f.removed.get(reason, 0)) for f in frames]),
                _OUTSIDE if reason == "outside" else reason_color(reason, i),
            )
            for i, reason in enumerate(reasons)
        ),
        ("not measured", missing, _MISSING),
    ]
    series = [Series(name, layer / 1000, color) for name, layer, color in layers if np.nansum(layer) > 0]
    svg = stacked_chart(
        series, y_label="thousand pixels", indices=[frame.index for frame in frames], width=1080, height=190
    )
    return chart("What became of the pixels of each frame", svg, keys(series))


def _reasons(frames: Sequence[ReportedFrame]) -> list[str]:
    return list(dict.fromkeys(name for frame in frames for name, num in frame.removed.items() if num))


def _num_usable(frame: ReportedFrame) -> int:
    return (frame.num_measured or 0) - sum(frame.removed.values())


def _is_folded_in(frame: ReportedFrame) -> bool:
    return frame.status.upper() in ("TRACKED", "RELOCALISED")
