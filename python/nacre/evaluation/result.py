"""What all evaluation results have in common: units of their fields, and a form that JSON can hold."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from typing import Annotated, Any, TypeAlias, get_type_hints

import numpy as np
import numpy.typing as npt

from nacre._internal.value_equality import Value, short_repr

Array: TypeAlias = npt.NDArray[np.float64]

Metres = Annotated[float, "m"]
Radians = Annotated[float, "rad"]
Fraction = Annotated[float, "fraction"]
Count = Annotated[int, "count"]
ManyMetres = Annotated[tuple[float, ...], "m"]
ManyFractions = Annotated[tuple[float, ...], "fraction"]


def plain(value: Any) -> Any:
    """Return mappings, arrays and numbers, nested or not, as what JSON knows: what is not finite is None."""
    if isinstance(value, Mapping):
        return {str(name): plain(item) for name, item in value.items()}
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

# Fields that hold one value per frame or point.
_LONG = {"errors", "translation_errors", "rotation_errors", "distances"}


class Result(Value):
    """Base of the evaluation results, which are frozen dataclasses."""

    def __repr__(self) -> str:
        units = self.units()
        shown = (f.name for f in dataclasses.fields(self) if f.repr)  # type: ignore[arg-type]
        words = (f"{name}={short_repr(getattr(self, name))}" + _UNITS.get(units[name], "") for name in shown)
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


def result_dict(result: Result) -> dict[str, Any]:
    """Return the figures of an evaluation result, without those for each frame or point."""
    return {name: value for name, value in result.as_dict().items() if name not in _LONG}
