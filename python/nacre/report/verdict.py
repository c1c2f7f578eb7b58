"""Whether a reconstruction is good, in plain words."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby

import numpy as np

from nacre.evaluation import AbsoluteTrajectoryError
from nacre.report.data import ReportData
from nacre.report.reported_frame import ReportedFrame
from nacre.report.text import count, quantity, ranges

#: A trajectory whose error is a larger part of its extent is to be looked at.
_MAX_DRIFT = 0.05

_NEXT_STEPS = {
    "empty": "The depth images hold no measurement: is it the right folder or topic, and the right "
    "depth scale? nacre info shows what is in the recording.",
    "unusable": "Hardly a pixel was left after cleaning: is the depth scale right, and do --min-depth, "
    "--max-depth, --box and masks leave what is of interest?",
    "registration": "Is the depth scale right (nacre info shows the median depth)? Does each frame overlap "
    "what was seen before? Does an object turn before a background that stands still (--object)?",
    "region": "Nothing was found to model: does a thing stand on a plane (--object), is one in the box?",
    "unreadable": "These images could not be used: are the files whole, and is it the right camera?",
    "weak": "WEAK frames have a pose but were not fused: what they see, a wall or a smooth cylinder, "
    "leaves directions open. Move so that corners or texture come into view.",
}


@dataclass(frozen=True)
class Verdict:
    """What to say first."""

    level: str  #: "ok", "weak" or "lost"
    word: str  #: the verdict in a few words
    why: str  #: what it rests on
    next_step: str = ""  #: what to try


@dataclass(frozen=True)
class Stretch:
    """Neighbouring frames of one status that somebody should look at."""

    first: int  #: index of the frame in the recording
    last: int
    status: str
    num_frames: int
    reason: str  #: in plain words


def judge(data: ReportData, trajectory: AbsoluteTrajectoryError | None) -> Verdict | None:
    """Return the verdict on a run; None where nothing was run."""
    frames = data.frames
    if not frames:
        return None
    statuses = Counter(frame.status for frame in frames)
    num_lost, num_weak, num_frames = statuses["LOST"], statuses["WEAK"], len(frames)
    num_tracked = num_frames - num_lost
    bad = [frame for frame in frames if frame.status in ("LOST", "WEAK")]
    extra = [f"{count(num_lost)} lost"] * bool(num_lost) + [f"{count(num_weak)} with weak geometry"] * bool(
        num_weak
    )
    tracked = f"{count(num_tracked)} of {count(num_frames)} frames were tracked"
    if not num_lost:
        tracked = f"All {count(num_frames)} frames were tracked" if num_frames > 1 else "There is one frame"
    tracked += f" ({', '.join(extra)})" if extra else ""
    found = statuses["RELOCALISED"]
    if found:
        tracked += f", {count(found)} of them found again after a loss"
    if data.interrupted:
        tracked += "; the run was stopped before its end"

    advice = _NEXT_STEPS[_cause(bad)] if bad else ""
    if not num_tracked:
        tracked = (
            f"None of the {count(num_frames)} frames could be registered" if num_frames > 1 else "It is lost"
        )
        reason = Counter(plain_reason(frame.reason) for frame in bad).most_common(1)[0][0]
        told = f": {reason}" if reason else ""
        return Verdict("lost", "Failed: no frame could be used", f"{tracked}{told}", advice)
    if num_lost > num_frames / 2:
        return Verdict("lost", "Failed for most frames", tracked, advice)
    if bad:
        named = ranges([frame.index for frame in bad])
        return Verdict("weak", f"Good in parts; look at {named}", tracked, advice)
    if data.interrupted:
        return Verdict("weak", "Not finished", tracked)
    if num_frames == 1:
        return Verdict(
            "weak",
            "One view, nothing to register",
            tracked,
            "The model is what this image shows; points are confirmed where three frames saw them.",
        )
    drift = _drift(frames, trajectory)
    if trajectory is not None and drift > _MAX_DRIFT:
        off = quantity(drift, "fraction")
        return Verdict(
            "weak",
            "Tracked, but look at the trajectory",
            f"{tracked}, yet the path departs from the truth by {off} of its extent",
            "Look where the errors begin to grow; and whether truth and images belong together in time.",
        )
    return Verdict("ok", "Good", tracked)


def stretches(frames: Sequence[ReportedFrame]) -> list[Stretch]:
    """Return the frames to look at, neighbours together, the longest first."""
    bad = [list(group) for status, group in groupby(frames, lambda f: f.status) if status in ("LOST", "WEAK")]
    found = [
        Stretch(
            group[0].index,
            group[-1].index,
            group[0].status,
            len(group),
            Counter(plain_reason(frame.reason) for frame in group).most_common(1)[0][0],
        )
        for group in bad
    ]
    return sorted(found, key=lambda stretch: (-stretch.num_frames, stretch.first))


def plain_reason(reason: str) -> str:
    """Return a frame's reason without the figures that differ from frame to frame."""
    if reason.startswith("registration score "):
        return "too little agrees with the model"
    if re.match(r"only 0 pixels", reason):
        return "no usable pixel"
    if re.match(r"only \d+ pixels", reason):
        return "too few usable pixels"
    if "direction(s)" in reason:
        return "the shape leaves directions of the pose open"
    return reason


def _cause(frames: Sequence[ReportedFrame]) -> str:
    """Return what most of the frames that were not tracked suffer from."""

    def cause(frame: ReportedFrame) -> str:
        if frame.status == "WEAK":
            return "weak"
        if frame.num_pixels is None and frame.reason:
            return "unreadable"
        if frame.num_measured == 0:
            return "empty"
        if "pixels of the frame" in frame.reason:
            return "unusable"
        return "region" if "plane" in frame.reason or "box" in frame.reason else "registration"

    return Counter(cause(frame) for frame in frames).most_common(1)[0][0]


def _drift(frames: Sequence[ReportedFrame], trajectory: AbsoluteTrajectoryError | None) -> float:
    """Return the error of the positions as a part of the true path's extent; NaN where it is not known."""
    places = [np.asarray(frame.truth, dtype=np.float64)[:3, 3] for frame in frames if frame.truth is not None]
    if trajectory is None or len(places) < 2:
        return math.nan
    extent = float(np.linalg.norm(np.ptp(np.array(places), axis=0)))
    return trajectory.rmse / extent if extent > 0 else math.nan
