"""A frame as reports tell of it."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import fields
from typing import Any

import numpy as np

from nacre.frame_report import FrameReport

_OF_THE_RECORDING = ("truth", "translation_error", "rotation_error", "removed")
_NAMES = {field.name for field in fields(FrameReport)}.union(_OF_THE_RECORDING)
_POSES = ("world_from_camera", "truth")

#: Figures that are a number each.
NUMBERS = tuple(field.name for field in fields(FrameReport) if field.type in ("int", "float"))


class ReportedFrame:
    """
    A frame as ``report.json``, the page and the viewer tell of it.

    Its attributes are the figures of a :class:`nacre.FrameReport`, by the names that they have there, and
    what only the recording knows: ``truth``, ``translation_error``, ``rotation_error``. A figure that is not
    known is None, and left out.

    Parameters
    ----------
    index : int
        Its place in the recording.
    status : str
        TRACKED, WEAK, LOST or RELOCALISED.
    **figures
        The others; numbers that are not finite are not known.
    """

    index: int
    status: str

    def __init__(self, index: int, status: str, **figures: Any) -> None:
        unknown = figures.keys() - _NAMES
        if unknown:
            raise TypeError(f"a frame has no {', '.join(sorted(unknown))}")
        self.figures: dict[str, Any] = {"index": index, "status": status.upper()} | {
            name: None if isinstance(value, float) and not math.isfinite(value) else value
            for name, value in figures.items()
        }

    @classmethod
    def of(cls, document: Mapping[str, Any]) -> ReportedFrame:
        """Return the frame that ``report.json`` tells of."""
        known = {name: value for name, value in document.items() if name in _NAMES}
        poses = {name: np.array(known[name], np.float64) for name in _POSES if known.get(name) is not None}
        return cls(**known | poses)

    def __repr__(self) -> str:
        return f"ReportedFrame({self.index}, {self.status})"

    def __getattr__(self, name: str) -> Any:
        if name not in _NAMES:
            raise AttributeError(f"a frame has no {name}")
        return self.figures.get(name)

    @property
    def reason(self) -> str:
        """Why it is weak or lost; empty otherwise."""
        return self.figures.get("reason") or ""

    @property
    def milliseconds(self) -> Mapping[str, float]:
        """Time of each step; "total" may contain more."""
        return self.figures.get("milliseconds") or {}

    @property
    def may_be_bent(self) -> bool:
        """Whether the model has a warp field, to which the pose is relative."""
        return bool((self.figures.get("deformation") or {}).get("num_nodes"))

    @property
    def total_milliseconds(self) -> float | None:
        """Time of all steps; None where it was not measured."""
        times = self.milliseconds
        total = times["total"] if "total" in times else sum(times.values()) if times else None
        return None if total is None or math.isnan(total) else total

    @property
    def is_tracked(self) -> bool:
        """Whether it found its pose."""
        return self.status != "LOST"

    @property
    def removed(self) -> Mapping[str, int]:
        """Measured pixels that were not used, by reason."""
        return self.figures.get("removed") or {}

    @property
    def num_pixels(self) -> int | None:
        """Of the depth image."""
        return (self.figures.get("depth") or {}).get("num_pixels")

    @property
    def num_measured(self) -> int | None:
        """Pixels with a depth."""
        pixels = self.num_pixels
        return None if pixels is None else pixels - self.figures["depth"]["num_invalid"]


def plain_reason(reason: str) -> str:
    """Return a frame's reason without the figures that differ from frame to frame."""
    if reason.startswith("registration score "):
        return "it does not fit the model well enough"
    if re.match(r"only 0 pixels", reason):
        return "no usable pixel"
    if re.match(r"only \d+ pixels", reason):
        return "too few usable pixels"
    if "direction(s)" in reason:
        return "the shape leaves directions of the pose open"
    return reason
