"""Calls and names that do not fit are answered by what does, and the answers are true."""

from __future__ import annotations

import copy
import importlib
import inspect
import pickle
import re

import numpy as np
import pytest

import nacre
import nacre.reconstruction
from nacre._internal import names_elsewhere
from nacre._internal.guided import guided, listing

ADVICE = {
    **{f"nacre.{name}": advice for name, advice in names_elsewhere.OF_PACKAGE.items()},
    **{
        f"{kind}.{name}": advice
        for kind, names in names_elsewhere.OF_CLASS.items()
        for name, advice in names.items()
    },
}


@guided("ask somebody", threshold="distance", p="leave it out")
def measure(source: object, target: object, *, distance: float = 0.0, **more: object) -> str:
    """Tell what came."""
    if not isinstance(source, str):
        raise TypeError("source must be a word")
    return f"{source} {target} {distance} {more}"


@guided()
def plain(source: object, *, distance: float = 0.0) -> None:
    """Take two arguments."""


@guided()
def by_name(*, distance: float = 0.0) -> None:
    """Take one argument, by name."""


def test_a_call_that_fits_is_not_changed() -> None:
    assert measure("a", "b", distance=2.0, extra=1) == "a b 2.0 {'extra': 1}"
    assert list(inspect.signature(measure).parameters) == ["source", "target", "distance", "more"]
    assert measure.__doc__ == "Tell what came."


def test_the_errors_of_the_function_itself_come_out() -> None:
    with pytest.raises(TypeError, match="source must be a word"):
        measure(1, 2)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: measure("a"), "measure needs target too: ask somebody"),
        (lambda: measure(), "measure needs source and target: ask somebody"),
        (lambda: plain(1, 2), "plain takes source by place and the rest by name: distance"),
        (lambda: by_name(1), "by_name takes nothing by place; by name: distance"),
        (lambda: plain(1, source=2), "plain got source twice, by place and by name"),
        (lambda: plain(1, distanse=2), r"plain has no argument 'distanse' \(did you mean 'distance'\?\)"),
    ],
)
def test_a_call_that_does_not_fit_is_told_how(call: object, words: str) -> None:
    with pytest.raises(TypeError, match=words) as told:
        call()  # type: ignore[operator]
    assert told.value.__cause__ is None


def test_words_are_listed_as_in_a_sentence() -> None:
    assert listing(["a"]) == "a"
    assert listing(["a", "b", "c"]) == "a, b and c"


def test_what_has_no_such_name_can_still_be_copied_and_asked() -> None:
    cloud = nacre.Cloud(np.zeros((2, 3)))
    assert pickle.loads(pickle.dumps(cloud)) == copy.deepcopy(cloud) == cloud
    assert not hasattr(cloud, "xyz")
    assert not hasattr(cloud, "_secret")
    with pytest.raises(
        AttributeError, match=r"a Cloud has no attribute 'normal' \(did you mean 'normals'\?\)"
    ):
        _ = cloud.normal  # type: ignore[attr-defined]


def test_a_property_that_raises_says_why_itself() -> None:
    with pytest.raises(AttributeError, match="matrix belongs to a pinhole camera"):
        _ = nacre.Camera.orthographic(4, 3, 0.01).matrix
    with pytest.raises(AttributeError, match="pixel_size belongs to an orthographic camera"):
        _ = nacre.Camera(4, 3, 5, 5, 2, 2).pixel_size  # type: ignore[attr-defined]


@pytest.mark.parametrize("name", ADVICE)
def test_advice_names_what_there_is(name: str) -> None:
    for path in re.findall(r"\bnacre(?:\.\w+)+", ADVICE[name]):
        value: object = nacre
        for part in path.split(".")[1:]:
            value = getattr(value, part)


@pytest.mark.parametrize("kind", names_elsewhere.OF_CLASS)
def test_advice_of_a_class_is_for_names_that_it_does_not_have(kind: str) -> None:
    found = getattr(nacre, kind, None) or getattr(nacre.reconstruction, kind)
    fields = getattr(found, "__dataclass_fields__", {})
    for name, advice in names_elsewhere.OF_CLASS[kind].items():
        assert not hasattr(found, name)
        assert name not in fields
        for own in re.findall(r"^it is (\w+)(?:$|[,(\[])", advice):
            assert hasattr(found, own) or own in fields or own in ("len", "cloud", "model"), advice


def test_advice_of_parameters_leads_to_parameters() -> None:
    for advice in names_elsewhere.PARAMETERS.values():
        value: object = nacre.ModelParameters()
        for part in advice.split("."):
            value = getattr(value, part)


def test_modules_answer_too() -> None:
    module = importlib.import_module("nacre.io")
    with pytest.raises(AttributeError, match=r"nacre\.io has no .*: it is nacre\.read_points"):
        module.read_points  # noqa: B018
    with pytest.raises(AttributeError, match="has no attribute '_x'"):
        module._x  # noqa: B018
