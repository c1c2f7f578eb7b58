"""Every public function with every kind of argument: an answer that holds, or an error that helps."""

from __future__ import annotations

import dataclasses
import re
import signal
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import public_names as names
import pytest
import recipes
import strange_values as strange

import nacre

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
            with at_most(0.3 if name in recipe.grows else SECONDS):
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
        for condition, value, refused in strange.values_for(valid)
        if (wrong := complaint(recipe, name, value, refused))
    ]
    assert not complaints, "\n".join(complaints)


def fields_of(parameters: Any, prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Yield the dotted name and the default of each parameter."""
    for name, value in vars(parameters).items():
        if hasattr(value, "__dataclass_fields__"):
            yield from fields_of(value, f"{prefix}{name}.")
        elif value is not None:
            yield f"{prefix}{name}", value


@pytest.mark.parametrize(("name", "default"), list(fields_of(nacre.ModelParameters())))
def test_any_parameter(name: str, default: Any) -> None:
    complaints = []
    for condition, value, refused in strange.values_for(default):
        recipe = recipes.Recipe(lambda **changed: nacre.Model(recipes.CAMERA, **{name: changed[name]}), {})
        last = name.rpartition(".")[2]
        wrong = complaint(dataclasses.replace(recipe, arguments={last: default}), name, value, refused)
        if wrong and not re.search(rf"\b{last} must be .* got ", wrong):
            complaints.append(f"{condition}: {wrong}")
    assert not complaints, "\n".join(complaints)


# What the table does not call: results, which hold what nacre found, and what reads files.
RESULTS = {
    "AbsoluteTrajectoryError", "AlignResult", "BatchResult", "CameraFile", "ClosestPoints", "Cloud",
    "Completeness", "Consolidated",
    "DeformationReport", "DepthReport", "FScore", "FrameRecord", "FrameReport", "GlobalAlignResult",
    "NormalError", "PoseError",
    "RadiusNeighbors", "RayHits", "Reconstruction", "RegionReport", "RelativePoseError", "Sequence",
    "SequenceFrame",
    "SurfaceAccuracy", "SurfaceSamples", "Uniformity", "DepthCalibration",
}  # fmt: skip
PARAMETERS = {  # checked by what they are given to
    "DepthParameters", "ModelParameters", "RegionParameters", "RegistrationParameters",
    "GlobalRegistrationParameters",
    "NoiseModel",
}  # fmt: skip
ERRORS = {"CameraError", "Cancelled", "FileFormatError"}
FILES = {
    "nacre.datasets.detect.open_sequence",
    "nacre.model.Model.load",
    "nacre.io.cameras.read_camera", "nacre.io.meshes.read_mesh",
    "nacre.io.points.read_points", "nacre.io.trajectories.read_trajectory",
    "nacre.reconstruction.batch.batch.batch", "nacre.reconstruction.reconstruct.reconstruct",
}  # fmt: skip
NOT_OF_ARRAYS = re.compile(
    r"\.(Sequence|Reconstruction)\.\w+$|\.(Model|Consolidated)\.cloud$|\.Model\.recall_points$"
    r"|\.NoiseModel\.to_core$|\.as_dict$"
)


def test_the_table_is_complete() -> None:
    called = set(recipes.RECIPES)
    known = called | FILES
    missing = [n for n in names.functions() if n not in known and not NOT_OF_ARRAYS.search(n)]
    classes = {n.rpartition(".")[2] for n in called} | RESULTS | PARAMETERS | ERRORS | {"Trajectory"}
    missing += [n for n in names.classes() if n not in classes]
    assert not missing
    assert not called - set(names.functions()) - set(names.members())


def leaves(value: Any) -> Iterator[Any]:
    """Yield the arrays and numbers that a result holds."""
    if isinstance(value, nacre.FrameReport):
        value = dataclasses.replace(value, milliseconds={})
    if dataclasses.is_dataclass(value):
        value = tuple(getattr(value, field.name) for field in dataclasses.fields(value))
    if isinstance(value, nacre.Mesh):
        value = (value.vertices, value.triangles)
    if isinstance(value, nacre.Camera):
        value = repr(value)
    if isinstance(value, nacre.KdTree):
        value = value.query(recipes.bumpy(10), 3)
    if isinstance(value, dict):
        value = tuple(value.values())
    if isinstance(value, tuple | list):
        for item in value:
            yield from leaves(item)
    else:
        assert isinstance(value, np.ndarray | float | int | str | bool | None | np.generic), type(value)
        yield value


@pytest.mark.parametrize("function", [f for f, r in recipes.RECIPES.items() if recipes.arrays_of(r)])
def test_the_same_values_in_another_form(function: str, tmp_path: Path) -> None:
    recipe = recipes.RECIPES[function]
    expected = list(leaves(recipe.call(**recipe.arguments)))
    for name in recipes.arrays_of(recipe):
        for form, change in strange.forms(tmp_path).items():
            if name in recipe.lists and form == "a list":
                continue  # a list of integers is one of 64 bits
            found = list(leaves(recipe.call(**{**recipe.arguments, name: change(recipe.arguments[name])})))
            for a, b in zip(expected, found, strict=True):
                np.testing.assert_array_equal(a, b, err_msg=f"{name}: {form}")


SIZES = [(1, 1), (1, 7), (7, 1), (2, 2), (3, 3), (1, 500), (500, 1), (16, 17), (31, 33)]


@pytest.mark.parametrize("size", [*SIZES, pytest.param((4096, 3072), marks=pytest.mark.slow)])
def test_images_of_any_size(size: tuple[int, int]) -> None:
    width, height = size
    camera = nacre.Camera(width, height, float(width), float(width), width / 2, height / 2)
    across, down = np.linspace(0, 9, width), np.linspace(0, 7, height)[:, None]
    depth = (1.0 + 0.02 * np.sin(across) * np.cos(down)).astype(np.float32)
    clean = nacre.preprocess_depth(depth, camera)
    assert clean.shape == depth.shape
    assert len(nacre.back_project(clean, camera)) == np.isfinite(clean).sum()
    recipes.has_unit_rows(nacre.depth_normals(depth, camera))
    assert nacre.label_pixels(depth, camera).shape == depth.shape
    assert nacre.select_region(depth, camera, object=True).shape == depth.shape
    recipes._is_noise(nacre.estimate_noise(depth, camera))
    model = nacre.Model(camera)
    statuses = [model.add_frame(depth).status for _ in range(2)]
    assert statuses == ["TRACKED"] * 2 if min(size) > 20 else set(statuses) <= {"TRACKED", "WEAK", "LOST"}
    assert len(model) <= model.parameters.max_points
