"""Whether the cameras of a run, one after the other, make a path."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from nacre.run_data.reported_frame import ReportedFrame


def make_path(frames: Sequence[ReportedFrame]) -> bool:
    """
    Return whether lines from each camera to the next show how the camera moved.

    So they do where steps are short against the distance between any two cameras, by half in the mean square.
    Of views in no order both are the same (von Neumann 1941). Where the shape moves, poses are relative to
    it, and no path of a camera.
    """
    centers = np.array([f.world_from_camera[:3, 3] for f in frames if f.world_from_camera is not None])
    if len(centers) < 2 or any(frame.is_tracked and frame.may_be_bent for frame in frames):
        return False
    steps = (np.diff(centers, axis=0) ** 2).sum(axis=1).mean()
    between_any_two = 2 * centers.var(axis=0, ddof=1).sum()
    return bool(steps < 0.5 * between_any_two)
