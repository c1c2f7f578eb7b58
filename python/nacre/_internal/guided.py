"""Calls and names that do not fit are answered by what does."""

from __future__ import annotations

import functools
import inspect
import os
from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING, Any, ParamSpec, TypeVar

from nacre.errors import meant

Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")


def guided(
    hint: str = "", **elsewhere: str
) -> Callable[[Callable[Arguments, Result]], Callable[Arguments, Result]]:
    """
    Decorate a function so that a call with missing, unknown or too many arguments says how to call it.

    So does a call that fails with something else in place of its path.

    Parameters
    ----------
    hint : str
        What to do where arguments are missing.
    **elsewhere
        Arguments that functions of other libraries have: which one it is here, or a sentence on what to do.
    """

    def decorate(function: Callable[Arguments, Result]) -> Callable[Arguments, Result]:
        signature = inspect.signature(function)

        @functools.wraps(function)
        def call(*given: Arguments.args, **named: Arguments.kwargs) -> Result:
            if elsewhere.keys().isdisjoint(named):
                try:
                    return function(*given, **named)
                except TypeError as error:
                    if _fits(signature, given, named):
                        if not str(error).startswith("path must"):
                            _require_path(function, signature.bind(*given, **named))
                        raise
            raise TypeError(_how_to_call(function, signature, given, named, hint, elsewhere))

        return call

    return decorate


_PATH = "str | os.PathLike[str]"
_NO_PARAMETER = inspect.Parameter("none", inspect.Parameter.POSITIONAL_ONLY)
_VOWELS = ("A", "E", "I", "O", "FS")
_PLACED = (inspect.Parameter.POSITIONAL_ONLY, inspect.Parameter.POSITIONAL_OR_KEYWORD)


def _fits(signature: inspect.Signature, given: tuple[Any, ...], named: Mapping[str, Any]) -> bool:
    try:
        signature.bind(*given, **named)
    except TypeError:
        return False
    return True


def _require_path(function: Callable[..., Any], bound: inspect.BoundArguments) -> None:
    """Raise where the path of a call is none, as where it changed places with what is to be written."""
    path = bound.arguments.get("path", "")
    takes_path_alone = bound.signature.parameters.get("path", _NO_PARAMETER).annotation == _PATH
    if takes_path_alone and not isinstance(path, str | os.PathLike):
        own = [
            p.name for p in bound.signature.parameters.values() if p.default is p.empty and p.kind in _PLACED
        ]
        call = f"{_name_of(function)}({', '.join(name for name in own if name not in ('self', 'cls'))})"
        raise TypeError(f"path must be a path, as in {call}, got {type(path).__name__}") from None


def _name_of(function: Callable[..., Any]) -> str:
    return function.__qualname__.removesuffix(".__init__").rpartition(".")[2]


def _how_to_call(
    function: Callable[..., Any],
    signature: inspect.Signature,
    given: tuple[Any, ...],
    named: Mapping[str, Any],
    hint: str,
    elsewhere: Mapping[str, str],
) -> str:
    name = _name_of(function)
    parameters = [p for p in signature.parameters.values() if p.name not in ("self", "cls")]
    own_object = len(signature.parameters) - len(parameters)
    takes_any = any(p.kind is p.VAR_KEYWORD for p in parameters)
    parameters = [p for p in parameters if p.kind not in (p.VAR_POSITIONAL, p.VAR_KEYWORD)]
    own = {p.name for p in parameters}
    unknown = [word for word in named if word in elsewhere or not (takes_any or word in own)]
    if unknown:
        word = unknown[0]
        advice = elsewhere.get(word)
        if advice is None:
            return f"{name} has no argument {word!r}{meant(word, own)}; it has {', '.join(sorted(own))}"
        return f"{name} has no argument {word!r}: {f'it is {advice}' if advice in own else advice}"
    by_place = [p.name for p in parameters if p.kind is p.POSITIONAL_OR_KEYWORD]
    if len(given) - own_object > len(by_place):
        others = ", ".join(p.name for p in parameters if p.kind is p.KEYWORD_ONLY)
        if not by_place:
            return f"{name} takes nothing by place" + f"; by name: {others}" * bool(others)
        return f"{name} takes {listing(by_place)} by place and the rest by name: {others}"
    taken = set(by_place[: len(given) - own_object])
    missing = [p.name for p in parameters if p.default is p.empty and p.name not in taken | set(named)]
    if missing:
        return f"{name} needs {listing(missing)}{' too' * bool(taken or named)}{': ' * bool(hint)}{hint}"
    return f"{name} got {listing(sorted(taken & set(named)))} twice, by place and by name"


def listing(words: Iterable[str]) -> str:
    """Return words as a sentence lists them: a, b and c."""
    *most, last = words
    return f"{', '.join(most)} and {last}" if most else last


def no_such_name(owner: str, name: str, known: Iterable[str], elsewhere: Mapping[str, str]) -> AttributeError:
    """Return the error for a name that is not there: what to use in its place, or the nearest one."""
    if name in elsewhere:
        return AttributeError(f"{owner} has no attribute {name!r}: {elsewhere[name]}")
    return AttributeError(f"{owner} has no attribute {name!r}{meant(name, known)}")


def no_such_member(kind: type, name: str, owner: Any) -> AttributeError:
    """Return the error for a name that a class, or an object of it, does not have."""
    if name.startswith("_"):
        return AttributeError(f"{kind.__name__!r} object has no attribute {name!r}")
    from nacre._internal.names_elsewhere import OF_CLASS

    article = "an" if kind.__name__.startswith(_VOWELS) else "a"
    known = (word for word in dir(owner) if not word.startswith("_"))
    return no_such_name(f"{article} {kind.__name__}", name, known, OF_CLASS.get(kind.__name__, {}))


def no_array(value: Any) -> TypeError:
    """Return the error for an object that NumPy is to make an array of, and which is none."""
    from nacre._internal.names_elsewhere import ARRAYS_OF

    kind = type(value).__name__
    article = "an" if kind.startswith(_VOWELS) else "a"
    parts = ARRAYS_OF.get(kind)
    return TypeError(f"{article} {kind} is no array{f': give its {parts}' if parts else ''}")


class GuidedNames:
    """Base of classes whose missing attributes, and arrays, are answered by what takes their place."""

    __slots__ = ()

    if not TYPE_CHECKING:  # a type checker would take every name for one that is there

        def __getattr__(self, name: str) -> Any:
            kind = type(self)
            if name in dir(kind):  # a property that raised
                return object.__getattribute__(self, name)
            raise no_such_member(kind, name, self)

        def __array__(self, dtype: Any = None, copy: bool | None = None) -> Any:
            raise no_array(self)
