"""Poses over time, and what belongs together in time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from nacre._internal.arrays import as_length, as_real, as_times
from nacre._internal.guided import guided
from nacre._internal.quaternions import matrix_from_quaternion, quaternion_from_matrix
from nacre._internal.value_equality import Value

Float64 = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False, repr=False)
class Trajectory(Value):
    """
    Poses over time.

    Attributes
    ----------
    timestamps : (N,) float64
        Seconds; the frame's index where the recording has no time stamps.
    poses : (N, 4, 4) float64
        ``world_from_camera`` of each time, OpenCV axes (x right, y down, z forward) [m].
    """

    timestamps: Float64
    poses: Float64

    def __post_init__(self) -> None:
        timestamps = _frozen(as_times("timestamps", self.timestamps))
        poses = _frozen(as_real("poses", self.poses))
        if poses.shape != (len(timestamps), 4, 4):
            raise ValueError(f"poses must have shape ({len(timestamps)}, 4, 4), got {poses.shape}")
        object.__setattr__(self, "timestamps", timestamps)
        object.__setattr__(self, "poses", poses)

    def __len__(self) -> int:
        return len(self.timestamps)

    def __repr__(self) -> str:
        span = f", {self.timestamps.min():.12g} to {self.timestamps.max():.12g}" if len(self) else ""
        return f"Trajectory({len(self)} poses{span})"

    def at(self, timestamps: npt.ArrayLike, max_difference: float = 0.02) -> Float64:
        """
        Return the poses at the given times.

        Between two poses that are both within ``max_difference`` the pose is interpolated (slerp, linear
        position); otherwise the nearest pose within ``max_difference`` is taken.

        Parameters
        ----------
        timestamps : (M,) array
            Times [s].
        max_difference : float
            How far in time a pose may be from the time it stands for [s].

        Returns
        -------
        (M, 4, 4) float64
            ``world_from_camera``; NaN where no pose is near enough.
        """
        wanted, max_difference = (
            as_times("timestamps", timestamps),
            as_length("max_difference", max_difference),
        )
        result = np.full((len(wanted), 4, 4), np.nan)
        if not len(self):
            return result
        order = np.argsort(self.timestamps, kind="stable")
        times, poses = self.timestamps[order], self.poses[order]
        after = np.clip(np.searchsorted(times, wanted), 0, len(times) - 1)
        before = np.where(times[after] > wanted, np.maximum(after - 1, 0), after)
        to_before, to_after = np.abs(wanted - times[before]), np.abs(times[after] - wanted)

        nearest = np.where(to_before <= to_after, before, after)
        near = np.minimum(to_before, to_after) <= max_difference
        result[near] = poses[nearest[near]]

        between = (np.maximum(to_before, to_after) <= max_difference) & (before != after)
        first, second = before[between], after[between]
        fraction = (wanted[between] - times[first]) / (times[second] - times[first])
        result[between] = _interpolate(poses[first], poses[second], fraction)
        return result


def _frozen(values: npt.ArrayLike) -> Float64:
    """Return values that nobody can change: themselves where they are so already, else a copy."""
    is_array = isinstance(values, np.ndarray) and values.dtype == np.float64
    if is_array and values.base is None and not values.flags.writeable:  # type: ignore[union-attr]
        return values  # type: ignore[return-value]
    copy = np.array(values, dtype=np.float64)
    copy.flags.writeable = False
    return copy


@guided()
def associate(
    timestamps_a: npt.ArrayLike, timestamps_b: npt.ArrayLike, max_difference: float = 0.02
) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]]:
    """
    Pair two lists of times, nearest pairs first, each time in one pair at most.

    Parameters
    ----------
    timestamps_a, timestamps_b : (N,), (M,) arrays
        Times [s], in any order.
    max_difference : float
        The largest difference within a pair [s].

    Returns
    -------
    indices_a, indices_b : (K,) arrays
        The pairs, ordered by ``indices_a``.
    """
    a, b = as_times("timestamps_a", timestamps_a), as_times("timestamps_b", timestamps_b)
    max_difference = as_length("max_difference", max_difference)
    order = np.argsort(b, kind="stable")
    sorted_b = b[order]
    first = np.searchsorted(sorted_b, a - max_difference, side="left")
    last = np.searchsorted(sorted_b, a + max_difference, side="right")
    counts = np.maximum(last - first, 0)
    from_a = np.repeat(np.arange(len(a)), counts)
    starts = np.repeat(np.cumsum(counts) - counts, counts)
    from_b = order[np.repeat(first, counts) + np.arange(len(from_a)) - starts]
    partner: dict[int, int] = {}
    taken: set[int] = set()
    for k in np.lexsort((from_b, from_a, np.abs(a[from_a] - b[from_b]))):
        i, j = int(from_a[k]), int(from_b[k])
        if i not in partner and j not in taken:
            partner[i] = j
            taken.add(j)
    pairs = sorted(partner.items())
    return np.array([i for i, _ in pairs], dtype=np.intp), np.array([j for _, j in pairs], dtype=np.intp)


def _interpolate(first: Float64, second: Float64, fraction: Float64) -> Float64:
    q0, q1 = quaternion_from_matrix(first[:, :3, :3]), quaternion_from_matrix(second[:, :3, :3])
    dot = (q0 * q1).sum(axis=1, keepdims=True)
    q1 = np.where(dot < 0, -q1, q1)
    # arctan2 of difference and sum keeps its digits for nearly equal rotations, where arccos does not.
    half = np.arctan2(np.linalg.norm(q1 - q0, axis=1), np.linalg.norm(q1 + q0, axis=1))
    angle = 2 * half
    moving = angle > 1e-9
    safe = np.where(moving, np.sin(angle), 1.0)
    weight0 = np.where(moving, np.sin((1 - fraction) * angle) / safe, 1 - fraction)
    weight1 = np.where(moving, np.sin(fraction * angle) / safe, fraction)
    poses = first.copy()
    poses[:, :3, :3] = matrix_from_quaternion(weight0[:, None] * q0 + weight1[:, None] * q1)
    poses[:, :3, 3] += fraction[:, None] * (second[:, :3, 3] - first[:, :3, 3])
    return poses
