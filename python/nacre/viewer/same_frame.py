"""Two runs of one scene in one world frame."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from nacre.global_registration import align_global
from nacre.run_data.reported_frame import ReportedFrame
from nacre.run_data.text import quantity
from nacre.viewer.disks import deviation
from nacre.viewer.snapshot import Snapshot
from nacre.viewer.timeline import Timeline

_SAMPLES = 20_000  # budget
_TOLERANCE = 3.0  # spacings: how far apart the same place may be in two runs of one frame


def in_frame_of(first: Timeline, other: Timeline) -> Timeline:
    """
    Return a run moved into the world frame of another, where it is not there already.

    A run's world is usually its first camera's frame, which is another one where another recording, or
    another part, began. Where half the points of either model lie within three spacings of the other's
    surface, frames are taken to be the same, and nothing moves; else :func:`nacre.align_global` finds the
    motion between the newest models.

    Parameters
    ----------
    first, other : Timeline
        Each with a state of its model.

    Returns
    -------
    Timeline
        The other; its ``placement`` says how far it was moved, or that no motion was found.
    """
    if not (first.has_points and other.has_points):
        return other
    if not np.array_equal(first.origin, other.origin):
        apart = np.eye(4)
        apart[:3, 3] = other.origin - first.origin
        other = _placed(other, apart, "")
        other.origin = first.origin
    still, moving = (timeline.snapshots[-1][1] for timeline in (first, other))
    if max(_share_near(still, moving), _share_near(moving, still)) >= 0.5:
        return _placed(other, np.eye(4), "in the first run's world frame")
    found = align_global(
        moving.points, still.points, source_normals=moving.normals, target_normals=still.normals
    )
    if not found.found:
        return _placed(other, np.eye(4), "not moved: no one motion brings it onto the first run")
    motion = found.target_from_source
    angle = math.acos(min(1.0, max(-1.0, (float(np.trace(motion[:3, :3])) - 1) / 2)))
    middle = moving.points.mean(axis=0, dtype=np.float64)
    shift = float(np.linalg.norm(motion[:3, :3] @ middle + motion[:3, 3] - middle))
    words = f"moved by {quantity(shift, 'm')} and {quantity(angle, 'rad')} onto the first run"
    return _placed(other, motion, words)


def _share_near(cloud: Snapshot, other: Snapshot) -> float:
    """Return what part of the points lies on the surface of another model."""
    sample = cloud.thinned(_SAMPLES)
    return float(np.mean(deviation(sample, other) <= _TOLERANCE * max(cloud.spacing, other.spacing)))


def _placed(timeline: Timeline, motion: npt.NDArray[np.float64], words: str) -> Timeline:
    """Return a run in another world frame, and say how it came there."""
    moved = Timeline(
        timeline.title,
        timeline.camera,
        depth_of=timeline.depth_of,
        depth_range=timeline.depth_range,
        is_upright=timeline.is_upright,
        is_survey=timeline.is_survey,
    )
    moved.origin = timeline.origin
    moved.placement = words
    states = dict(timeline.snapshots)
    if -1 in states:
        moved.set_snapshot(_moved(states[-1], motion))
    for place, frame in enumerate(timeline.frames):
        poses = {"world_from_camera": frame.world_from_camera, "truth": frame.truth}
        known = {name: motion @ pose for name, pose in poses.items() if pose is not None}
        moved.add(ReportedFrame(**(frame.figures | known)))
        if place in states:
            moved.set_snapshot(_moved(states[place], motion))
    return moved


def _moved(cloud: Snapshot, motion: npt.NDArray[np.float64]) -> Snapshot:
    rotation = motion[:3, :3].T
    return replace(
        cloud,
        points=(cloud.points @ rotation + motion[:3, 3]).astype(np.float32),
        normals=(cloud.normals @ rotation).astype(np.float32),
        motion=None,  # what bends is compared in its canonical shape
    )
