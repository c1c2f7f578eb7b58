"""Parameters as frozen dataclasses. Each mirrors the C++ struct of the same meaning; a test compares the defaults."""

from __future__ import annotations

import dataclasses
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
