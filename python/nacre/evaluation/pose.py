"""How far an object would be from its place, were the estimated poses believed."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
import numpy.typing as npt

from nacre._internal.arrays import as_poses, as_vector
from nacre._internal.guided import guided
from nacre.evaluation.result import Array, Count, Metres, Radians, Result
from nacre.evaluation.trajectory import absolute_trajectory_error


@dataclass(frozen=True, eq=False, repr=False)
class PoseError(Result):
    """
    Errors of poses at a point of the world; made by :func:`pose_error`.

    The statistics are NaN where no frame has both an estimate and a truth.
    """

    translation_rmse: Metres
    translation_max: Metres
    translation_final: Metres  #: of the last frame that was compared
    rotation_rmse: Radians
    rotation_max: Radians
    rotation_final: Radians
    num_compared: Count  #: frames with an estimated and a true pose
    translation_errors: Array = field(repr=False)  #: one per frame [m], NaN where it was not compared
    rotation_errors: Array = field(repr=False)  #: one per frame [rad], likewise


@guided()
def pose_error(
    estimated: npt.ArrayLike,
    truth: npt.ArrayLike,
    *,
    center: npt.ArrayLike = (0.0, 0.0, 0.0),
    align: Literal["first", False] = "first",
) -> PoseError:
    """
    Measure the errors of poses where they matter: at the object, not at the camera.

    The estimate W of a frame with the true pose T takes what the camera sees from its place by the motion
    W T^-1. Its rotation and the shift of ``center`` under it are the errors of the frame. Where the camera is
    far from what it looks at, the two are independent, while the camera's own shift contains its rotation.

    Parameters
    ----------
    estimated, truth : array_like, shape (N, 4, 4)
        ``world_from_camera`` poses [m]; one that is not finite is not known.
    center : array_like, shape (3,), optional
        A point in the frame of ``truth``, the middle of the object [m].
    align : "first" or False, optional
        "first" moves the estimate so that the first compared frame is without error; False compares as they
        are.

    Returns
    -------
    PoseError

    Raises
    ------
    TypeError, ValueError
        When an argument has the wrong type, shape or value; the message names it.
    """
    poses, true_poses = as_poses("estimated", estimated), as_poses("truth", truth)
    middle = as_vector("center", center, 3)
    if align not in ("first", False):
        raise ValueError(f'align must be "first" or False, got {align!r}')
    if len(poses) != len(true_poses):
        raise ValueError(
            f"truth must have one pose per pose of estimated ({len(poses)}), got {len(true_poses)}"
        )
    to_center = np.tile(np.eye(4), (len(poses), 1, 1))
    offsets = middle - true_poses[:, :3, 3]
    to_center[:, :3, 3] = np.einsum("nji,nj->ni", true_poses[:, :3, :3], offsets)  # in the camera's frame
    error = absolute_trajectory_error(poses @ to_center, true_poses @ to_center, align=align)
    compared = np.flatnonzero(np.isfinite(error.errors))
    last = compared[-1] if len(compared) else None
    return PoseError(
        translation_rmse=error.rmse,
        translation_max=error.max,
        translation_final=np.nan if last is None else float(error.errors[last]),
        rotation_rmse=error.rotation_rmse,
        rotation_max=error.rotation_max,
        rotation_final=np.nan if last is None else float(error.rotation_errors[last]),
        num_compared=len(compared),
        translation_errors=error.errors,
        rotation_errors=error.rotation_errors,
    )
