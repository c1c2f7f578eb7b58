"""Pieces of the page that several sections use."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Sequence
from html import escape
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.report.charts import Mark, Series, length_unit, number, runs, ticks
from nacre.report.pictures import Picture
from nacre.report.reported_frame import ReportedFrame

Array = npt.NDArray[np.float64]


def heading(text: str, name: str) -> str:
    """Return a section's title, which links may go to."""
    return f'<h2 id="{name}">{escape(text)}</h2>'


def pictures(shown: Iterable[Picture], layout: str, kind: str = "") -> str:
    """Return pictures with their captions, side by side."""
    figures = "".join(
        f'<figure class="picture {kind}"><img src="{picture.uri}" width="{picture.size[0]}" '
        f'height="{picture.size[1]}" data-name="{slug(picture.caption)}" '
        f'alt="{escape(picture.alt or picture.caption, quote=True)}">'
        f"<figcaption><b>{escape(picture.caption)}</b>{escape(f', {picture.note}' if picture.note else '')}"
        "</figcaption></figure>"
        for picture in shown
    )
    return f'<div class="grid {layout}">{figures}</div>'


def slug(text: str) -> str:
    """Return words as a name for a file."""
    return re.sub(r"\W+", "-", text.lower()).strip("-")


def chart(caption: str, svg: str, keys: str = "", note: str = "") -> str:
    """Return a chart with its title and keys; narrow screens scroll it."""
    told = f'<span class="note">, {escape(note)}</span>' if note else ""
    lines = f"<b>{escape(caption)}</b>{told}" + (f"<br>{keys}" if keys else "")
    return f'<figure class="chart"><figcaption>{lines}</figcaption>{scrolled(svg, caption)}</figure>'


def scrolled(wide: str, name: str) -> str:
    """Return something wide in a frame that narrow screens scroll, also by keyboard."""
    alt = escape(name, quote=True)
    return f'<div class="scroll" tabindex="0" role="group" aria-label="{alt}">{wide}</div>'


def keys(series: Sequence[Series], notes: Sequence[str] = ()) -> str:
    """Return the colours of a chart with their names, and a word about each."""
    told = notes or [""] * len(series)
    return "".join(
        f'<span class="key"><i class="k{one.color}"></i>{escape(f"{one.name} {note}".rstrip())}</span>'
        for one, note in zip(series, told, strict=True)
    )


def color_bar(
    title: str,
    low: float,
    high: float,
    unit: str,
    *,
    kind: str = "",
    logarithmic: bool = False,
    inverse: bool = False,
) -> str:
    """
    Return a bar of colours with round numbers beneath; ``unit`` "m" is shown as mm or m.

    The position of a value in the bar is linear, logarithmic, or linear in its inverse.
    """
    factor = 1.0
    if unit == "m":
        unit, factor = length_unit(high)
    low, high = low * factor, high * factor

    def place(value: float) -> float:
        if high <= low:
            return 0.5
        if logarithmic:
            return math.log(value / low) / math.log(high / low)
        if inverse:
            return (1 / low - 1 / value) / (1 / low - 1 / high)
        return (value - low) / (high - low)

    if logarithmic:
        decades = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
        steps = (1,) if len(decades) > 3 else (1, 3)
        marks = [m * 10.0**d for d in decades for m in steps if low <= m * 10.0**d <= high]
    elif inverse:
        marks = [
            v for v in (m * 10.0**d for d in range(-3, 6) for m in (1, 1.5, 2, 3, 5, 7)) if low <= v <= high
        ]
    else:
        marks = ticks(low, high, 4)
    shown = [(place(end), number(float(f"{end:.3g}"))) for end in (low, high)] if high > low else []
    for value in marks:
        at = place(value)
        if all(abs(at - other) > 0.15 for other, _ in shown):
            shown.append((at, number(value)))
    parts = [f'<span style="left:{100 * at:.1f}%">{text}</span>' for at, text in sorted(shown)]
    title += f" [{unit}]" * bool(unit) + " (logarithmic)" * logarithmic
    return (
        f'<div class="bar"><div class="bar-title">{escape(title)}</div>'
        f'<div class="ramp {kind}"></div><div class="ramp-ticks">{"".join(parts)}</div></div>'
    )


def table(heads: Sequence[str], rows: Iterable[Sequence[str]], *, caption: str = "") -> str:
    """Return a table of numbers; without ``heads`` its first column names the rows."""
    cells = "".join(f'<th class="number" scope="col">{escape(name)}</th>' for name in heads)
    head = f"<tr>{cells}</tr>" if heads else ""
    body = "".join(
        "<tr>"
        + "".join(
            f'<td class="number">{escape(cell)}</td>'
            if i or heads
            else f'<th scope="row">{escape(cell)}</th>'
            for i, cell in enumerate(row)
        )
        + "</tr>"
        for row in rows
    )
    told = f"<caption>{escape(caption)}</caption>" if caption else ""
    return f"<table>{told}{head}{body}</table>"


def values(frames: Sequence[ReportedFrame], value: Callable[[ReportedFrame], float | None]) -> Array:
    """Return a figure of every frame; NaN where it is not known."""
    return np.array([np.nan if (v := value(frame)) is None else v for frame in frames], dtype=np.float64)


def positions(frames: Sequence[ReportedFrame], pose: Callable[[ReportedFrame], Any]) -> Array:
    """Return the place of a pose of every frame, (F, 3); NaN where it is not known."""
    missing = np.full(3, np.nan)
    rows = [
        missing if (p := pose(frame)) is None else np.asarray(p, dtype=np.float64)[:3, 3] for frame in frames
    ]
    return np.array(rows).reshape(-1, 3)


def marks(frames: Sequence[ReportedFrame]) -> list[Mark]:
    """Return the frames that charts set off."""
    return [
        Mark(first, end - 1, kind)
        for kind, (_, chosen) in MARKED.items()
        for first, end in runs(np.array([chosen(frame) for frame in frames], dtype=bool))
    ]


def mark_keys(frames: Sequence[ReportedFrame]) -> str:
    """Return what the marks mean that occur."""
    told = "".join(
        f'<span class="key"><i class="k-{kind}"></i>{name}</span>'
        for kind, (name, chosen) in MARKED.items()
        if any(chosen(frame) for frame in frames)
    )
    return f'<p class="note">{told}</p>' if told else ""


MARKED: dict[str, tuple[str, Callable[[ReportedFrame], bool]]] = {
    "lost": ("LOST", lambda frame: frame.status.upper() == "LOST"),
    "weak": ("WEAK", lambda frame: frame.status.upper() == "WEAK"),
    "relocalised": ("RELOCALISED", lambda frame: frame.status.upper() == "RELOCALISED"),
    "loop": ("loop closed", lambda frame: frame.loop_frame is not None),
}
"""Frames that charts set off, by class of the style sheet."""
