"""What the registration takes, and how it refuses the rest."""

import inspect
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from known_motions import CENTER, Array, errors, plane, sampled, source_of

import nacre
from nacre import _core


def test_defaults_are_those_of_the_core() -> None:
    core = _core.AlignOptions()
    parameters = inspect.signature(nacre.align).parameters
    fields = {name for name in dir(core) if not name.startswith("_")}
    assert fields <= set(parameters)
    for name in fields:
        expected = getattr(core, name)
        expected = expected.name if name == "method" else expected
        assert parameters[name].default == expected, name
    data = {f"{cloud}_{name}" for cloud in ("source", "target") for name in ("normals", "sigma", "colors")}
    data |= {"initial"}
    assert set(parameters) - fields == data | {"source", "target"}
    assert all(parameters[name].default is None for name in data)


DTYPES: dict[str, Callable[[Array], Array]] = {
    "float32": lambda a: a.astype(np.float32),
    "longdouble": lambda a: a.astype(np.longdouble),
    "Fortran order": np.asfortranarray,
    "negative strides": lambda a: np.ascontiguousarray(a[::-1])[::-1],
    "every second row": lambda a: np.repeat(a, 2, axis=0)[::2],
    "columns of a wider array": lambda a: np.column_stack([a, a])[:, :3],
    "read only": lambda a: np.frombuffer(a.tobytes()).reshape(a.shape),
    "big endian": lambda a: a.astype(">f8"),
    "a list": lambda a: a.tolist(),
}


@pytest.mark.parametrize("form", DTYPES)
def test_any_real_array_is_taken(cloud: Any, resampled: Any, form: str) -> None:
    source, normals = source_of(resampled)
    cast = DTYPES[form]
    plain = nacre.align(source, cloud[0], source_normals=normals, target_normals=cloud[1])
    result = nacre.align(
        cast(source),
        cast(cloud[0]),
        source_normals=cast(normals),
        target_normals=cast(cloud[1]),
        initial=np.eye(4),
    )
    angle, shift = errors(result.target_from_source, plain.target_from_source)
    assert angle < 1e-3
    assert shift < 1e-6
    assert result.target_from_source.dtype == np.float64


@pytest.mark.parametrize("dtype", [np.int16, np.int64, np.float16])
def test_coarse_dtypes_are_taken(dtype: Any) -> None:
    """Millimetres as integers; half floats."""
    target, target_normals = sampled(2500, 13)
    source, normals = sampled(2000, 14)
    scaled = [
        (1000 * (points - CENTER)).round().astype(dtype)
        for points in (source + np.array([0.003, 0, 0]), target)
    ]
    result = nacre.align(*scaled, source_normals=normals, target_normals=target_normals.astype(np.float16))
    assert result.converged
    assert np.allclose(result.target_from_source[:3, 3], [-3, 0, 0], atol=0.1)


def test_arrays_of_the_caller_stay_as_they_are(cloud: Any, resampled: Any) -> None:
    for dtype in (np.float32, np.float64):
        data = [array.astype(dtype) for array in (*source_of(resampled), *cloud)]
        sigma = np.full(len(data[0]), 0.001, dtype)
        first = np.eye(4)
        before = [array.copy() for array in (*data, sigma, first)]
        nacre.align(
            data[0],
            data[2],
            source_normals=data[1],
            target_normals=data[3],
            source_sigma=sigma,
            initial=first,
        )
        assert all((a == b).all() for a, b in zip(before, (*data, sigma, first), strict=True))


GOOD = plane(15, 200)
ILLEGAL: dict[str, tuple[type[Exception], str, dict[str, Any]]] = {
    "source is flat": (ValueError, r"source.*\(N, 3\).*\(9,\)", {"source": np.zeros(9)}),
    "source has 2 columns": (ValueError, r"source.*\(N, 3\).*\(9, 2\)", {"source": np.zeros((9, 2))}),
    "source of strings": (TypeError, "source.*real", {"source": [["a", "b", "c"]]}),
    "source is complex": (TypeError, "source.*real.*complex", {"source": np.zeros((9, 3), complex)}),
    "source is None": (TypeError, "source", {"source": None}),
    "target has 4 columns": (ValueError, r"target.*\(N, 3\).*\(9, 4\)", {"target": np.zeros((9, 4))}),
    "target of objects": (TypeError, "target", {"target": np.zeros((9, 3), object)}),
    "fewer source normals": (ValueError, "source_normals.*200.*7", {"source_normals": np.zeros((7, 3))}),
    "target normals flat": (ValueError, "target_normals", {"target_normals": np.zeros(200)}),
    "fewer sigma": (ValueError, r"source_sigma.*200.*\(3,\)", {"source_sigma": np.ones(3)}),
    "sigma in columns": (ValueError, "target_sigma", {"target_sigma": np.ones((200, 1))}),
    "initial 3x3": (ValueError, r"initial.*4x4.*\(3, 3\)", {"initial": np.eye(3)}),
    "initial scaled": (ValueError, "initial.*rigid", {"initial": 2 * np.eye(4)}),
    "initial mirrored": (ValueError, "initial.*rigid", {"initial": np.diag([1, 1, -1, 1])}),
    "initial NaN": (ValueError, "initial.*rigid", {"initial": np.full((4, 4), np.nan)}),
    "unknown method": (ValueError, "method.*'point_to_plane'.*'icp'", {"method": "icp"}),
    "no iterations": (ValueError, "max_iterations.*at least 1.*0", {"max_iterations": 0}),
    "half an iteration": (TypeError, "max_iterations.*1.5", {"max_iterations": 1.5}),
    "negative max_distance": (ValueError, "max_distance.*-1", {"max_distance": -1.0}),
    "NaN max_distance": (ValueError, "max_distance.*nan", {"max_distance": float("nan")}),
    "negative final_distance": (ValueError, "final_distance.*-1", {"final_distance": -1.0}),
    "NaN final_distance": (ValueError, "final_distance.*nan", {"final_distance": float("nan")}),
    "gate_decay 0": (ValueError, r"gate_decay.*\(0, 1\].*0", {"gate_decay": 0.0}),
    "gate_decay 2": (ValueError, r"gate_decay.*\(0, 1\].*2", {"gate_decay": 2.0}),
    "max_angle 0": (ValueError, "max_angle.*positive.*0", {"max_angle": 0.0}),
    "NaN max_angle": (ValueError, "max_angle.*nan", {"max_angle": float("nan")}),
    "robust is text": (TypeError, "robust", {"robust": np.zeros(3)}),
    "sample_fraction 0": (ValueError, r"sample_fraction.*\(0, 1\]", {"sample_fraction": 0.0}),
    "sample_fraction 5": (ValueError, r"sample_fraction.*\(0, 1\].*5", {"sample_fraction": 5.0}),
    "negative max_samples": (ValueError, "max_samples.*-1", {"max_samples": -1}),
    "negative coarse_samples": (ValueError, "coarse_samples.*-1", {"coarse_samples": -1}),
    "negative weak_threshold": (ValueError, "weak_threshold.*-1", {"weak_threshold": -1.0}),
    "NaN weak_threshold": (ValueError, "weak_threshold.*nan", {"weak_threshold": float("nan")}),
    "negative threads": (ValueError, "num_threads.*-2", {"num_threads": -2}),
    "seed is text": (TypeError, "seed", {"seed": None}),
}


@pytest.mark.parametrize("case", ILLEGAL)
def test_illegal_argument_is_named(case: str) -> None:
    kind, message, changes = ILLEGAL[case]
    arguments: dict[str, Any] = {"source": GOOD[0], "target": GOOD[0], **changes}
    with pytest.raises(kind, match=message):
        nacre.align(**arguments)


def test_options_are_keywords() -> None:
    with pytest.raises(TypeError):
        nacre.align(GOOD[0], GOOD[0], GOOD[1])  # type: ignore[misc]
    with pytest.raises(TypeError):
        nacre.align(GOOD[0], GOOD[0], radius=0.1)  # type: ignore[call-arg]


def test_result_is_frozen(cloud: Any) -> None:
    result = nacre.align(cloud[0], cloud[0], source_normals=cloud[1], target_normals=cloud[1])
    with pytest.raises(AttributeError):
        result.rmse = 0.0  # type: ignore[misc]
    assert repr(result).startswith("AlignResult(converged, iterations=")
