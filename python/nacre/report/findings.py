"""What speaks against a reconstruction."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from nacre._internal.rotations import rotation_angles
from nacre.evaluation import AbsoluteTrajectoryError
from nacre.evaluation.trajectory import MIN_ALIGNED
from nacre.report.data import ReportData
from nacre.report.deformation import deformation_figures, explained_part
from nacre.report.limits import FLIP_ANGLE, MAX_DOUBLED, MAX_POSE_ERROR, MIN_EXPLAINED, MIN_PROBABILITY
from nacre.report.lost_frames import advice_on, most_common_reason
from nacre.report.motion_check import Jump, find_jumps
from nacre.run_data.reported_frame import ReportedFrame
from nacre.run_data.text import count, quantity, ranges

Level = Literal["ok", "weak", "lost"]

_ADVICE = {
    "flip": "Look at the frames on both sides in the viewer: does the scene look the same from there? Record "
    "it more slowly, with more in view that differs, or leave those frames out (--first, --last).",
    "jump": "Look at these frames in the viewer. Fast motion needs more frames per second, no --every; "
    "before a plain wall something with shape must be in view.",
    "trajectory": "Look where the errors begin to grow (Trajectory), and whether true poses and images fit "
    "together in time. More overlap, and coming back to the start, keep drift small.",
    "doubled": "Frames disagree there, by their poses or by systematic errors of their depth: look at it in "
    "the viewer; record it more slowly, come back to it so that a loop closes, or calibrate the camera.",
    "camera": "Give the camera as it was calibrated, for images of this size (--camera FILE.json), with "
    '"depth": "radial" where its depth is the distance along the rays.',
    "dropped": "Move more slowly, or give less to register: --max-depth, --object, --set spacing=0.005, "
    "--set binning=4. What was kept of a camera (OUT/recording) can be gone over again.",
    "unexplained": "Look at animation.glb there: does it move as the thing did? What moves far from frame to "
    "frame is left behind: more frames per second, no --every, or slower.",
    "doubtful": "Look at these frames in the viewer: does what they see lie on the model?",
    "interrupted": "nacre reconstruct --resume goes on with it.",
    "single": "Points are confirmed where three frames saw them: record more views.",
}


@dataclass(frozen=True)
class Finding:
    """One thing that speaks against a run."""

    kind: str  #: "untracked", "flip", "jump", "trajectory", "doubled", "camera", "dropped", "lost", ...
    level: Level  #: "lost": do not trust it; "weak": look at it
    word: str  #: the verdict where this is the worst
    statement: str  #: what was found
    next_step: str  #: what to do
    frames: tuple[int, ...] = ()  #: indices of the frames that it is about


def find_problems(data: ReportData, trajectory: AbsoluteTrajectoryError | None) -> Iterator[Finding]:
    """Look for all that can be wrong with a run, the worst first."""
    lost = [frame for frame in data.frames if not frame.is_tracked]
    weak = [frame for frame in data.frames if frame.status == "WEAK"]
    is_failed = _is_failed(data, len(data.frames) - len(lost))
    if is_failed:
        yield _failure(data, lost)
    distance = _distance_seen(data)
    yield from _jumps(data.frames, distance)
    bent = deformation_figures(data.frames)
    if bent is None or not bent.is_bent:  # else poses are relative to the shape, and the truth is not
        yield from _pose_errors(data.frames, trajectory, distance)
    if data.camera_doubt:
        yield Finding("camera", "weak", "Inaccurate", data.camera_doubt, _ADVICE["camera"])
    yield from _doubled(data)
    yield from _unexplained(data.frames)
    yield from _doubtful(data.frames)
    if lost and data.num_dropped:
        came = count(data.num_dropped + len(data.frames))
        statement = f"{count(data.num_dropped)} of {came} frames were dropped: they came too fast"
        yield Finding("dropped", "weak", "Incomplete", statement, _ADVICE["dropped"])
    if lost and not is_failed:
        reason = most_common_reason(frame.reason for frame in lost)
        were = "were" if len(lost) > 1 else "was"
        statement = f"{count(len(lost))} of {count(len(data.frames))} frames {were} lost"
        statement += f": {reason}" * bool(reason)
        advice = advice_on(lost, some_are_tracked=True)
        yield _of_frames("lost", "weak", "Incomplete", statement, lost, advice)
    if weak:
        statement = f"{_were(len(weak))} not fused, as the shape in view leaves directions of the pose open"
        yield _of_frames("weak", "weak", "Incomplete", statement, weak, advice_on(weak))
    if data.interrupted:
        yield Finding(
            "interrupted",
            "weak",
            "Not finished",
            "the run was stopped before its end",
            _ADVICE["interrupted"],
        )
    if len(data.frames) == 1 and not is_failed:
        yield Finding("single", "weak", "One view", "there was nothing to register it to", _ADVICE["single"])


def _is_failed(data: ReportData, num_tracked: int) -> bool:
    return not num_tracked or num_tracked < data.min_tracked * len(data.frames)


def _failure(data: ReportData, lost: Sequence[ReportedFrame]) -> Finding:
    total, reason = len(data.frames), most_common_reason(frame.reason for frame in lost)
    num_tracked = total - len(lost)
    statement = "the only frame could not be used"
    if num_tracked:
        part = quantity(num_tracked / total, "fraction")
        statement = f"only {count(num_tracked)} of {count(total)} frames ({part}) were tracked"
    elif total > 1:
        statement = f"none of the {count(total)} frames could be registered"
    statement += f": {reason}" * bool(reason)
    next_step = _ADVICE["dropped"] if data.num_dropped > len(lost) else advice_on(lost)
    return Finding("untracked", "lost", "Failed", statement, next_step, _indices(lost))


def _jumps(frames: Sequence[ReportedFrame], distance_seen: float) -> Iterator[Finding]:
    jumps = find_jumps(frames, distance_seen)
    for kind, found in (
        ("flip", [j for j in jumps if j.is_flip]),
        ("jump", [j for j in jumps if not j.is_flip]),
    ):
        if not found:
            continue
        worst = max(found, key=lambda jump: jump.ratio)
        more = f", and {count(len(found) - 1)} more like it" * (len(found) > 1)
        indices = tuple(jump.last for jump in found)
        yield Finding(kind, "lost", "Wrong", _told(worst) + more, _ADVICE[kind], indices)


def _told(jump: Jump) -> str:
    verb, moved = "flips", quantity(jump.angle, "rad")
    if not jump.is_flip:
        verb, moved = "jumps", f"{quantity(jump.distance, 'm')} and {moved}"
    times = (
        f"{jump.ratio:.0f} times as far as around it"
        if np.isfinite(jump.ratio)
        else "which stands still around it"
    )
    return f"the camera {verb} by {moved} from frame {jump.first} to {jump.last}, {times}"


def _pose_errors(
    frames: Sequence[ReportedFrame], error: AbsoluteTrajectoryError | None, distance_seen: float
) -> Iterator[Finding]:
    """Hold the trajectory against the truth, as far as it is known."""
    if error is None or error.num_compared < MIN_ALIGNED or len(error.errors) != len(frames):
        yield from _pair_error(frames, distance_seen)
        return
    places = np.array([frame.truth[:3, 3] for frame in frames if frame.truth is not None]).reshape(-1, 3)
    extent = float(np.linalg.norm(np.ptp(places, axis=0))) if len(places) else 0.0
    most = MAX_POSE_ERROR * max(extent, distance_seen)
    is_off = (error.errors > most) | (error.rotation_errors > MAX_POSE_ERROR)  # False for NaN
    off = [frame for frame, wrong in zip(frames, is_off, strict=True) if wrong]
    if not off:
        return
    is_wrong = error.rmse > most or error.rotation_rmse > MAX_POSE_ERROR
    worst = f"{quantity(error.max, 'm')} and {quantity(error.rotation_max, 'rad')}"
    statement = (
        f"{count(len(off))} of {count(error.num_compared)} poses depart from the truth, by up to {worst}"
    )
    level: Level = "lost" if is_wrong else "weak"
    word = "Wrong" if is_wrong else "Wrong in part"
    advice = _ADVICE["flip" if error.rotation_max > FLIP_ANGLE else "trajectory"]
    yield _of_frames("trajectory", level, word, statement, off, advice)


def _pair_error(frames: Sequence[ReportedFrame], distance_seen: float) -> Iterator[Finding]:
    """Hold the motion between two poses against the truth: too few to align, which a motion needs not."""
    known = [frame for frame in frames if frame.world_from_camera is not None and frame.truth is not None]
    if len(known) != 2:
        return
    first, last = known
    found = np.linalg.inv(first.world_from_camera) @ last.world_from_camera
    truth = np.linalg.inv(first.truth) @ last.truth
    error = np.linalg.inv(truth) @ found
    most = MAX_POSE_ERROR * max(float(np.linalg.norm(truth[:3, 3])), distance_seen)
    shift, turn = float(np.linalg.norm(error[:3, 3])), float(rotation_angles(error[None, :3, :3])[0])
    if shift > most or turn > MAX_POSE_ERROR:
        statement = f"the motion between the two known poses departs from the truth by {quantity(shift, 'm')}"
        statement += f" and {quantity(turn, 'rad')}"
        advice = _ADVICE["flip" if turn > FLIP_ANGLE else "trajectory"]
        yield _of_frames("trajectory", "lost", "Wrong", statement, known, advice)


def _distance_seen(data: ReportData) -> float:
    """Return the median distance of the model from its first camera [m]; 0 without points."""
    points = np.zeros((0, 3)) if data.model is None else np.asarray(data.model.points, np.float64)
    distances = np.linalg.norm(points[np.isfinite(points).all(axis=1)], axis=1)
    return float(np.median(distances)) if len(distances) else 0.0


def _doubled(data: ReportData) -> Iterator[Finding]:
    found = data.doubled
    if found is not None and found.fraction > MAX_DOUBLED:
        part, apart = quantity(found.fraction, "fraction"), quantity(found.distance, "m")
        place = ", ".join(quantity(value, "m") for value in found.center)
        statement = f"{part} of the surface is there twice, {apart} apart, around ({place})"
        yield Finding("doubled", "weak", "Inaccurate", statement, _ADVICE["doubled"])


def _unexplained(frames: Sequence[ReportedFrame]) -> Iterator[Finding]:
    parts = [(frame, part) for frame in frames if (part := explained_part(frame)) is not None]
    found = [(frame, part) for frame, part in parts if part < MIN_EXPLAINED]
    if found:
        least = quantity(min(part for _, part in found), "fraction")
        show = "frames show" if len(found) > 1 else "frame shows"
        statement = (
            f"{count(len(found))} {show} down to {least} of the points in view where they were bent to"
        )
        chosen = [frame for frame, _ in found]
        yield _of_frames("unexplained", "weak", "Doubtful", statement, chosen, _ADVICE["unexplained"])


def _doubtful(frames: Sequence[ReportedFrame]) -> Iterator[Finding]:
    tracked = [frame for frame in frames if frame.is_tracked and frame.probability is not None]
    found = [frame for frame in tracked if frame.probability < MIN_PROBABILITY]
    if found:
        least = quantity(min(frame.probability for frame in found), "fraction")
        statement = f"{_were(len(found))} accepted with a probability of being right down to {least}"
        yield _of_frames("doubtful", "weak", "Doubtful", statement, found, _ADVICE["doubtful"])


def _of_frames(
    kind: str, level: Level, word: str, statement: str, frames: Sequence[ReportedFrame], next_step: str
) -> Finding:
    """Return a finding that names its frames."""
    indices = _indices(frames)
    return Finding(kind, level, word, f"{statement} ({ranges(indices)})", next_step, indices)


def _were(number: int) -> str:
    return f"{count(number)} frames were" if number > 1 else f"{count(number)} frame was"


def _indices(frames: Sequence[ReportedFrame]) -> tuple[int, ...]:
    return tuple(frame.index for frame in frames)
