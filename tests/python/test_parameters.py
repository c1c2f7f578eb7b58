"""Parameters: the same defaults as in C++, the presets, changes by name, and the way there and back."""

import dataclasses
from typing import Any

import pytest

import nacre
from nacre import _core
from nacre._internal.core_options import as_choice, from_core, to_core, updated
from nacre.depth import NoiseModel
from nacre.parameters import FusionParameters, WlopParameters

MIRRORS: dict[type, Any] = {
    nacre.DepthParameters: _core.DepthOptions,
    nacre.RegionParameters: _core.RegionOptions,
    nacre.RegistrationParameters: _core.AlignOptions,
    nacre.GlobalRegistrationParameters: _core.GlobalAlignOptions,
    FusionParameters: _core.FusionOptions,
    WlopParameters: _core.WlopOptions,
    nacre.ModelParameters: _core.ModelOptions,
    NoiseModel: _core.NoiseModel,
}
FLAT = [mirror for mirror in MIRRORS if mirror not in (nacre.DepthParameters, nacre.ModelParameters)]


def core_fields(core: Any) -> set[str]:
    """Return the names of a C++ struct's fields."""
    return {name for name in dir(type(core)) if isinstance(getattr(type(core), name), property)}


def assert_equal(parameters: Any, core: Any, path: str = "") -> None:
    """Compare a dataclass with a C++ struct, field by field."""
    names = [field.name for field in dataclasses.fields(parameters)]
    own = {"num_threads"} if isinstance(core, _core.AlignOptions) else set()  # an argument of align
    assert set(names) == core_fields(core) - own, path
    for name in names:
        value, other = getattr(parameters, name), getattr(core, name)
        where = f"{path}.{name}"
        if dataclasses.is_dataclass(value):
            assert_equal(value, other, where)
        elif isinstance(value, str):
            assert value == other.name.replace("_plus", "+"), where
        else:
            assert type(value) is type(other), where
            assert value == other, where


@pytest.mark.parametrize("mirror", MIRRORS, ids=lambda mirror: mirror.__name__)
def test_defaults_are_those_of_the_core(mirror: Any) -> None:
    assert_equal(mirror(), MIRRORS[mirror]())


@pytest.mark.parametrize("mirror", MIRRORS, ids=lambda mirror: mirror.__name__)
def test_parameters_are_frozen(mirror: Any) -> None:
    parameters = mirror()
    with pytest.raises(dataclasses.FrozenInstanceError):
        setattr(parameters, dataclasses.fields(parameters)[0].name, None)


def changed(value: Any, name: str) -> Any:
    """Return a legal value that differs from a default."""
    others = {
        "method": "cgal",
        "theta": "printed",
        "edge_test": "none",
        "fusion_method": "wlop+",
        "noise": NoiseModel(0.001, 0.002, 0.3),
        "max_depth": 7.5,
        "normal_radius": 0.02,
        **{f"{side}_{axis}": value for axis in "xyz" for side, value in (("min", -0.5), ("max", 1.5))},
    }
    if dataclasses.is_dataclass(value):
        return everything_changed(value)
    if name in others:
        return others[name]
    if isinstance(value, bool):
        return not value
    return value + 3 if isinstance(value, int) else 0.5 * value + 0.125


def everything_changed(parameters: Any) -> Any:
    values = {f.name: changed(getattr(parameters, f.name), f.name) for f in dataclasses.fields(parameters)}
    if isinstance(parameters, nacre.RegistrationParameters):
        values["method"] = "point_to_plane"
    return dataclasses.replace(parameters, **values)


@pytest.mark.parametrize("mirror", FLAT, ids=lambda mirror: mirror.__name__)
def test_every_field_goes_to_the_core_and_comes_back(mirror: Any) -> None:
    parameters = everything_changed(mirror())
    core = to_core(parameters, MIRRORS[mirror]())
    assert_equal(parameters, core)
    assert from_core(mirror, core) == parameters


def test_every_field_of_a_model_goes_to_the_core() -> None:
    parameters = everything_changed(nacre.ModelParameters())
    assert_equal(parameters, to_core(parameters, _core.ModelOptions()))


def test_all_parameters_of_a_model_come_back_from_the_core() -> None:
    parameters = everything_changed(nacre.ModelParameters())
    parameters = updated(parameters, {"depth.noise": None})
    assert from_core(nacre.ModelParameters, to_core(parameters, _core.ModelOptions())) == parameters


def test_unknown_choice_lists_the_choices() -> None:
    with pytest.raises(ValueError, match=r"theta must be one of 'huang', 'printed', got 'lop'"):
        to_core(WlopParameters(theta="lop"), _core.WlopOptions())  # type: ignore[arg-type]
    with pytest.raises(ValueError, match=r"edge_test must be one of .*'inverse_depth'.* got 'sobel'"):
        to_core(nacre.DepthParameters(edge_test="sobel"), _core.DepthOptions())  # type: ignore[arg-type]


def test_wrong_type_names_the_field() -> None:
    with pytest.raises(TypeError, match=r"normal_neighbors must be of type int, got 1\.5"):
        to_core(WlopParameters(normal_neighbors=1.5), _core.WlopOptions())  # type: ignore[arg-type]


# Presets


def test_default_preset_is_the_default() -> None:
    assert nacre.ModelParameters.preset("default") == nacre.ModelParameters()


PAPER: dict[str, Any] = {
    # Printed.
    "depth.edge_test": "gradient",
    "registration.method": "paper",
    "registration.sample_fraction": 0.05,
    "registration.max_distance": 0.005,
    "registration.max_iterations": 15,
    "registration.keep_best": True,
    "fusion_method": "wlop",
    "wlop.theta": "printed",
    "wlop.radius": 0.008,
    "wlop.mu": 0.4,
    "wlop.iterations": 10,
    "max_points": 2000,
    "wlop.first_fraction": 0.5,
    "wlop.kept_fraction": 0.9,
    "wlop.new_fraction": 0.2,
    # Left open.
    "registration.max_angle": 0.6,
    "wlop.normal_neighbors": 10,
    "wlop.normal_radius": 0.01,
    # What the paper does not have.
    "registration.final_distance": 0.005,
    "registration.gate_decay": 1.0,
    "registration.robust": False,
    "registration.max_points": 0,
    "registration.max_samples": 0,
    "registration.coarse_samples": 0,
    "registration.weak_threshold": 0.0,
    "verify": False,
    "relocalise": False,
    "binning": 1,
    "calibrate_depth": False,
    "loop_closure": False,
    "denoise_samples": False,
}


@pytest.mark.parametrize("name", PAPER)
def test_every_number_of_the_paper(name: str) -> None:
    """Blackburn, Kubacki and Stratton 2010."""
    value: Any = nacre.ModelParameters.preset("paper")
    for part in name.split("."):
        value = getattr(value, part)
    assert value == PAPER[name]


def test_the_paper_changes_nothing_else() -> None:
    assert updated(nacre.ModelParameters(), PAPER) == nacre.ModelParameters.preset("paper")


def test_unknown_preset() -> None:
    with pytest.raises(ValueError, match="preset must be 'default' or 'paper', got 'best'"):
        nacre.ModelParameters.preset("best")  # type: ignore[arg-type]


# Changes by name


def test_changes_by_dotted_name() -> None:
    before = nacre.ModelParameters()
    after = updated(before, {"registration.max_angle": 0.5, "spacing": 0.002, "fusion.min_observations": 5})
    assert after.registration.max_angle == 0.5
    assert after.spacing == 0.002
    assert after.fusion.min_observations == 5
    assert before == nacre.ModelParameters()
    nested = {"registration": {"max_angle": 0.5}, "spacing": 0.002, "fusion": {"min_observations": 5}}
    assert after == updated(before, nested)
    assert updated(before, {}) == before


def test_a_part_may_be_replaced_as_a_whole() -> None:
    part = nacre.RegistrationParameters(max_iterations=7)
    assert updated(nacre.ModelParameters(), {"registration": part}).registration is part


def test_later_changes_win() -> None:
    changes = {"registration": nacre.RegistrationParameters(seed=4), "registration.seed": 5}
    assert updated(nacre.ModelParameters(), changes).registration.seed == 5


def test_integers_serve_as_floats() -> None:
    after = updated(nacre.ModelParameters(), {"spacing": 1, "registration.max_distance": 2})
    assert type(after.spacing) is float
    assert type(after.registration.max_distance) is float


@pytest.mark.parametrize("name", ["spacin", "registration.max_angel", "fusion.age", "", "Registration"])
def test_unknown_name_lists_the_names(name: str) -> None:
    with pytest.raises(ValueError, match=r"there is no parameter .* it has ") as caught:
        updated(nacre.ModelParameters(), {name: 1})
    part = name.partition(".")[0]
    assert {"registration": "max_angle", "fusion": "min_observations"}.get(part, "spacing") in str(
        caught.value
    )


def test_unknown_name_in_a_nested_mapping() -> None:
    with pytest.raises(
        ValueError,
        match=r"'decay' in RegistrationParameters \(did you mean 'gate_decay'\?\); it has .*gate_decay",
    ):
        updated(nacre.ModelParameters(), {"registration": {"decay": 1.0}})


def test_as_choice() -> None:
    assert as_choice("side", "left", {"left": 1, "right": 2}) == 1
    for value in ("up", 3, None):
        with pytest.raises(ValueError, match="side must be one of 'left', 'right', got"):
            as_choice("side", value, {"left": 1, "right": 2})
