"""Every public function with every kind of argument: an answer that holds, or an error that helps."""

from __future__ import annotations

import importlib.util
import re
import signal
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest


def _neighbor(name: str) -> ModuleType:
    """Import a module that lies beside this one."""
    spec = importlib.util.spec_from_file_location(name, Path(__file__).with_name(f"{name}.py"))
    assert spec
    assert spec.loader
    module = sys.modules[name] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


names, recipes, hostile = map(_neighbor, ("public_names", "recipes", "hostile"))


SECONDS = 2.0  # of CPU time, for a call on a few points


class Hang(BaseException):
    """A call that took too long."""


@contextmanager
def at_most(seconds: float) -> Iterator[None]:
    """Raise where a block takes more of the processor's time, as Ctrl-C would."""

    def stop(*_: Any) -> None:
        raise Hang

    before = signal.signal(signal.SIGVTALRM, stop)
    signal.setitimer(signal.ITIMER_VIRTUAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0)
        signal.signal(signal.SIGVTALRM, before)


def helps(error: Exception, names: str) -> bool:
    """Say whether an error names the argument, what was expected and what came."""
    message = str(error)
    return bool(
        re.search(rf"\b({names})\b", message)
        and re.search(r"\b(must|expected|needs|cannot)\b", message)
        and re.search(r"\b(got|needs|cannot)\b", message)
        and "incompatible" not in message
    )


def same_bytes(a: Any, b: Any) -> bool:
    """Say whether an array is as it was."""
    return not isinstance(a, np.ndarray) or a.dtype == object or a.tobytes() == b.tobytes()


def complaint(recipe: Any, name: str, value: Any, refused: bool) -> str | None:
    """Return what is wrong with what a call makes of one changed argument."""
    arguments = {**recipe.arguments, name: value}
    copies = {key: v.copy() if isinstance(v, np.ndarray) else v for key, v in arguments.items()}
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            with at_most(SECONDS):
                result = recipe.call(**arguments)
        except (TypeError, ValueError) as error:
            # Of two that do not fit each other, either.
            named = name if refused else "|".join(arguments)
            return None if helps(error, named) else f"{type(error).__name__}: {error}"[:300]
        except Hang:
            return None if name in recipe.grows else "hangs"
        except MemoryError as error:
            return None if name in recipe.grows else f"MemoryError: {error}"
        except Exception as error:
            return f"{type(error).__name__}: {error}"[:300]
    if refused:
        return f"takes it: {result!r}"[:200]
    try:
        recipe.holds(result, **arguments)
    except AssertionError as error:
        return f"does not hold: {error}"[:200]
    changed = [key for key in arguments if not same_bytes(arguments[key], copies[key])]
    return f"wrote to {changed}" if changed else None


@pytest.mark.parametrize("function", recipes.RECIPES)
def test_any_argument(function: str) -> None:
    recipe = recipes.RECIPES[function]
    recipe.holds(recipe.call(**recipe.arguments), **recipe.arguments)
    complaints = [
        f"{name} = {condition}: {wrong}"
        for name, valid in recipe.arguments.items()
        for condition, value, refused in hostile.values_for(valid)
        if (wrong := complaint(recipe, name, value, refused))
    ]
    assert not complaints, "\n".join(complaints)
