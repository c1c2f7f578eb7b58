"""The bar of colours above pictures whose colour is a quantity."""

from __future__ import annotations

import math
from dataclasses import dataclass

from nacre.run_data.text import length_unit, number, ticks


@dataclass(frozen=True)
class ColorBar:
    """A bar of colours with round numbers beneath."""

    title: str
    ticks: list[tuple[float, str]]  #: where along the bar, from 0 to 1, and the number


def color_bar(
    title: str,
    bounds: tuple[float, float],
    unit: str = "",
    *,
    logarithmic: bool = False,
    inverse: bool = False,
) -> ColorBar:
    """
    Return the bar of colours between two bounds; ``unit`` "m" is shown as mm or m.

    The position of a value in the bar is linear, logarithmic, or linear in its inverse.
    """
    factor = 1.0
    if unit == "m":
        unit, factor = length_unit(bounds[1])
    low, high = (bound * factor for bound in bounds)

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
        round_numbers = [m * 10.0**d for d in decades for m in ((1,) if len(decades) > 3 else (1, 3))]
    elif inverse:
        round_numbers = [m * 10.0**d for d in range(-3, 6) for m in (1, 1.5, 2, 3, 5, 7)]
    else:
        round_numbers = ticks(low, high, 4)
    shown = [(place(end), number(float(f"{end:.3g}"))) for end in (low, high)] if high > low else []
    for value in round_numbers:
        if low <= value <= high and all(abs(place(value) - other) > 0.15 for other, _ in shown):
            shown.append((place(value), number(value)))
    title += f" [{unit}]" * bool(unit) + " (logarithmic)" * logarithmic
    return ColorBar(title, sorted(shown))
