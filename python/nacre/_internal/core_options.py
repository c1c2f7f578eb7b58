"""Dataclasses and the C++ structs that they mirror: options there, results back, changes by name."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping
from typing import Any, TypeVar, get_args, get_type_hints

import numpy as np

from nacre._internal.arrays import as_number
from nacre._internal.names_elsewhere import PARAMETERS
from nacre.errors import meant

Core = TypeVar("Core")
Parameters = TypeVar("Parameters")
Result = TypeVar("Result")


_NUMBERS = {int: "__index__", float: "__float__"}
"""Types of numbers, and what every number has that stands for one."""


class TypedFields:
    """Base of dataclasses of parameters: a value of another type than its default is refused at once."""

    def __post_init__(self) -> None:
        """Raise where a value is of another type."""
        for field in dataclasses.fields(self):  # type: ignore[arg-type]
            value, kind = getattr(self, field.name), type(field.default)
            if field.default is dataclasses.MISSING:
                kind = field.default_factory  # type: ignore[assignment]
            if kind in _NUMBERS:
                fits = hasattr(value, _NUMBERS[kind])
            else:  # what words and None stand for is known where they are used
                fits = kind in (str, type(None)) or isinstance(
                    value, (bool, np.bool_) if kind is bool else kind
                )
            if not fits:
                raise TypeError(f"{field.name} must be of type {kind.__name__}, got {value!r}")


def to_core(parameters: Any, core: Core) -> Core:
    """
    Copy every field of a dataclass into the C++ options object ``core`` and return it.

    Strings become the enumerator of that name ("wlop+" is ``wlop_plus``); a ValueError lists the names where
    there is none.
    """
    for field in dataclasses.fields(parameters):
        value = getattr(parameters, field.name)
        current = getattr(core, field.name)
        if dataclasses.is_dataclass(value):
            value = value.to_core() if hasattr(value, "to_core") else to_core(value, current)
        elif isinstance(value, str) and hasattr(type(current), "__members__"):
            members = type(current).__members__
            if value.replace("+", "_plus") not in members:
                names = ", ".join(repr(name.replace("_plus", "+")) for name in members)
                hint = meant(value, (name.replace("_plus", "+") for name in members))
                raise ValueError(f"{field.name} must be one of {names}, got {value!r}{hint}")
            value = members[value.replace("+", "_plus")]
        try:
            if isinstance(current, bool) and not isinstance(value, bool | np.bool_):
                raise TypeError
            setattr(core, field.name, value)
        except TypeError:
            expected = type(current).__name__
            raise TypeError(f"{field.name} must be of type {expected}, got {value!r}") from None
    return core


def from_core(parameters_type: type[Parameters], core: Any) -> Parameters:
    """Return the dataclass that mirrors the C++ options object ``core``."""
    defaults = parameters_type()
    hints = get_type_hints(parameters_type)
    values = {}
    for field in dataclasses.fields(parameters_type):  # type: ignore[arg-type]
        value = getattr(core, field.name)
        default = getattr(defaults, field.name)
        kinds = get_args(hints[field.name]) or (hints[field.name],)
        mirror = next((kind for kind in kinds if dataclasses.is_dataclass(kind)), None)
        if value is not None and isinstance(mirror, type):
            value = from_core(mirror, value)
        elif isinstance(default, str):
            value = value.name.replace("_plus", "+")
        values[field.name] = value
    return parameters_type(**values)


def mirrored(kind: type[Result], core: Any, **other: Any) -> Result:
    """Return a result with the fields of the C++ object that it mirrors, but for those that are given."""
    names = (field.name for field in dataclasses.fields(kind))  # type: ignore[arg-type]
    return kind(**{name: getattr(core, name) for name in names if name not in other}, **other)


def updated(parameters: Parameters, changes: Mapping[str, Any]) -> Parameters:
    """
    Return parameters with changes by dotted name, such as ``{"registration.max_angle": 0.5}``.

    Nested mappings do too.

    A name that does not exist raises a ValueError that lists those that do.
    """
    if not dataclasses.is_dataclass(parameters):
        raise TypeError(
            f"{', '.join(changes)} cannot be changed: {parameters!r} is not a group of parameters"
        )
    for name, value in changes.items():
        head, dot, rest = name.partition(".")
        names = [field.name for field in dataclasses.fields(parameters)]  # type: ignore[arg-type]
        if head not in names or (dot and not rest):
            raise ValueError(
                f"there is no parameter {name!r} in {type(parameters).__name__}{_meant(head, parameters)}; "
                f"it has {', '.join(names)}"
            )
        current = getattr(parameters, head)
        if rest:
            value = updated(current, {rest: value})
        elif isinstance(value, Mapping) and dataclasses.is_dataclass(current):
            value = updated(current, value)
        elif isinstance(current, float) and isinstance(value, int) and not isinstance(value, bool):
            value = as_number(name, value)
        parameters = dataclasses.replace(parameters, **{head: value})  # type: ignore[type-var]
    return parameters


def leaves(tree: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Yield the dotted names and the values of nested parameters."""
    for key, value in tree.items():
        if isinstance(value, Mapping) and prefix + key != "depth.noise":
            yield from leaves(value, f"{prefix}{key}.")
        else:
            yield prefix + key, value


def _meant(word: str, parameters: Any) -> str:
    """Return a hint: the parameter that a library calls so, the one of a group, or the nearest name."""
    names = [field.name for field in dataclasses.fields(parameters)]
    found = PARAMETERS.get(word, word)
    group, _, last = found.rpartition(".")
    groups = [
        name for name in names if word in getattr(getattr(parameters, name), "__dataclass_fields__", ())
    ]
    if not group and found not in names and groups:
        group, last = groups[0], word
    if group in names:
        return f" (it is {group}.{last}: {group}={{{last!r}: ...}})"
    return f" (it is {found})" if found in names else meant(word, names)


def as_choice(name: str, value: Any, choices: Mapping[str, Core]) -> Core:
    """Return what ``value`` stands for among the named choices."""
    if not isinstance(value, str) or value not in choices:
        raise ValueError(
            f"{name} must be one of {', '.join(map(repr, choices))}, got {value!r}{meant(value, choices)}"
        )
    return choices[value]
