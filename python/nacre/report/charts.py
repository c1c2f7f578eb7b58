"""Line, bar and map charts as inline SVG; the style sheet colours them, for light and for dark."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

#: More values than this are drawn in groups of equal size.
MAX_VALUES = 400

_LEFT, _RIGHT, _TOP, _BOTTOM = 56, 12, 12, 36


@dataclass(frozen=True, eq=False)
class Series:
    """One named line or layer of a chart; NaN leaves a gap."""

    name: str
    values: Array
    color: int = 0  #: index of the palette


@dataclass(frozen=True)
class Mark:
    """Frames from ``first`` to ``last`` that are set off, for instance because they were lost."""

    first: int
    last: int
    kind: str  #: class of the style sheet


def line_chart(
    series: Sequence[Series],
    *,
    y_label: str,
    x_label: str = "frame",
    indices: Sequence[int] | None = None,
    marks: Sequence[Mark] = (),
    y_max: float | None = None,
    level: float | None = None,
    width: int = 560,
    height: int = 200,
) -> str:
    """
    Draw one value per frame, from 0 upwards.

    Long series are drawn as a band between the least and the greatest value of each group of frames, so that
    no peak is lost, with the mean as its line. A dashed line stands at ``level``.
    """
    top = y_max or _largest(series)
    frame = _Frame(_num_values(series), indices, top, width, height)
    parts = [frame.marks(marks)]
    for one in series:
        low, mean, high = grouped(one.values)
        x = frame.x(np.arange(len(mean)) * frame.group + (frame.group - 1) / 2)
        if frame.group > 1:
            upper, lower = np.stack([x, frame.y(high)], 1), np.stack([x, frame.y(low)], 1)
            bands = (np.concatenate([upper[a:b], lower[a:b][::-1]]) for a, b in runs(np.isfinite(low)))
            parts.append(
                f'<path class="band f{one.color}" d="{"".join(_path(band) + "Z" for band in bands)}"/>'
            )
        parts.append(f'<path class="line s{one.color}" d="{_path(np.stack([x, frame.y(mean)], 1))}"/>')
        if len(mean) <= 60:
            radius = 2.2 if len(mean) <= 30 else 1.6
            parts += [
                f'<circle class="f{one.color}" cx="{a:.1f}" cy="{b:.1f}" r="{radius}"/>'
                for a, b in zip(x, frame.y(mean), strict=True)
                if math.isfinite(b)
            ]
    if level is not None and 0 < level <= frame.top:
        at = float(frame.y(level))
        parts.append(f'<path class="level" d="M{_LEFT} {at:.1f}H{width - _RIGHT}"/>')
    parts.append(frame.hover(series, y_label))
    return frame.svg(parts, x_label, _described(series, y_label), y_label)


def stacked_chart(
    series: Sequence[Series],
    *,
    y_label: str,
    x_label: str = "frame",
    indices: Sequence[int] | None = None,
    marks: Sequence[Mark] = (),
    width: int = 560,
    height: int = 200,
) -> str:
    """Draw layers on top of each other, one bar per frame (or per group of frames, with their mean)."""
    values = [np.nan_to_num(grouped(one.values)[1]) for one in series]
    total = np.sum(values, axis=0) if values else np.zeros(0)
    frame = _Frame(_num_values(series), indices, float(total.max(initial=0)), width, height)
    step = (width - _LEFT - _RIGHT) / max(len(total), 1)
    gap = min(0.22 * step, 3.0) if step > 3 else 0.0
    left = _LEFT + step * np.arange(len(total)) + gap / 2
    parts = [frame.marks(marks)]
    base = np.zeros(len(total))
    for one, layer in zip(series, values, strict=True):
        y, bottom = frame.y(base + layer), frame.y(base)
        path = "".join(
            f"M{a:.1f} {d:.1f}V{b:.1f}h{step - gap:.1f}V{d:.1f}Z"
            for a, b, d in zip(left, y, bottom, strict=True)
            if d - b > 0.04
        )
        parts.append(f'<path class="f{one.color}" d="{path}"/>')
        base = base + layer
    parts.append(frame.hover(series, y_label))
    return frame.svg(parts, x_label, _described(series, y_label), y_label)


def map_chart(
    tracks: Sequence[tuple[str, Array, int]],
    *,
    x_label: str,
    y_label: str,
    y_up: bool,
    unit: str,
    factor: float,
    width: int = 520,
    height: int = 320,
) -> str:
    """
    Draw tracks (N, 2), each with its name and colour, in the plane with equal scales.

    y grows upwards where ``y_up``, else downwards. ``unit`` stands at the axes; a metre has ``factor`` of it.

    The first point of the last track is marked. NaN leaves a gap.
    """
    known = [xy[np.isfinite(xy).all(axis=1)] for _, xy, _ in tracks]
    everything = np.concatenate([*known, np.zeros((0, 2))])
    if not len(everything):
        everything = np.zeros((1, 2))
    low, high = everything.min(axis=0), everything.max(axis=0)
    inner = np.array([width - _LEFT - _RIGHT, height - _TOP - _BOTTOM], dtype=np.float64)
    scale = float(max(((high - low) / (0.9 * inner)).max(), 1e-9))
    middle = (low + high) / 2
    origin = np.array([_LEFT, _TOP]) + inner / 2

    direction = np.array([1.0, -1.0 if y_up else 1.0])

    def place(xy: Array) -> Array:
        return np.asarray(origin + direction * (xy - middle) / scale)

    parts = [f'<rect class="plot" x="{_LEFT}" y="{_TOP}" width="{inner[0]:g}" height="{inner[1]:g}"/>']
    for axis in (0, 1):
        half = scale * inner[axis] / 2
        bounds = ((middle[axis] - half) * factor, (middle[axis] + half) * factor)
        for tick in ticks(*bounds, 7 if axis == 0 else 4):
            at = origin[axis] + direction[axis] * (tick / factor - middle[axis]) / scale
            if axis == 0:
                parts.append(f'<path class="grid" d="M{at:.1f} {_TOP}v{inner[1]:g}"/>')
                y = _TOP + inner[1] + 15
                parts.append(f'<text class="tick mid" x="{at:.1f}" y="{y:.1f}">{number(tick)}</text>')
            else:
                parts.append(f'<path class="grid" d="M{_LEFT} {at:.1f}h{inner[0]:g}"/>')
                parts.append(f'<text class="tick end" x="{_LEFT - 6}" y="{at + 4:.1f}">{number(tick)}</text>')
    for name, xy, color in tracks:
        thinned = xy[:: max(len(xy) // 1500, 1)]
        style = " wide" if name == "truth" else ""
        parts.append(f'<path class="line s{color}{style}" d="{_path(place(thinned))}"/>')
        if len(xy) <= 60 and not style:
            dots = place(xy[np.isfinite(xy).all(axis=1)])
            parts += [f'<circle class="f{color}" cx="{a:.1f}" cy="{b:.1f}" r="2"/>' for a, b in dots]
    if known and len(known[-1]):
        x, y = place(known[-1][:1])[0]
        parts.append(
            f'<circle class="start" cx="{x:.1f}" cy="{y:.1f}" r="5"><title>first frame</title></circle>'
        )
    parts.append(_axis_labels(f"{x_label} [{unit}]", f"{y_label} [{unit}]", width, height))
    return _svg(parts, width, height, f"{y_label} over {x_label}")


def status_strip(states: Sequence[str], description: str, width: int = 1000, height: int = 16) -> str:
    """Draw the states of all frames as a bar; what is rare stays visible."""
    step = width / max(len(states), 1)
    parts = [f'<rect class="st-tracked" width="{width}" height="{height}"/>']
    for kind in ("RELOCALISED", "WEAK", "LOST"):
        bars = [
            f"M{first * step:.1f} 0h{max((end - first) * step, 2):.1f}v{height}H{first * step:.1f}Z"
            for first, end in runs(np.array([state == kind for state in states], dtype=bool))
        ]
        if bars:
            parts.append(f'<path class="st-{kind.lower()}" d="{"".join(bars)}"/>')
    aspect = ' preserveAspectRatio="none"'
    return (
        f'<svg viewBox="0 0 {width} {height}"{aspect} role="img" '
        f'aria-label="{escape(description, quote=True)}">{"".join(parts)}</svg>'
    )


def grouped(values: Array) -> tuple[Array, Array, Array]:
    """Return the least, mean and greatest value of each group of neighbours; NaN where a group has none."""
    size = group_size(len(values))
    padded = np.full(-(-len(values) // size) * size if len(values) else 0, np.nan)
    padded[: len(values)] = values
    table = padded.reshape(-1, size)
    known = np.isfinite(table)
    count = known.sum(axis=1)
    mean = np.where(known, table, 0).sum(axis=1) / np.where(count > 0, count, 1)
    low = np.where(known, table, np.inf).min(axis=1, initial=np.inf)
    high = np.where(known, table, -np.inf).max(axis=1, initial=-np.inf)
    return tuple(np.where(count > 0, statistic, np.nan) for statistic in (low, mean, high))  # type: ignore[return-value]


def runs(mask: npt.NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Return where each run of true values begins and ends (exclusive)."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8)))
    return [(int(first), int(end)) for first, end in edges.reshape(-1, 2)]


def group_size(num_values: int) -> int:
    """Return how many neighbouring frames a chart draws as one."""
    return max(-(-num_values // MAX_VALUES), 1)


def ticks(low: float, high: float, count: int = 4) -> list[float]:
    """Return about ``count`` round numbers between two bounds."""
    span = high - low
    if not (math.isfinite(span) and span > 0):
        return [low]
    rough = span / count
    power = 10 ** math.floor(math.log10(rough))
    step = next(factor * power for factor in (1, 2, 2.5, 5, 10) if factor * power >= rough * 0.999)
    return [i * step for i in range(math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9) + 1)]


def length_unit(metres: float) -> tuple[str, float]:
    """Return the unit in which a length reads well, and how many of it are in a metre."""
    if not math.isfinite(metres) or metres >= 2:
        return "m", 1.0
    return ("mm", 1e3) if metres >= 5e-5 else ("µm", 1e6)


class _Frame:
    """The axes of a chart with frames to the right and values from 0 upwards."""

    def __init__(
        self, num_frames: int, indices: Sequence[int] | None, top: float, width: int, height: int
    ) -> None:
        self.num_frames = num_frames
        self.indices = list(range(num_frames)) if indices is None else list(indices)
        self.group = group_size(num_frames)
        self.top = top * 1.06 if math.isfinite(top) and top > 0 else 1.0
        self.width, self.height = width, height

    def x(self, position: npt.ArrayLike) -> Array:
        inner = self.width - _LEFT - _RIGHT
        return np.asarray(
            _LEFT + (np.asarray(position, dtype=np.float64) + 0.5) * inner / max(self.num_frames, 1)
        )

    def y(self, value: npt.ArrayLike) -> Array:
        inner = self.height - _TOP - _BOTTOM
        return np.asarray(self.height - _BOTTOM - np.asarray(value, dtype=np.float64) / self.top * inner)

    def marks(self, marks: Sequence[Mark]) -> str:
        height = self.height - _TOP - _BOTTOM
        parts = []
        for mark in marks:
            left, right = self.x(mark.first - 0.5), self.x(mark.last + 0.5)
            width = max(float(right - left), 1.5)
            parts.append(
                f'<rect class="{mark.kind}" x="{left:.1f}" y="{_TOP}" width="{width:.1f}" height="{height}"/>'
            )
        return "".join(parts)

    def hover(self, series: Sequence[Series], y_label: str) -> str:
        """Give every frame an invisible bar that says its values; long recordings go without."""
        if self.num_frames > 300:
            return ""
        width = (self.width - _LEFT - _RIGHT) / max(self.num_frames, 1)
        height = self.height - _TOP - _BOTTOM
        parts = []
        for i in range(self.num_frames):
            told = [f"frame {self.indices[i]}"]
            told += [
                f"{one.name or y_label} {one.values[i]:.4g}" for one in series if math.isfinite(one.values[i])
            ]
            left = float(self.x(i)) - width / 2
            parts.append(
                f'<rect class="hover" x="{left:.1f}" y="{_TOP}" width="{width:.1f}" height="{height}">'
                f"<title>{escape(', '.join(told))}</title></rect>"
            )
        return "".join(parts)

    def svg(self, parts: Sequence[str], x_label: str, description: str, y_label: str) -> str:
        axes = []
        for tick in ticks(0, self.top, 4):
            at = float(self.y(tick))
            kind = "grid" if tick else "axis"
            axes.append(f'<path class="{kind}" d="M{_LEFT} {at:.1f}H{self.width - _RIGHT}"/>')
            axes.append(f'<text class="tick end" x="{_LEFT - 6}" y="{at + 4:.1f}">{number(tick)}</text>')
        last = max(self.num_frames - 1, 0)
        for tick in ticks(0, last, 8) if last else [0.0]:
            if tick == int(tick) and int(tick) < len(self.indices):
                at = float(self.x(tick))
                y = self.height - _BOTTOM
                axes.append(f'<path class="axis" d="M{at:.1f} {y}v4"/>')
                axes.append(
                    f'<text class="tick mid" x="{at:.1f}" y="{y + 16}">{self.indices[int(tick)]}</text>'
                )
        axes.append(_axis_labels(x_label, y_label, self.width, self.height))
        return _svg([*axes, *parts], self.width, self.height, description)


def _axis_labels(x_label: str, y_label: str, width: int, height: int) -> str:
    x, y = _LEFT + (width - _LEFT - _RIGHT) / 2, _TOP + (height - _TOP - _BOTTOM) / 2
    return (
        f'<text class="label mid" x="{x:g}" y="{height - 4}">{escape(x_label)}</text>'
        f'<text class="label mid" transform="translate(12 {y:g}) rotate(-90)">{escape(y_label)}</text>'
    )


def _svg(parts: Sequence[str], width: int, height: int, description: str) -> str:
    kind = ' class="broad"' if width > 800 else ""
    alt = escape(description, quote=True)
    return f'<svg{kind} viewBox="0 0 {width} {height}" role="img" aria-label="{alt}">{"".join(parts)}</svg>'


def _described(series: Sequence[Series], y_label: str) -> str:
    """Return a chart in words, for those who do not see it."""
    told = []
    for one in series:
        known = one.values[np.isfinite(one.values)]
        if len(known):
            low, middle, high = (f"{value:.4g}" for value in (known.min(), np.median(known), known.max()))
            told.append(f"{one.name or y_label}: least {low}, median {middle}, greatest {high}")
    return f"{y_label} of every frame; " + "; ".join(told)


def _path(xy: Array) -> str:
    """Return the path through points, with a gap at each that is not finite."""
    parts, pen_down = [], False
    for x, y in xy:
        if not (math.isfinite(x) and math.isfinite(y)):
            pen_down = False
            continue
        parts.append(f"L{x:.1f} {y:.1f}" if pen_down else f"M{x:.1f} {y:.1f}h0")  # h0: a lone point is a dot
        pen_down = True
    return "".join(parts)


def _num_values(series: Sequence[Series]) -> int:
    return max((len(one.values) for one in series), default=0)


def _largest(series: Sequence[Series]) -> float:
    known = [one.values[np.isfinite(one.values)] for one in series]
    return max((float(values.max()) for values in known if len(values)), default=0.0)


def number(value: float) -> str:
    """Return the number at a tick."""
    text = f"{value:,.0f}".replace(",", "\N{NARROW NO-BREAK SPACE}") if abs(value) >= 1e4 else f"{value:.6g}"
    return text.replace("-", "\N{MINUS SIGN}")
