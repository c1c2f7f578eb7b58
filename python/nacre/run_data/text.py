"""Numbers as people read them."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from nacre.evaluation.result import plain

_MISSING = "\N{EN DASH}"
_WORDS = {
    "rms": "RMS",
    "rmse": "RMSE",
    "std": "standard deviation",
    "tau": "within",
    "min": "minimum",
    "max": "maximum",
    "p95": "95th percentile",
    "p99": "99th percentile",
    "f": "F",
}


def quantity(value: Any, unit: str = "") -> str:
    """
    Return a value with its unit, to three digits.

    ``unit`` is "m", "rad" (shown in degrees), "fraction" (shown in percent), "count", "ms" or any other text.
    """
    value = plain(value)
    if value is None:
        return _MISSING
    if isinstance(value, (list, tuple)):
        return ", ".join(quantity(item, unit) for item in value)
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return str(value)
    if unit in ("m", "rad") and abs(value) < 1e-12:
        value = 0  # nothing but rounding
    if unit == "m":
        name, factor = length_unit(abs(value))
        return f"{_digits(value * factor)} {name}" if value else "0 mm"
    if unit == "rad":
        return f"{_digits(math.degrees(value))}\N{DEGREE SIGN}"
    if unit == "fraction":
        return f"{_percent(100 * value)} %"
    if unit == "ms" and value >= 1000:
        return f"{_digits(value / 1000)} s"
    if unit == "count":
        return count(int(value))
    return f"{_digits(value)} {unit}".rstrip() if unit != "number" else _digits(value)


def count(value: int) -> str:
    """Return a whole number with its digits in groups of three."""
    return _grouped(f"{value:,}")


def duration(seconds: float) -> str:
    """Return a time in the unit in which it reads well: seconds, minutes or hours."""
    if seconds < 90:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 90 * 60 else f"{seconds / 3600:.1f} h"


def length_unit(metres: float) -> tuple[str, float]:
    """Return the unit in which a length reads well, and how many of it are in a metre."""
    if not math.isfinite(metres) or metres >= 1:
        return "m", 1.0
    return ("mm", 1e3) if metres >= 5e-5 else ("µm", 1e6)


def ticks(low: float, high: float, count: int = 4) -> list[float]:
    """Return about ``count`` round numbers between two bounds."""
    span = high - low
    if not (math.isfinite(span) and span > 0):
        return [low]
    rough = span / count
    power = 10 ** math.floor(math.log10(rough))
    step = next(factor * power for factor in (1, 2, 2.5, 5, 10) if factor * power >= rough * 0.999)
    return [i * step for i in range(math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9) + 1)]


def number(value: float) -> str:
    """Return the number at a tick."""
    text = _grouped(f"{value:,.0f}") if abs(value) >= 1e3 and value == round(value) else f"{value:.6g}"
    return text.replace("-", "\N{MINUS SIGN}")


def ranges(indices: Sequence[int], most: int = 4) -> str:
    """Return frames in words: "frame 3", "frames 10 to 19, 30 and 2 more"."""
    runs: list[list[int]] = []
    for index in sorted(indices):
        if runs and index == runs[-1][1] + 1:
            runs[-1][1] = index
        else:
            runs.append([index, index])
    shown = sorted(sorted(runs, key=lambda run: run[0] - run[1])[:most])
    rest = len(indices) - sum(last - first + 1 for first, last in shown)
    named = [str(first) if first == last else f"{first} to {last}" for first, last in shown]
    told = ", ".join(named) + (f" and {count(rest)} more" if rest else "")
    return f"frame{'s' * (len(indices) > 1)} {told}"


def label(name: str) -> str:
    """Return a field's name as words."""
    words = " ".join(_WORDS.get(word, word) for word in name.split("_") if word != "num")
    return words[:1].upper() + words[1:]


def flatten(parameters: Any, prefix: str = "") -> list[tuple[str, str]]:
    """Return nested mappings and dataclasses as a list of dotted names and values."""
    if dataclasses.is_dataclass(parameters) and not isinstance(parameters, type):
        parameters = {field.name: getattr(parameters, field.name) for field in dataclasses.fields(parameters)}
    if isinstance(parameters, Mapping):
        named = ((f"{prefix}.{name}" if prefix else str(name), value) for name, value in parameters.items())
        return [row for name, value in named for row in flatten(value, name)]
    if isinstance(parameters, (float, np.floating)):
        return [(prefix, _MISSING if math.isnan(parameters) else f"{parameters:.7g}")]
    return [(prefix, str(parameters))]


def _grouped(digits: str) -> str:
    """Return a number whose groups of three are set apart by commas as it is shown everywhere."""
    return digits.replace(",", "\N{NARROW NO-BREAK SPACE}")


def _digits(value: float) -> str:
    if isinstance(value, int):
        return count(value).replace("-", "\N{MINUS SIGN}")
    if value == 0:
        return "0"
    magnitude = math.floor(math.log10(abs(value)))
    text = _grouped(f"{value:,.{min(max(2 - magnitude, 0), 12)}f}") if magnitude > -4 else f"{value:.2e}"
    return text.replace("-", "\N{MINUS SIGN}")


def _percent(value: float) -> str:
    """Return a percentage that says 100 only for all and 0 only for none."""
    if value in (0, 100):
        return f"{value:.0f}"
    return f"{min(max(value, 0.1), 99.9):.1f}" if 0 < value < 100 else f"{value:.1f}"
