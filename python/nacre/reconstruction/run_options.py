"""What a run was asked to do with which recording, so that it can be resumed."""

from __future__ import annotations

import dataclasses
import logging
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from nacre._internal.arrays import as_count, as_flag, as_number, as_scale
from nacre._internal.core_options import leaves
from nacre.datasets import open_sequence
from nacre.errors import CannotResumeError, FileFormatError, RunError, shown
from nacre.evaluation.result import plain
from nacre.parameters import ModelParameters
from nacre.system import __version__

if TYPE_CHECKING:
    from nacre.datasets import Sequence

_log = logging.getLogger(__name__)


@dataclass
class RunOptions:
    """The options of ``nacre reconstruct`` but for those that the model keeps itself; paths as given."""

    source: str
    format: str | None = None
    camera: str | None = None
    depth_scale: float | None = None
    masks: str | None = None
    attribute: list[str] = dataclasses.field(default_factory=list)
    color: bool = True
    first: int = 0
    last: int | None = None
    every: int = 1
    realtime: bool = False
    pieces: bool = False
    retry: bool = True
    preset: str = "default"
    is_camera: bool = False
    all_points: bool = False
    report: bool = True
    min_tracked: float = 0.5
    parameters: dict[str, Any] = dataclasses.field(default_factory=dict)  # see changed_parameters

    @property
    def pick(self) -> tuple[int, int | None, int]:
        """Which frames, as a slice."""
        return self.first, None if self.last is None else self.last + 1, self.every

    def open(self, folder: Path | None = None) -> Sequence:
        """Open the recording; paths that are not absolute begin at a folder, or where we are."""

        def path(name: str) -> Path:
            return Path(name) if folder is None or folder == Path.cwd() else folder / name

        sequence = open_sequence(
            path(self.source),
            format=self.format,
            camera=None if self.camera is None else path(self.camera),
            depth_scale=self.depth_scale,
        )
        if self.masks is not None:
            sequence = sequence.with_masks(path(self.masks))
        for text in self.attribute:
            name, equals, images = text.partition("=")
            if not (name and equals and images):
                raise RunError(f"attribute needs NAME=FOLDER, got {text!r}", 2)
            sequence = sequence.with_attribute(name, path(images))
        return sequence if self.color else sequence.without_color()

    def indices(self, sequence: Sequence) -> range:
        """Return which frames to run."""
        indices = range(len(sequence))[slice(*self.pick)]
        if not indices:
            first, last, every = self.first, self.last, self.every
            picked = f"first {first}, last {last}, every {every}" if last is not None else f"first {first}"
            raise RunError(f"{picked} leaves none of {len(sequence)} frames (0 to {len(sequence) - 1})", 2)
        return indices

    def document(self, sequence: Sequence) -> dict[str, Any]:
        """Return what ``run.json`` says."""
        return {
            "nacre": __version__,
            "folder": str(Path.cwd()),
            "options": dataclasses.asdict(self),
            "recording": None if self.is_camera else sequence.digests(),
        }


def may_park(parameters: ModelParameters) -> bool:
    """Return whether points of a model may leave memory."""
    return parameters.loop_closure and parameters.fusion_method == "fuse" and not parameters.deform


def changed_parameters(parameters: ModelParameters) -> dict[str, Any]:
    """Return the parameters that differ from the defaults, by their dotted names, as JSON has them."""
    defaults = dict(leaves(plain(dataclasses.asdict(ModelParameters()))))
    found = leaves(plain(dataclasses.asdict(parameters)))
    return {name: value for name, value in found if value != defaults.get(name)}


def options_before(document: Mapping[str, Any], path: Path) -> tuple[RunOptions, Path]:
    """Return the options that ``run.json`` tells, and the folder that paths begin at."""
    try:
        recording = document["recording"]
        if not (recording is None or (isinstance(recording, dict) and "files" in recording)):
            raise TypeError("recording must be an object with files")
        return checked(RunOptions(**document["options"])), Path(document["folder"])
    except (KeyError, TypeError, ValueError) as error:
        raise FileFormatError(path, f"it does not say what was asked for ({error})") from None


def checked(options: RunOptions) -> RunOptions:
    """Return options that a file or a caller tells; a TypeError or a ValueError says what is wrong."""
    for name in ("source", "preset", "format", "camera", "masks"):
        value = getattr(options, name)
        may_be_none = name not in ("source", "preset")
        if not (isinstance(value, str) and "\0" not in value) and not (value is None and may_be_none):
            raise TypeError(f"{name} must be a text, got {shown(value)}")
    for name in ("color", "realtime", "pieces", "retry", "is_camera", "all_points", "report"):
        as_flag(name, getattr(options, name))
    for name, minimum in (("first", 0), ("last", 0), ("every", 1)):
        if getattr(options, name) is not None or name != "last":
            as_count(name, getattr(options, name), minimum=minimum)
    if not 0 <= as_number("min_tracked", options.min_tracked) <= 1:
        raise ValueError(f"min_tracked must be 0 to 1, got {options.min_tracked}")
    if options.depth_scale is not None:
        as_scale("depth_scale", options.depth_scale)
    if not (isinstance(options.attribute, list) and all(isinstance(text, str) for text in options.attribute)):
        raise TypeError(f"attribute must be a list of texts, got {shown(options.attribute)}")
    if not isinstance(options.parameters, dict):
        raise TypeError(f"parameters must be an object, got {shown(options.parameters)}")
    return options


def check_recording(document: Mapping[str, Any], sequence: Sequence) -> None:
    """Compare a recording with what it was; a CannotResumeError says that it is another one."""
    if document.get("nacre") != __version__:
        _log.warning("the run began with nacre %s; this is nacre %s", document.get("nacre"), __version__)
    before, now = document.get("recording"), sequence.digests()
    if before is None or before == now:
        return
    if before.get("files") != now["files"]:
        raise CannotResumeError(
            f"{sequence.path} is not the recording that it was: files were added, removed or have another "
            "size"
        )
    _log.warning("%s: files were written again since the run began", sequence.path)
