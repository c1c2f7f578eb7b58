"""What the model takes, and how it refuses the rest."""

import functools
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from model_scenes import FLAT, Array, ball, flat_grid, relief, rms, state

import nacre
from nacre._internal.core_options import updated

ILLEGAL: dict[str, tuple[type[Exception], str, dict[str, Any]]] = {
    "transposed": (
        ValueError,
        "depth must have the camera's size.*100 x 80.*80 x 100",
        {"depth": relief().T},
    ),
    "cropped": (ValueError, "depth must have the camera's size", {"depth": relief()[:50]}),
    "flat depth": (ValueError, r"depth must have shape \(H, W\)", {"depth": relief().ravel()}),
    "complex depth": (TypeError, "depth must be .*real", {"depth": relief().astype(complex)}),
    "depth is text": (TypeError, "depth must be .*real", {"depth": "frame.png"}),
    "depth is None": (TypeError, "depth must be .*real", {"depth": None}),
    "millimetres": (ValueError, "depth_scale", {"depth": 1000 * relief()}),
    "kilometres": (ValueError, "depth_scale", {"depth": relief() / 1000}),
    "integers": (ValueError, "depth_scale", {"depth": (1000 * relief()).astype(np.uint16)}),
    "small mask": (ValueError, "mask must have the depth image's shape", {"mask": np.ones((10, 10))}),
    "mask is text": (TypeError, "mask must be", {"mask": np.full((80, 100), "x")}),
    "grey image": (ValueError, "color must have shape", {"color": np.zeros((80, 100), np.uint8)}),
    "small color": (ValueError, "color must have shape", {"color": np.zeros((40, 50, 3), np.uint8)}),
    "four channels": (ValueError, "leave alpha out", {"color": np.zeros((80, 100, 4), np.uint8)}),
    "float color": (
        ValueError,
        "color must be .*floats from 0 to 1.*2",
        {"color": np.full((80, 100, 3), 2.0)},
    ),
    "guess 3x3": (ValueError, "guess must be a 4x4 matrix", {"guess": np.eye(3)}),
    "guess scaled": (ValueError, "guess must be a rigid", {"guess": 2 * np.eye(4)}),
    "guess NaN": (ValueError, "guess must be a rigid", {"guess": np.full((4, 4), np.nan)}),
    "no guess to keep": (ValueError, "keep_guess must be used with a guess", {"keep_guess": True}),
}


@functools.cache
def relief_model() -> nacre.Model:
    model = nacre.Model(FLAT)
    model.add_frame(relief())
    return model


@pytest.mark.parametrize("case", ILLEGAL)
def test_illegal_argument_is_named_and_changes_nothing(case: str) -> None:
    model = relief_model()
    before = state(model)
    kind, message, changes = ILLEGAL[case]
    with pytest.raises(kind, match=message):
        model.add_frame(**{"depth": relief(), **changes})
    assert state(model) == before
    assert len(model.frames) == 1


def test_illegal_parameters() -> None:
    with pytest.raises(TypeError, match=r"camera must be a nacre\.Camera, got int"):
        nacre.Model(5)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="preset must be 'default' or 'paper', got 'best'"):
        nacre.Model(FLAT, "best")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match=r"there is no parameter 'spacings' .* spacing,"):
        nacre.Model(FLAT, spacings=1)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"spacing": -1.0}, "spacing must be .* got -1"),
        ({"spacing": float("nan")}, "spacing must be .* got nan"),
        ({"spacing": float("inf")}, "spacing must be .* got inf"),
        ({"spacing": 1e30}, "spacing must be .* got 1e"),
        ({"max_points": 5}, "max_points must be at least 100, got 5"),
        ({"min_score": float("nan")}, "min_score must be .* got nan"),
        ({"wlop.first_fraction": 0.0}, "first_fraction must be in .* got 0"),
        ({"wlop.kept_fraction": -0.1}, "kept_fraction must be in .* got -0.1"),
        ({"wlop.new_fraction": 2.0}, "new_fraction must be in .* got 2"),
        ({"num_threads": -1}, "num_threads must be .* got -1"),
        ({"fusion_method": "tsdf"}, r"fusion_method must be one of 'fuse', 'wlop', 'wlop\+', got 'tsdf'"),
        ({"registration.method": "icp"}, "method must be one of .* got 'icp'"),
        ({"registration.max_iterations": 0}, "max_iterations must be at least 1, got 0"),
        ({"fusion.max_confidence": 0.0}, "max_confidence must be positive, got 0"),
        ({"fusion.min_observations": -1}, "min_observations must be .* got -1"),
        ({"fusion.max_free_space_violations": 256}, "max_free_space_violations must be 1 to 255, got 256"),
        ({"fusion.reference_sigma": -0.5}, "reference_sigma must be .* got -0.5"),
        ({"wlop.radius": 0.0}, "radius must be .* got 0"),
        ({"wlop.mu": 0.9}, "mu must be .* got 0.9"),
        ({"depth.edge_test": "sobel"}, "edge_test must be one of .* got 'sobel'"),
        ({"depth.max_missing": 3.0}, "max_missing must be .* got 3"),
    ],
    ids=lambda value: next(iter(value)) if isinstance(value, dict) else "",
)
def test_parameter_out_of_range_is_named(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        nacre.Model(FLAT, **changes)


def test_parameters_of_the_caller_are_used() -> None:
    parameters = updated(nacre.ModelParameters(), {"spacing": 0.004, "fusion_method": "wlop+"})
    model = nacre.Model(FLAT, parameters=parameters, max_points=400)
    assert model.parameters == updated(parameters, {"max_points": 400})
    assert model.add_frame(relief()).spacing == 0.004
    assert len(model) <= 400
    assert model.camera == FLAT


@pytest.mark.parametrize(
    "cast",
    [
        lambda d: d.astype(np.float32),
        lambda d: np.asfortranarray(d),
        lambda d: np.repeat(d, 2, axis=1)[:, ::2],
        lambda d: d.astype(">f8"),
        lambda d: d.tolist(),
        lambda d: np.where(np.isnan(d), -1, d),
        lambda d: np.where(np.isnan(d), 0, d),
        lambda d: np.where(np.isnan(d), np.inf, d),
    ],
    ids=["float32", "Fortran", "strided", "big endian", "list", "negative", "zero", "inf"],
)
def test_any_depth_image_is_taken(cast: Callable[[Array], Any]) -> None:
    depth = ball()
    expected, model = nacre.Model(FLAT), nacre.Model(FLAT)
    expected.add_frame(depth.astype(np.float32))
    image = cast(depth)
    before = np.array(image, copy=True)
    model.add_frame(image)
    assert np.array_equal(before, np.array(image), equal_nan=True)
    assert (model.points == expected.points).all()


def test_depth_scale_of_integer_images() -> None:
    stored = np.nan_to_num(5000 * ball(), nan=0).round().astype(np.uint16)
    model = nacre.Model(FLAT, depth_scale=5000)
    assert model.add_frame(stored).status == "TRACKED"
    assert rms(np.linalg.norm(model.points - np.array([0, 0, 0.3]), axis=1) - 0.03) < 1 / 5000


def test_mask_selects_the_object() -> None:
    x, _ = flat_grid()
    for mask in (x < 0, (x < 0).astype(float), np.asfortranarray(x < 0)):
        model = nacre.Model(FLAT)
        report = model.add_frame(relief(), mask=mask)
        assert model.points[:, 0].max() < 0
        assert report.depth.num_masked == 4000
        assert len(model) > 500
