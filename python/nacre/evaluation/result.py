"""What all evaluation results have in common: units of their fields, and a form that JSON can hold."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np


def measure(unit: str) -> Any:
    """Declare a dataclass field that carries the unit of its value: "m", "rad", "fraction" or "count"."""
    return dataclasses.field(metadata={"unit": unit})


def per_item(unit: str) -> Any:
    """Declare a dataclass field with one value per frame or point; it is left out of the repr."""
    return dataclasses.field(metadata={"unit": unit}, repr=False)


def plain(value: Any) -> Any:
    """Turn arrays, numpy scalars and tuples into what JSON knows; numbers that are not finite become None."""
    if isinstance(value, np.ndarray):
        return plain(value.tolist())
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    if isinstance(value, np.generic):
        return plain(value.item())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


class Result:
    """Base of the evaluation results, which are frozen dataclasses."""

    def as_dict(self) -> dict[str, Any]:
        """Return every field under its name, as plain Python values that JSON can hold (NaN becomes None)."""
        return {
            field.name: plain(getattr(self, field.name))
            for field in dataclasses.fields(self)  # type: ignore[arg-type]
        }
