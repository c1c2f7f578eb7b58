"""Rotation matrices."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt


def rotation_angles(rotations: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Return the angle of each rotation (N, 3, 3) [rad]; exact for small ones too, unlike the arc cosine."""
    axis = np.stack(
        [
            rotations[:, 2, 1] - rotations[:, 1, 2],
            rotations[:, 0, 2] - rotations[:, 2, 0],
            rotations[:, 1, 0] - rotations[:, 0, 1],
        ],
        axis=1,
    )
    trace = np.trace(rotations, axis1=1, axis2=2)
    return np.asarray(np.arctan2(np.linalg.norm(axis, axis=1), trace - 1))
