"""How far a camera trajectory is from the truth (Sturm et al. 2012)."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from nacre._internal.arrays import as_count, as_length, as_number, as_poses, as_times, as_values
from nacre._internal.guided import guided
from nacre._internal.rotations import rotation_angles
from nacre.evaluation.result import Array, Count, Fraction, Metres, Radians, Result
from nacre.trajectory import associate

#: Poses; fewer are aligned with any others.
MIN_ALIGNED = 3


@dataclass(frozen=True, eq=False, repr=False)
class AbsoluteTrajectoryError(Result):
    """
    How far each estimated pose is from its true pose; made by :func:`absolute_trajectory_error`.

    The statistics and errors are NaN where no frame has both an estimate and a truth, and where fewer than
    three are aligned: any two positions fit any others of their distance, which says nothing.
    """

    rmse: Metres
    mean: Metres
    median: Metres
    max: Metres
    rotation_rmse: Radians
    rotation_mean: Radians
    rotation_median: Radians
    rotation_max: Radians
    num_frames: Count  #: all frames of the recording
    num_tracked: Count  #: frames with an estimated pose
    num_compared: Count  #: frames with an estimated and a true pose
    coverage: Fraction  #: num_tracked / num_frames
    truth_from_estimated: Array = field(repr=False)  #: the alignment (4, 4)
    errors: Array = field(repr=False)  #: one per row of the estimate, NaN where it was not compared
    rotation_errors: Array = field(repr=False)  #: likewise


@dataclass(frozen=True, eq=False, repr=False)
class RelativePoseError(Result):
    """How far the motion over a fixed interval is from the true motion; see :func:`relative_pose_error`."""

    translation_rmse: Metres
    translation_mean: Metres
    translation_max: Metres
    rotation_rmse: Radians
    rotation_mean: Radians
    rotation_max: Radians
    delta: float  #: the interval, in ``unit``
    unit: str  #: "frames" or "seconds"
    num_pairs: Count


@guided()
def absolute_trajectory_error(
    estimated: npt.ArrayLike,
    truth: npt.ArrayLike,
    *,
    align: bool | Literal["first"] = True,
    valid: npt.ArrayLike | None = None,
    timestamps: npt.ArrayLike | None = None,
    truth_timestamps: npt.ArrayLike | None = None,
    max_time_difference: float = 0.02,
    num_frames: int | None = None,
) -> AbsoluteTrajectoryError:
    """
    Measure the distance of an estimated trajectory from the true one (ATE, Sturm et al. 2012).

    Parameters
    ----------
    estimated : array_like, shape (N, 4, 4)
        ``world_from_camera`` poses [m]. A pose that is not finite is a frame that was not tracked.
    truth : array_like, shape (N, 4, 4), or (M, 4, 4) with time stamps
        True poses; one that is not finite is not known.
    align : bool or "first", optional
        True moves the estimate by the rigid transform that brings its positions closest to the true ones
        (Umeyama 1991, without scale); where the positions leave the rotation open (a straight line, a camera
        that stays in one place), the orientations decide. Errors of rotation are those that are left by the
        rotation that brings positions and orientations closest, each weighted by what they leave: a path that
        is too short for its errors says little of it. "first" moves the first compared pose onto its true
        pose. False compares the poses as they are.
    valid : array_like of bool, shape (N,), optional
        False where a pose of ``estimated`` is not to be counted as tracked.
    timestamps, truth_timestamps : array_like, shapes (N,) and (M,), optional
        Times of the poses [s]. Given both, poses are compared with the one nearest in time, otherwise row
        by row.
    max_time_difference : float, optional
        Poses farther apart in time are not compared [s].
    num_frames : int, optional
        How many frames the recording has, where ``estimated`` lists only the tracked ones. Default: N.

    Returns
    -------
    AbsoluteTrajectoryError

    Raises
    ------
    TypeError, ValueError
        When an argument has the wrong type, shape or value; the message names it.

    Examples
    --------
    >>> import numpy as np
    >>> truth = np.tile(np.eye(4), (4, 1, 1))
    >>> truth[:, 0, 3] = [0.0, 0.1, 0.2, 0.3]
    >>> estimated = truth.copy()
    >>> estimated[3] = np.nan
    >>> error = absolute_trajectory_error(estimated, truth)
    >>> round(error.rmse, 6), round(error.coverage, 3)
    (0.0, 0.75)
    """
    if not (isinstance(align, bool) or align == "first"):
        raise ValueError(f'align must be True, False or "first", got {align!r}')
    poses, tracked = _tracked(estimated, valid)
    true_poses = as_poses("truth", truth)
    rows, true_rows = _matching_rows(poses, true_poses, timestamps, truth_timestamps, max_time_difference)
    num_tracked = int(tracked.sum())
    total = len(poses) if num_frames is None else as_count("num_frames", num_frames)
    if total < num_tracked:
        raise ValueError(f"num_frames must be at least the {num_tracked} tracked frames, got {num_frames}")

    compared = tracked[rows] & np.isfinite(true_poses[true_rows]).all(axis=(1, 2))
    rows, true_rows = rows[compared], true_rows[compared]
    source, target = poses[rows], true_poses[true_rows]
    transform = np.eye(4)
    if len(rows) and align == "first":
        transform = target[0] @ _inverse(source[:1])[0]
    elif len(rows) and align is True:
        transform = _umeyama(source, target)
    moved = transform @ source
    turned = moved[:, :3, :3]
    if len(rows) and align is True:
        turned = _likeliest_rotation(source, target) @ source[:, :3, :3]

    errors = np.full(len(poses), np.nan)
    rotation_errors = np.full(len(poses), np.nan)
    if align is not True or len(rows) >= MIN_ALIGNED:
        errors[rows] = np.linalg.norm(moved[:, :3, 3] - target[:, :3, 3], axis=1)
        rotation_errors[rows] = rotation_angles(turned.transpose(0, 2, 1) @ target[:, :3, :3])
    return AbsoluteTrajectoryError(
        **_statistics("", errors, ("rmse", "mean", "median", "max")),
        **_statistics("rotation_", rotation_errors, ("rmse", "mean", "median", "max")),
        num_frames=total,
        num_tracked=num_tracked,
        num_compared=len(rows),
        coverage=num_tracked / total if total else np.nan,
        truth_from_estimated=transform,
        errors=errors,
        rotation_errors=rotation_errors,
    )


@guided()
def relative_pose_error(
    estimated: npt.ArrayLike,
    truth: npt.ArrayLike,
    *,
    delta: float = 1,
    unit: Literal["frames", "seconds"] = "frames",
    valid: npt.ArrayLike | None = None,
    timestamps: npt.ArrayLike | None = None,
    truth_timestamps: npt.ArrayLike | None = None,
    max_time_difference: float = 0.02,
) -> RelativePoseError:
    """
    Measure the drift: the error of the motion over a fixed interval (RPE, Sturm et al. 2012).

    Every pair of poses that lie ``delta`` apart counts. The result does not depend on the frames of reference
    of the two trajectories.

    Parameters
    ----------
    estimated, truth : array_like
        ``world_from_camera`` poses [m].
    delta : float, optional
        Length of the interval, in ``unit``.
    unit : {"frames", "seconds"}, optional
        "frames" counts rows of ``estimated``; "seconds" needs ``timestamps`` and takes the pose nearest to
        the end of the interval.
    valid, timestamps, truth_timestamps, max_time_difference
        As in :func:`absolute_trajectory_error`.

    Returns
    -------
    RelativePoseError
        NaN where no pair of poses lies ``delta`` apart.

    Raises
    ------
    TypeError, ValueError
        When an argument has the wrong type, shape or value; the message names it.
    """
    if unit not in ("frames", "seconds"):
        raise ValueError(f'unit must be "frames" or "seconds", got {unit!r}')
    step = as_number("delta", delta)
    if not (np.isfinite(step) and step > 0) or (unit == "frames" and step != int(step)):
        raise ValueError(f"delta must be a positive number (whole for frames), got {delta!r}")
    poses, tracked = _tracked(estimated, valid)
    true_poses = as_poses("truth", truth)
    rows, true_rows = _matching_rows(poses, true_poses, timestamps, truth_timestamps, max_time_difference)
    true_of = np.full(poses.shape, np.nan)
    true_of[rows] = true_poses[true_rows]
    usable = tracked & np.isfinite(true_of).all(axis=(1, 2))

    if unit == "frames":
        first = np.arange(max(len(poses) - int(step), 0))
        last = first + min(int(step), len(poses))
    else:
        if timestamps is None:
            raise ValueError('timestamps must be given where unit is "seconds"')
        times = _times("timestamps", timestamps, len(poses))
        first, last = associate(times + step, times, as_length("max_time_difference", max_time_difference))
    both = usable[first] & usable[last]
    first, last = first[both], last[both]

    motion = _inverse(poses[first]) @ poses[last]
    true_motion = _inverse(true_of[first]) @ true_of[last]
    error = _inverse(true_motion) @ motion  # Sturm 2012, eq. 1
    names = ("rmse", "mean", "max")
    return RelativePoseError(
        **_statistics("translation_", np.linalg.norm(error[:, :3, 3], axis=1), names),
        **_statistics("rotation_", rotation_angles(error[:, :3, :3]), names),
        delta=step,
        unit=unit,
        num_pairs=len(first),
    )


def _tracked(estimated: npt.ArrayLike, valid: npt.ArrayLike | None) -> tuple[Array, npt.NDArray[np.bool_]]:
    poses = as_poses("estimated", estimated)
    tracked = np.isfinite(poses).all(axis=(1, 2))
    if valid is not None:
        mask = as_values("valid", valid, len(poses), "pose")
        return poses, np.asarray(tracked & mask.astype(bool))
    return poses, np.asarray(tracked)


def _times(name: str, value: npt.ArrayLike, size: int | None = None) -> Array:
    times = as_times(name, value)
    if size is not None and len(times) != size:
        raise ValueError(f"{name} must have one entry per pose ({size}), got {len(times)}")
    return times


def _matching_rows(
    poses: Array,
    true_poses: Array,
    timestamps: npt.ArrayLike | None,
    truth_timestamps: npt.ArrayLike | None,
    max_time_difference: float,
) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]]:
    if timestamps is not None and truth_timestamps is not None:
        return associate(
            _times("timestamps", timestamps, len(poses)),
            _times("truth_timestamps", truth_timestamps, len(true_poses)),
            as_length("max_time_difference", max_time_difference),
        )
    if truth_timestamps is not None:
        raise ValueError("timestamps must be given where truth_timestamps are")
    if len(poses) != len(true_poses):
        raise ValueError(
            f"truth must have one pose per pose of estimated ({len(poses)}) or come with time stamps, "
            f"got {len(true_poses)} poses"
        )
    rows = np.arange(len(poses), dtype=np.intp)
    return rows, rows


def _umeyama(source: Array, target: Array) -> Array:
    """Return the rigid transform that brings the positions of ``source`` closest to those of ``target``."""
    source_mean, target_mean = source[:, :3, 3].mean(axis=0), target[:, :3, 3].mean(axis=0)
    centered, target_centered = source[:, :3, 3] - source_mean, target[:, :3, 3] - target_mean
    scale = np.sqrt((centered**2).sum() * (target_centered**2).sum()) or 1.0
    covariance = target_centered.T @ centered / scale  # Umeyama 1991, eq. 38
    transform = np.eye(4)
    transform[:3, :3] = _closest_rotation(covariance + 1e-9 * _orientations(source, target))
    transform[:3, 3] = target_mean - transform[:3, :3] @ source_mean  # eq. 41
    return transform


def _likeliest_rotation(source: Array, target: Array) -> Array:
    """Return the rotation that fits positions and orientations best, by the errors that each shows."""
    centered = source[:, :3, 3] - source[:, :3, 3].mean(axis=0)
    target_centered = target[:, :3, 3] - target[:, :3, 3].mean(axis=0)
    covariance = target_centered.T @ centered / len(source)
    left = centered @ _umeyama(source, target)[:3, :3].T - target_centered
    orientations = _orientations(source, target)
    turned = _closest_rotation(orientations) @ source[:, :3, :3]
    angles = rotation_angles(turned.transpose(0, 2, 1) @ target[:, :3, :3])
    exact = 1e-18  # [rad^2]: a variance that is not 0
    size = (centered**2).sum() / len(source) or 1.0
    of_positions = (left**2).sum() / len(source) / size + exact
    of_orientations = (angles**2).mean() + exact
    return _closest_rotation(covariance / size * of_orientations + orientations * of_positions)


def _orientations(source: Array, target: Array) -> Array:
    """Return the mean of the rotations from one pose's orientation to the other's."""
    mean: Array = np.einsum("nij,nkj->ik", target[:, :3, :3], source[:, :3, :3]) / len(source)
    return mean


def _closest_rotation(matrix: Array) -> Array:
    u, _, vt = np.linalg.svd(matrix)
    sign = np.array([1.0, 1.0, np.sign(np.linalg.det(u) * np.linalg.det(vt))])  # Umeyama 1991, eq. 39, 43
    rotation: Array = (u * sign) @ vt  # eq. 40
    return rotation


def _inverse(poses: Array) -> Array:
    inverse = np.zeros_like(poses)
    inverse[:, :3, :3] = poses[:, :3, :3].transpose(0, 2, 1)
    inverse[:, :3, 3] = -(inverse[:, :3, :3] @ poses[:, :3, 3, None])[:, :, 0]
    inverse[:, 3, 3] = 1
    return inverse


def _statistics(prefix: str, errors: Array, names: tuple[str, ...]) -> dict[str, Any]:
    """Return statistics of the errors that are known; NaN where none is."""
    errors = errors[np.isfinite(errors)]
    if not len(errors):
        return dict.fromkeys((prefix + name for name in names), np.nan)
    values = {
        "rmse": np.sqrt(np.mean(errors**2)),
        "mean": np.mean(errors),
        "median": np.median(errors),
        "max": np.max(errors),
    }
    return {prefix + name: float(values[name]) for name in names}
