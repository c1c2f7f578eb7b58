"""The model's parameters from the command line and from a TOML file."""

from __future__ import annotations

import dataclasses
import difflib
import re
from collections.abc import Iterator, Mapping, Sequence
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from nacre.cli.terminal import CommandError

if TYPE_CHECKING:
    from nacre.model import ModelParameters


class Preset(str, Enum):
    """Where the parameters start from."""

    default = "default"
    paper = "paper"


PresetOption = Annotated[
    Preset | None,
    typer.Option(
        "--preset",
        help="default: what measures best; paper: every number of the 2010 paper.",
        show_default="default",
    ),
]
ConfigOption = Annotated[
    Path | None,
    typer.Option(
        "--config",
        metavar="FILE.toml",
        help="Parameters from a TOML file with tables such as \\[registration], \\[depth], \\[fusion].",
    ),
]


def complete_parameter(incomplete: str) -> list[str]:
    """Return the parameters that begin so, for the shell."""
    from nacre.model import ModelParameters

    names = (name for name, _ in _leaves(dataclasses.asdict(ModelParameters())))
    return [f"{name}=" for name in names if name.startswith(incomplete)]


SetOption = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY=VALUE",
        help="One parameter, e.g. registration.max_angle=0.5. May be repeated.",
        autocompletion=complete_parameter,
    ),
]


def model_parameters(
    preset: Preset | None, config: Path | None, settings: Sequence[str] | None, **more: Any
) -> tuple[ModelParameters, str]:
    """Return the parameters and the preset's name; settings win over the file, and that over the preset."""
    from nacre.model import ModelParameters
    from nacre.parameters import updated

    document = dict(_read_toml(config)) if config is not None else {}
    name = document.pop("preset", "default")
    if name not in Preset.__members__:
        raise CommandError(f"{config}: preset must be default or paper, got {name!r}", 2)
    name = preset.value if preset is not None else name
    parameters = ModelParameters.preset(name)  # type: ignore[arg-type]
    changes = dict(_leaves(document))
    for setting in settings or ():
        changes.update(_setting(setting))
    changes.update({key: value for key, value in more.items() if value is not None})
    return updated(parameters, {k: _checked(parameters, k, v) for k, v in changes.items()}), name


def _toml() -> Any:
    import importlib
    import sys

    return importlib.import_module("tomllib" if sys.version_info >= (3, 11) else "tomli")


def _read_toml(path: Path) -> Mapping[str, Any]:
    toml = _toml()
    try:
        with path.open("rb") as stream:
            document: Mapping[str, Any] = toml.load(stream)
    except (toml.TOMLDecodeError, UnicodeDecodeError) as error:
        raise CommandError(f"{path}: not TOML: {error}", 2) from error
    return document


def _setting(text: str) -> dict[str, Any]:
    key, equals, value = (part.strip() for part in text.partition("="))
    if not equals or not key or not value:
        raise CommandError(f"--set needs KEY=VALUE, such as registration.max_angle=0.5, got {text!r}", 2)
    toml = _toml()
    try:
        return dict(_leaves({key: toml.loads(f"value = {value}")["value"]}))
    except toml.TOMLDecodeError:
        if re.fullmatch(r"[A-Za-z_][\w+-]*", value):  # a word needs no quotes
            return {key: value}
        raise CommandError(f"--set {key}: {value!r} is no TOML value", 2) from None


def _leaves(tree: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    for key, value in tree.items():
        if isinstance(value, Mapping) and prefix + key != "depth.noise":
            yield from _leaves(value, f"{prefix}{key}.")
        else:
            yield prefix + key, value


def _checked(parameters: Any, key: str, value: Any) -> Any:
    """Return a value for a parameter, or raise an error that says which names or types there are."""
    current, group = parameters, ""
    for part in key.split("."):
        names = [f.name for f in dataclasses.fields(current)] if dataclasses.is_dataclass(current) else []
        if part not in names:
            near = difflib.get_close_matches(part, names, 1)
            hint = f" (did you mean {group}{near[0]}?)" if near else ""
            known = f"{group.rstrip('.') or 'the model'} has {', '.join(names) or 'no parts'}"
            raise CommandError(f"there is no parameter {key!r}{hint}; {known}", 2)
        current, group = getattr(current, part), f"{group}{part}."
    if key == "depth.noise":
        from nacre.noise import NoiseModel, as_noise_choice

        return NoiseModel(**value) if isinstance(value, Mapping) else as_noise_choice(key, value)
    if dataclasses.is_dataclass(current):
        raise CommandError(
            f"{key} is a group; set one of {', '.join(f.name for f in dataclasses.fields(current))}", 2
        )
    kind = type(current)
    fits = isinstance(value, kind) and not (kind is int and isinstance(value, bool))
    if kind is float:
        fits = isinstance(value, (int, float)) and not isinstance(value, bool)
    if not fits:
        words = {bool: "true or false", int: "a whole number", float: "a number", str: "a word"}
        raise CommandError(f"{key} must be {words[kind]}, got {value!r}", 2)
    return value
