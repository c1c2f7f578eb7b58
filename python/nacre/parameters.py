"""Parameters as frozen dataclasses. Each mirrors the C++ struct of the same meaning; a test compares the defaults."""

from __future__ import annotations

import dataclasses
import numbers
import operator
from collections.abc import Mapping
from typing import Any, TypeVar

Core = TypeVar("Core")


def to_core(parameters: Any, core: Core) -> Core:
    """Copy every field of a dataclass into the C++ options object ``core`` and return it."""
    for field in dataclasses.fields(parameters):
        value = getattr(parameters, field.name)
        if dataclasses.is_dataclass(value):
            to_core(value, getattr(core, field.name))
        else:
            setattr(core, field.name, value)
    return core


def as_int(name: str, value: Any, low: int = 0, high: int | None = None) -> int:
    """Return ``value`` as an int from ``low`` to ``high``; floats are refused."""
    try:
        number = operator.index(value)
    except TypeError:
        raise TypeError(f"{name} must be an integer, got {value!r}") from None
    if number < low or (high is not None and number > high):
        expected = f"at least {low}" if high is None or number < low else f"at most {high}"
        raise ValueError(f"{name} must be {expected}, got {value!r}")
    return number


def as_number(name: str, value: Any) -> float:
    """Return a real number as a float."""
    if not isinstance(value, numbers.Real):
        raise TypeError(f"{name} must be a number, got {value!r}")
    return float(value)


def as_choice(name: str, value: Any, choices: Mapping[str, Core]) -> Core:
    """Return what ``value`` stands for among the named choices."""
    if not isinstance(value, str) or value not in choices:
        raise ValueError(f"{name} must be one of {', '.join(map(repr, choices))}, got {value!r}")
    return choices[value]
