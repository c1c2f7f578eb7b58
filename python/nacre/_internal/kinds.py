"""Validation of objects that are no arrays: what comes in is of the kind that is asked for."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, TypeVar

Kind = TypeVar("Kind")


def as_kind(name: str, value: Kind, kind: type[Any], called: str) -> Kind:
    """Return ``value``, which must be of a kind, called so; of what has one as ``name`` say so."""
    if isinstance(value, kind):
        return value
    way = f"; give its .{name}" * isinstance(getattr(value, name, None), kind)
    raise TypeError(f"{name} must be {called}, got {type(value).__name__}{way}")


def as_items(name: str, value: Any) -> Iterable[Any]:
    """Return ``value``, which must have items."""
    if isinstance(value, str | bytes) or not hasattr(value, "__iter__"):
        raise TypeError(f"{name} must be a sequence of items, got {value!r}")
    return value  # type: ignore[no-any-return]
