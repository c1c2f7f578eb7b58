"""Steps of a trajectory that do not fit the recording's own motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from nacre._internal.rotations import rotation_angles
from nacre.report.limits import FLIP_ANGLE, MAX_POSE_ERROR, MAX_STEP_RATIO, MIN_STEPS, STEPS_AROUND
from nacre.run_data.reported_frame import ReportedFrame

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Jump:
    """A step between two successive frames that were registered in all directions, which is out of line."""

    first: int  #: index of the frame before
    last: int  #: and of the one after
    angle: float  #: the rotation between them [rad]
    distance: float  #: and the translation [m]
    ratio: float  #: of the step to the motion around it, per time

    @property
    def is_flip(self) -> bool:
        """Whether the camera turned to another side."""
        return self.angle > FLIP_ANGLE


def find_jumps(frames: Sequence[ReportedFrame], distance_seen: float = 0.0) -> list[Jump]:
    """
    Return the steps that are much larger than the recording's own motion, in the order of the frames.

    A step counts per time, or per frame where the recording has no time stamps, and is held against the
    median of the steps around it, and against the upper quartile of all: a camera may begin to move, and
    views in any order are all far apart. Only steps count that move what is seen by a notable part of its
    distance. A WEAK frame says itself that its pose is open in some directions: it is left out.

    Parameters
    ----------
    frames : sequence of ReportedFrame
        In the order in which they came.
    distance_seen : float
        Of the surfaces from the cameras [m].

    Returns
    -------
    list of Jump
    """
    known = [frame for frame in frames if frame.is_tracked and frame.status != "WEAK"]
    tracked = [frame for frame in known if frame.world_from_camera is not None]
    if len(tracked) <= MIN_STEPS:
        return []
    poses = np.array([frame.world_from_camera for frame in tracked], np.float64)
    rotations = poses[:, :3, :3]
    angles = rotation_angles(rotations[:-1].transpose(0, 2, 1) @ rotations[1:])
    distances = np.linalg.norm(np.diff(poses[:, :3, 3], axis=0), axis=1)
    durations = _durations(tracked)
    by_angle = np.where(angles > MAX_POSE_ERROR, _ratios(angles / durations), 0)
    by_distance = np.where(distances > MAX_POSE_ERROR * distance_seen, _ratios(distances / durations), 0)
    ratios = np.maximum(by_angle, by_distance)
    return [
        Jump(tracked[i].index, tracked[i + 1].index, float(angles[i]), float(distances[i]), float(ratios[i]))
        for i in np.flatnonzero(ratios > MAX_STEP_RATIO)
    ]


def _durations(frames: Sequence[ReportedFrame]) -> Array:
    """
    Return how long each step took: in seconds where all frames are timed in order, or in frames.

    Those that seem shorter than usual are as long as usual: clocks jitter.
    """
    times = np.array([np.nan if f.timestamp is None else f.timestamp for f in frames], np.float64)
    steps = np.diff(times)
    if not (steps > 0).all():
        steps = np.maximum(np.abs(np.diff([float(frame.index) for frame in frames])), 1)
    return np.maximum(steps, np.median(steps))


def _ratios(speeds: Array) -> Array:
    """Return how many times larger each speed is than those around it."""
    usual = float(np.quantile(speeds, 0.75))
    around = [
        np.median(
            np.concatenate([speeds[max(i - STEPS_AROUND, 0) : i], speeds[i + 1 : i + 1 + STEPS_AROUND]])
        )
        for i in range(len(speeds))
    ]
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.nan_to_num(speeds / np.maximum(usual, around), posinf=np.inf)
