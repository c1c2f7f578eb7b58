"""Line, bar and map charts as inline SVG; the style sheet colours them, for light and for dark."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from nacre.report.templating import render
from nacre.run_data.text import number, ticks

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]

#: More values than this are drawn in groups of equal size.
MAX_VALUES = 400

_LEFT, _RIGHT, _TOP, _BOTTOM = 56, 12, 12, 36
_MOST_DOTS = 60
_MOST_TOLD = 300  # frames whose values are told where the pointer is
_STRIP = (1000, 16)


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
    chart = _FrameChart(
        series, y_label, indices, y_max or _greatest(one.values for one in series), width, height
    )
    for mark in marks:
        left, right = chart.x(mark.first - 0.5), chart.x(mark.last + 0.5)
        chart.paths.append(
            (mark.kind, f"M{left:.1f} {_TOP}h{max(right - left, 1.5):.1f}v{chart.inner[1]}H{left:.1f}")
        )
    for one in series:
        low, mean, high = grouped(one.values)
        x = chart.x((np.arange(len(mean)) + 0.5) * group_size(len(one.values)) - 0.5)
        line, upper, lower = (np.stack([x, chart.y(values)], 1) for values in (mean, high, low))
        if len(mean) < len(one.values):
            bands = (np.concatenate([upper[a:b], lower[a:b][::-1]]) for a, b in runs(np.isfinite(low)))
            chart.paths.append((f"band f{one.color}", "".join(map(_path, bands))))
        chart.paths.append((f"line s{one.color}", _path(line)))
        if len(mean) <= _MOST_DOTS:
            chart.paths.append((f"dots s{one.color}", _dots(line)))
    if level is not None and 0 < level <= chart.top:
        chart.paths.append(("level", f"M{_LEFT} {chart.y(level):.1f}h{chart.inner[0]}"))
    return chart.svg(x_label, y_label)


def stacked_chart(
    series: Sequence[Series],
    *,
    y_label: str,
    x_label: str = "frame",
    indices: Sequence[int] | None = None,
    width: int = 560,
    height: int = 200,
) -> str:
    """Draw layers on top of each other, one bar per frame (or per group of frames, with their mean)."""
    layers = [np.nan_to_num(grouped(one.values)[1]) for one in series]
    tops = np.cumsum([np.zeros_like(layers[0]), *layers], axis=0) if layers else np.zeros((1, 0))
    chart = _FrameChart(series, y_label, indices, float(tops[-1].max(initial=0)), width, height)
    step = chart.inner[0] / max(tops.shape[1], 1)
    gap = min(0.22 * step, 3.0) if step > 3 else 0.0
    left = _LEFT + step * np.arange(tops.shape[1]) + gap / 2
    for one, below, above in zip(series, chart.y(tops[:-1]), chart.y(tops[1:]), strict=True):
        bars = (
            f"M{x:.1f} {bottom:.1f}V{top:.1f}h{step - gap:.1f}V{bottom:.1f}"
            for x, bottom, top in zip(left, below, above, strict=True)
            if bottom - top > 0.04
        )
        chart.paths.append((f"f{one.color}", "".join(bars)))
    return chart.svg(x_label, y_label)


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
    The first known point of the last track is marked. NaN leaves a gap.
    """
    chart = _Chart(width, height, f"{y_label} over {x_label}")
    known = np.concatenate([np.zeros((0, 2)), *(xy[np.isfinite(xy).all(axis=1)] for _, xy, _ in tracks)])
    low, high = (known.min(axis=0), known.max(axis=0)) if len(known) else np.zeros((2, 2))
    inner = np.array(chart.inner, dtype=np.float64)
    metres_per_pixel = max(float(((high - low) / (0.9 * inner)).max()), 1e-9)
    pixels_per_metre = np.array([1.0, -1.0 if y_up else 1.0]) / metres_per_pixel
    middle = (low + high) / 2

    def place(xy: Array) -> Array:
        return np.asarray(inner / 2 + (_LEFT, _TOP) + (xy - middle) * pixels_per_metre)

    chart.paths.append(("plot", f"M{_LEFT} {_TOP}h{inner[0]:g}v{inner[1]:g}H{_LEFT}z"))
    from_corner, to_corner = (factor * (middle + side * metres_per_pixel * inner / 2) for side in (-1, 1))
    for axis, count, add in ((0, 7, chart.x_tick), (1, 4, chart.y_tick)):
        for tick in ticks(float(from_corner[axis]), float(to_corner[axis]), count):
            add(float(place(np.full(2, tick / factor))[axis]), number(tick), "grid", chart.inner[1])
    for name, xy, color in tracks:
        thinned = place(xy[:: max(len(xy) // 1500, 1)])
        chart.paths.append((f"line s{color}{' wide' * (name == 'truth')}", _path(thinned)))
        if len(xy) <= _MOST_DOTS and name != "truth":
            chart.paths.append((f"dots s{color}", _dots(thinned)))
    if len(known):
        last = tracks[-1][1]
        for x, y in place(last[np.isfinite(last).all(axis=1)][:1]):
            chart.paths.append(("start", f"M{x - 5:.1f} {y:.1f}a5 5 0 1 1 10 0a5 5 0 1 1-10 0"))
    return chart.svg(f"{x_label} [{unit}]", f"{y_label} [{unit}]")


def status_strip(states: Sequence[str]) -> list[tuple[str, str]]:
    """Return the states of all frames as paths in a strip of 1000 x 16; what is rare stays visible."""
    width, height = _STRIP
    size = group_size(len(states))
    step = width / max(-(-len(states) // size), 1)
    paths = [("st-tracked", f"M0 0h{width}v{height}H0")]
    for kind in ("RELOCALISED", "WEAK", "LOST"):
        found = grouped(np.array([state == kind for state in states], dtype=np.float64))[2] > 0
        bars = (
            f"M{a * step:.1f} 0h{max((b - a) * step, 2):.1f}v{height}H{a * step:.1f}" for a, b in runs(found)
        )
        paths.append((f"st-{kind.lower()}", "".join(bars)))
    return [(kind, path) for kind, path in paths if path]


def grouped(values: Array) -> tuple[Array, Array, Array]:
    """Return the least, mean and greatest value of each group of neighbours; NaN where a group has none."""
    size = group_size(len(values))
    table = np.full((-(-len(values) // size), size), np.nan)
    table.flat[: len(values)] = values
    known = np.isfinite(table)
    count = known.sum(axis=1)
    mean = np.where(known, table, 0).sum(axis=1) / np.maximum(count, 1)
    low = np.where(known, table, np.inf).min(axis=1, initial=np.inf)
    high = np.where(known, table, -np.inf).max(axis=1, initial=-np.inf)
    low, mean, high = (np.where(count > 0, values, np.nan) for values in (low, mean, high))
    return low, mean, high


def group_size(num_values: int) -> int:
    """Return how many neighbouring frames a chart draws as one."""
    return max(-(-num_values // MAX_VALUES), 1)


def runs(mask: Mask) -> list[tuple[int, int]]:
    """Return where each run of true values begins and ends (exclusive)."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8)))
    return [(int(first), int(end)) for first, end in edges.reshape(-1, 2)]


class _Chart:
    """What templates/chart.svg draws, in pixels."""

    def __init__(self, width: int, height: int, description: str) -> None:
        self.width, self.height, self.description = width, height, description
        self.inner = (width - _LEFT - _RIGHT, height - _TOP - _BOTTOM)
        self.middle = (_LEFT + self.inner[0] / 2, _TOP + self.inner[1] / 2)
        self.paths: list[tuple[str, str]] = []  # class of the style sheet, shape
        self.texts: list[tuple[str, float, float, str]] = []  # class, x, y, words
        self.told: list[tuple[str, str]] = []  # shape, words where the pointer is on it

    def x_tick(self, x: float, text: str, kind: str, length: int) -> None:
        bottom = _TOP + self.inner[1]
        self.paths.append((kind, f"M{x:.1f} {bottom}v{-length if kind == 'grid' else length}"))
        self.texts.append(("tick mid", round(x, 1), bottom + 16, text))

    def y_tick(self, y: float, text: str, kind: str, _: int = 0) -> None:
        self.paths.append((kind, f"M{_LEFT} {y:.1f}h{self.inner[0]}"))
        self.texts.append(("tick end", _LEFT - 6, round(y + 4, 1), text))

    def svg(self, x_label: str, y_label: str) -> str:
        return render("chart.svg", chart=self, x_label=x_label, y_label=y_label)


class _FrameChart(_Chart):
    """A chart with frames to the right and values from 0 upwards."""

    def __init__(
        self,
        series: Sequence[Series],
        y_label: str,
        indices: Sequence[int] | None,
        top: float,
        width: int,
        height: int,
    ) -> None:
        super().__init__(width, height, _in_words(series, y_label))
        self.num_frames = max((len(one.values) for one in series), default=0)
        self.top = top * 1.06 if math.isfinite(top) and top > 0 else 1.0
        indices = range(self.num_frames) if indices is None else indices
        for tick in ticks(0, self.top, 4):
            self.y_tick(float(self.y(tick)), number(tick), "grid" if tick else "axis")
        for tick in ticks(0, max(self.num_frames - 1, 0), 8):
            if tick == int(tick) and tick < len(indices):
                self.x_tick(float(self.x(tick)), str(indices[int(tick)]), "axis", 4)
        if self.num_frames <= _MOST_TOLD:
            self._tell(series, indices, y_label)

    def x(self, position: npt.ArrayLike) -> Array:
        return _LEFT + (np.asarray(position, np.float64) + 0.5) * self.inner[0] / max(self.num_frames, 1)

    def y(self, value: npt.ArrayLike) -> Array:
        return _TOP + self.inner[1] * (1 - np.asarray(value, np.float64) / self.top)

    def _tell(self, series: Sequence[Series], indices: Sequence[int], y_label: str) -> None:
        """Give every frame an invisible bar that says its values."""
        width = self.inner[0] / max(self.num_frames, 1)
        for i in range(self.num_frames):
            known = [one for one in series if math.isfinite(one.values[i])]
            words = [f"frame {indices[i]}", *(f"{one.name or y_label} {one.values[i]:.4g}" for one in known)]
            left = float(self.x(i - 0.5))
            self.told.append((f"M{left:.1f} {_TOP}h{width:.1f}v{self.inner[1]}H{left:.1f}", ", ".join(words)))


def _in_words(series: Sequence[Series], y_label: str) -> str:
    """Return a chart in words, for those who do not see it."""
    words = []
    for one in series:
        known = one.values[np.isfinite(one.values)]
        if len(known):
            low, middle, high = (f"{value:.4g}" for value in (known.min(), np.median(known), known.max()))
            words.append(f"{one.name or y_label}: least {low}, median {middle}, greatest {high}")
    return f"{y_label} of every frame; " + "; ".join(words)


def _greatest(values: Iterable[Array]) -> float:
    return max((float(np.nanmax(one)) for one in values if np.isfinite(one).any()), default=0.0)


def _path(xy: Array) -> str:
    """Return the path through points, with a gap at each that is not finite."""
    parts = []
    for first, end in runs(np.asarray(np.isfinite(xy).all(axis=1))):
        parts.append("M" + "L".join(f"{x:.1f} {y:.1f}" for x, y in xy[first:end]))
        parts.append("h0" * (end - first == 1))  # a lone point is a dot
    return "".join(parts)


def _dots(xy: Array) -> str:
    return "".join(f"M{x:.1f} {y:.1f}h0" for x, y in xy[np.isfinite(xy).all(axis=1)])
