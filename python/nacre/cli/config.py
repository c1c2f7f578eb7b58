"""The model's parameters from the command line and from a TOML file."""

from __future__ import annotations

import dataclasses
import difflib
import re
from collections.abc import Mapping, Sequence
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from nacre.cli.terminal import CommandError
from nacre.errors import FileFormatError, shown

if TYPE_CHECKING:
    from nacre.parameters import ModelParameters


_MOST_BYTES = 1 << 16
_DEEP_KEY = re.compile(r"(?<![^\s.,=\[\]{}])(?:[^\s.,=\[\]{}]+[ \t]*\.[ \t]*){16}")
_LONG_NUMBER = re.compile(r"[0-9_]{400}")


class Preset(str, Enum):
    """Where the parameters start from."""

    default = "default"
    paper = "paper"


PresetOption = Annotated[
    Preset | None,
    typer.Option(
        "--preset",
        help="default: what measures best; paper: the 2010 paper's algorithm and numbers, alone.",
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
    from nacre._internal.core_options import leaves
    from nacre.parameters import ModelParameters

    names = (name for name, _ in leaves(dataclasses.asdict(ModelParameters())))
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
    from nacre._internal.core_options import leaves, updated
    from nacre.parameters import ModelParameters

    document = dict(_read_toml(config)) if config is not None else {}
    name = document.pop("preset", "default")
    if not isinstance(name, str) or name not in Preset.__members__:
        raise FileFormatError(config or "", f"preset must be default or paper, got {shown(name)}")
    name = preset.value if preset is not None else name
    parameters = ModelParameters.preset(name)  # type: ignore[arg-type]
    if config is not None:
        parameters = _told_by_file(config, document, parameters)
    changes: dict[str, Any] = {}
    for setting in settings or ():
        changes.update(_setting(setting))
    changes.update({key: value for key, value in more.items() if value is not None})
    parameters = updated(parameters, {k: _checked(parameters, k, v) for k, v in changes.items()})
    if parameters.deform:
        _refuse_for_what_bends({**dict(leaves(document)), **changes})
    return parameters, name


def _refuse_for_what_bends(asked: Mapping[str, Any]) -> None:
    """Refuse what was asked for, and what a model that deforms does without."""
    for key, option in (("loop_closure", "--loop-closure"), ("calibrate_depth", "--calibrate")):
        if asked.get(key):
            raise CommandError(f"{key} ({option}) must be off for a model that deforms, got on", 2)


def _told_by_file(path: Path, document: Mapping[str, Any], parameters: ModelParameters) -> ModelParameters:
    """Return the parameters with the changes of a file, which must make a model."""
    from nacre import Camera
    from nacre._internal.core_options import leaves, updated
    from nacre.model import Model

    try:
        changes = dict(leaves(document))
        changed = updated(
            parameters, {key: _checked(parameters, key, value) for key, value in changes.items()}
        )
        Model(Camera(width=8, height=8, fx=8, fy=8, cx=4, cy=4), parameters=changed)
    except RecursionError:
        raise FileFormatError(path, "its tables are nested too deep") from None
    except (CommandError, ValueError, TypeError) as error:
        raise FileFormatError(path, str(error)) from error
    return changed


def _toml() -> Any:
    import importlib
    import sys

    return importlib.import_module("tomllib" if sys.version_info >= (3, 11) else "tomli")


def _read_toml(path: Path) -> Mapping[str, Any]:
    from nacre.io.raw import read_text

    toml = _toml()
    text = read_text(path, _MOST_BYTES)
    # Python's parser takes the square of a key's length, and for a number 150 times its memory.
    for pattern, what in ((_DEEP_KEY, "a key is nested too deep"), (_LONG_NUMBER, "a number of 400 digits")):
        found = pattern.search(text)
        if found is not None:
            line = 1 + text.count("\n", 0, found.start())
            raise FileFormatError(path, f"not TOML that can be read: {what}", line=line)
    try:
        document: Mapping[str, Any] = toml.loads(text)
    except RecursionError:
        raise FileFormatError(path, "not TOML that can be read: it is nested too deep") from None
    except ValueError as error:  # TOMLDecodeError, or a number of more digits than Python reads
        told = re.search(r"line (\d+)", str(error))
        line = int(told[1]) if told else 1 + text.rstrip().count("\n")
        raise FileFormatError(path, f"not TOML: {error}", line=line) from error
    return document


def _setting(text: str) -> dict[str, Any]:
    key, equals, value = (part.strip() for part in text.partition("="))
    if not equals or not key or not value:
        raise CommandError(f"--set needs KEY=VALUE, such as registration.max_angle=0.5, got {text!r}", 2)
    from nacre._internal.core_options import leaves

    toml = _toml()
    try:
        return dict(leaves({key: toml.loads(f"value = {value}")["value"]}))
    except toml.TOMLDecodeError:
        if re.fullmatch(r"[A-Za-z_][\w+-]*", value):  # a word needs no quotes
            return {key: value}
        raise CommandError(f"--set {key}: {value!r} is no TOML value", 2) from None


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

        try:
            return NoiseModel(**value) if isinstance(value, Mapping) else as_noise_choice(key, value)
        except TypeError as error:
            parts = ", ".join(field.name for field in dataclasses.fields(NoiseModel))
            raise CommandError(f"{key} must have numbers for {parts}, got {shown(value)}", 2) from error
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
