"""Frames that are no part of the model: where they are, why, and what to do about them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import groupby

from nacre.run_data.reported_frame import ReportedFrame, plain_reason

_NEXT_STEPS = {
    "empty": "The depth images hold no measurement: is it the right folder or topic, and the right "
    "depth scale? nacre info shows what is in the recording.",
    "unusable": "Hardly a pixel was left after cleaning: is the depth scale right, and do --min-depth, "
    "--max-depth, --box and masks leave what is of interest?",
    "registration": "Are depth scale (nacre info shows the median depth) and focal length right? Is depth "
    'measured along the axis of the camera (else its file needs "depth": "radial")? Does each frame overlap '
    "what was seen before? Does an object turn before a background that stands still (--object)?",
    "overlap": "What a frame sees must overlap what was seen before: look at these frames in the viewer; "
    "move more slowly there, or go back to where the camera was tracked and record on from there.",
    "region": "Nothing was found to model: does a thing stand on a plane (--object), is one in the box?",
    "unreadable": "These images could not be used: are the files whole, and is it the right camera?",
    "weak": "What these frames see, a wall or a smooth cylinder, does not tell where the camera is: poses "
    "after them may be off. Move so that corners or texture come into view.",
}


@dataclass(frozen=True)
class Stretch:
    """Neighbouring frames of one status that somebody should look at."""

    first: int  #: index of the frame in the recording
    last: int
    status: str
    num_frames: int
    reason: str  #: in plain words


def stretches(frames: Sequence[ReportedFrame]) -> list[Stretch]:
    """Return the frames that were not fused, neighbours together, the longest first."""
    bad = [list(group) for status, group in groupby(frames, lambda f: f.status) if status in ("LOST", "WEAK")]
    found = [
        Stretch(
            group[0].index,
            group[-1].index,
            group[0].status,
            len(group),
            most_common_reason(f.reason for f in group),
        )
        for group in bad
    ]
    return sorted(found, key=lambda stretch: (-stretch.num_frames, stretch.first))


def most_common_reason(reasons: Iterable[str]) -> str:
    """Return why most of some frames are lost or weak, in plain words."""
    return Counter(map(plain_reason, reasons)).most_common(1)[0][0]


def advice_on(frames: Sequence[ReportedFrame], *, some_are_tracked: bool = False) -> str:
    """Return what to do about what most of some lost or weak frames suffer from."""
    cause = Counter(map(_cause, frames)).most_common(1)[0][0]
    return _NEXT_STEPS["overlap" if cause == "registration" and some_are_tracked else cause]


def _cause(frame: ReportedFrame) -> str:
    if frame.status == "WEAK":
        return "weak"
    if frame.num_pixels is None and frame.reason:
        return "unreadable"
    if frame.num_measured == 0:
        return "empty"
    if "pixels of the frame" in frame.reason:
        return "unusable"
    return "region" if frame.reason.startswith(("there is no plane", "nothing ")) else "registration"
