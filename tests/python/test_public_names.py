"""All that the package shows: documented, told in words, compared, copied and pickled."""

from __future__ import annotations

import copy
import inspect
import pickle
import re
from typing import Any

import numpy as np
import public_names as names
import pytest

import nacre

BY_IDENTITY = {"Mesh", "KdTree", "Sequence"}  # large, and equal to themselves alone
LIVING = {"Model", "Reconstruction"}
ABSTRACT = {"Result"}


@pytest.fixture(scope="module")
def objects(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    return names.objects(tmp_path_factory.mktemp("recording"))


def same(a: Any, b: Any) -> bool:
    """Say whether two objects hold the same."""
    if isinstance(a, tuple) and not isinstance(b, type(a)):
        return False
    if isinstance(a, tuple):  # of arrays
        return all(np.array_equal(x, y) for x, y in zip(a, b, strict=True))
    if isinstance(a, BaseException) or type(a).__name__ in BY_IDENTITY:
        return type(a) is type(b) and repr(a) == repr(b) and str(a) == str(b)
    return bool(a == b)


def test_every_class_has_an_object_here(objects: dict[str, Any]) -> None:
    assert set(names.classes()) - ABSTRACT - set(objects) == set()


@pytest.mark.parametrize("name", sorted(set(names.classes()) - ABSTRACT))
def test_repr_tells_in_a_line_or_a_few(name: str, objects: dict[str, Any]) -> None:
    text = repr(objects[name])
    assert text.startswith(name) or name in {"FileFormatError", "Camera"}
    assert "object at 0x" not in text
    assert "array(" not in text or name == "SurfaceSamples"
    assert len(text) < (1500 if name == "ModelParameters" else 500) or name == "SurfaceSamples"


@pytest.mark.parametrize("name", sorted(set(names.classes()) - ABSTRACT - LIVING))
def test_it_comes_back_from_pickle_and_copy(name: str, objects: dict[str, Any]) -> None:
    thing = objects[name]
    for twin in (pickle.loads(pickle.dumps(thing)), copy.copy(thing), copy.deepcopy(thing)):
        assert same(twin, thing)
        assert repr(twin) == repr(thing)


def test_results_with_other_values_differ(objects: dict[str, Any]) -> None:
    first = nacre.align(objects["Cloud"].points, objects["Cloud"].points)
    assert first == nacre.align(objects["Cloud"].points, objects["Cloud"].points)
    assert first != nacre.align(objects["Cloud"].points, objects["Cloud"].points + np.float32(0.001))
    assert first != objects["FrameReport"]


@pytest.mark.parametrize("name", sorted(LIVING))
@pytest.mark.parametrize("way", [pickle.dumps, copy.copy, copy.deepcopy], ids=lambda way: way.__name__)
def test_a_model_says_what_to_keep_in_its_place(name: str, way: Any, objects: dict[str, Any]) -> None:
    if name == "Reconstruction" and way is copy.copy:
        pytest.skip("its copy shares the model")
    with pytest.raises(TypeError, match=r"cannot be pickled or copied: .*model\.save.*model\.points"):
        way(objects[name])


@pytest.mark.parametrize("name", sorted(names.functions()))
def test_a_function_tells_what_it_takes_gives_and_raises(name: str) -> None:
    function = names.functions()[name]
    text = inspect.getdoc(function)
    assert text
    if name.startswith("nacre._core"):
        return
    signature = inspect.signature(function)
    taken = [p for p in signature.parameters if p not in ("self", "cls")]
    sections = set(re.findall(r"^(\w+)\n-{3,}$", text, re.MULTILINE))
    if len(taken) > 1:
        assert "Parameters" in sections
    if "Parameters" in sections:
        for parameter in taken:
            assert re.search(rf"^\W*(\w+, \**)*{parameter}\b", text, re.MULTILINE), parameter
    given = signature.return_annotation not in (None, "None", inspect.Signature.empty)
    told = re.search(r"\b(Return|[Yy]ield)", text) is not None
    assert not given or {"Returns", "Yields"} & sections or ("Parameters" not in sections and told)


@pytest.mark.parametrize("name", sorted(names.classes()))
def test_a_class_and_its_properties_are_documented(name: str) -> None:
    kind = names.classes()[name]
    assert inspect.getdoc(kind)
    for member, value in vars(kind).items():
        if isinstance(value, property) and not member.startswith("_"):
            assert inspect.getdoc(value), f"{name}.{member}"
