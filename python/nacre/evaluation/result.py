"""What all evaluation results have in common: units of their fields, and a form that JSON can hold."""

from __future__ import annotations

import dataclasses
import math
from typing import Annotated, Any, TypeAlias, get_type_hints

import numpy as np
import numpy.typing as npt

from nacre.values import Value, told

Array: TypeAlias = npt.NDArray[np.float64]

Metres = Annotated[float, "m"]
Radians = Annotated[float, "rad"]
Fraction = Annotated[float, "fraction"]
Count = Annotated[int, "count"]
ManyMetres = Annotated[tuple[float, ...], "m"]
ManyFractions = Annotated[tuple[float, ...], "fraction"]


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


_UNITS = {"m": " m", "rad": " rad"}


class Result(Value):
    """Base of the evaluation results, which are frozen dataclasses."""

    def __repr__(self) -> str:
        units = self.units()
        shown = (f.name for f in dataclasses.fields(self) if f.repr)  # type: ignore[arg-type]
        words = (f"{name}={told(getattr(self, name))}" + _UNITS.get(units[name], "") for name in shown)
        return f"{type(self).__name__}({', '.join(words)})"

    def as_dict(self) -> dict[str, Any]:
        """Return every field under its name, as plain Python values that JSON can hold (NaN becomes None)."""
        return {name: plain(getattr(self, name)) for name in self.units()}

    @classmethod
    def units(cls) -> dict[str, str]:
        """Return the unit of every field: "m", "rad", "fraction", "count", or "" for none."""
        hints = get_type_hints(cls, include_extras=True)
        fields = dataclasses.fields(cls)  # type: ignore[arg-type]
        return {field.name: getattr(hints[field.name], "__metadata__", ("",))[0] for field in fields}
