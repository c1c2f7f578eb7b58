"""Camera trajectories, in and out, and what belongs together in time."""

from __future__ import annotations

import math
import os
from array import array
from dataclasses import dataclass
from io import BytesIO

import numpy as np
import numpy.typing as npt

from nacre.arrays import as_length, as_real, as_times
from nacre.errors import FileFormatError
from nacre.io.atomic import atomic_writer
from nacre.io.raw import excerpt, number_of, read_file, text_of
from nacre.values import Value

Float64 = npt.NDArray[np.float64]

_LONGEST_LINE = 4096
_ROWS_PER_BLOCK = 1024


@dataclass(frozen=True)
class Rows:
    """The lines of a text that hold numbers: the lines' numbers, where their values end, and all values."""

    path: str | os.PathLike[str]
    lines: npt.NDArray[np.int64]
    ends: npt.NDArray[np.int64]
    numbers: Float64

    def __len__(self) -> int:
        return len(self.lines)

    @property
    def widths(self) -> npt.NDArray[np.int64]:
        """How many values each line has."""
        return np.diff(self.ends, prepend=0)

    def error(self, row: int, reason: str) -> FileFormatError:
        """Return the error for a row."""
        return FileFormatError(self.path, reason, line=int(self.lines[row]))

    def require_width(self, width: int, what: str) -> None:
        """Raise where a row has not so many values."""
        wrong = np.flatnonzero(self.widths != width)
        if len(wrong):
            raise self.error(int(wrong[0]), f"expected {what}, got {self.widths[wrong[0]]}")


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


def matrix_from_quaternion(quaternions: npt.ArrayLike) -> Float64:
    """
    Convert quaternions x y z w (N, 4), of any length but 0, to rotations (N, 3, 3); (4,) gives (3, 3).

    Raises
    ------
    ValueError
        A quaternion is 0 or not finite.
    """
    q = np.asarray(quaternions, dtype=np.float64)
    if q.ndim not in (1, 2) or q.shape[-1] != 4:
        raise ValueError(f"quaternions must have shape (N, 4) or (4,), got {q.shape}")
    scale = np.abs(q).max(axis=-1, keepdims=True)
    if not np.isfinite(scale).all() or (scale == 0).any():
        raise ValueError("quaternions must be finite and not 0")
    q = q / scale
    x, y, z, w = np.moveaxis(q / np.linalg.norm(q, axis=-1, keepdims=True), -1, 0)
    rows = (
        (1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)),
        (2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)),
        (2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)),
    )
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def quaternion_from_matrix(rotations: npt.ArrayLike) -> Float64:
    """
    Convert rotation matrices (N, 3, 3) to unit quaternions x y z w (N, 4) with w >= 0; one (3, 3) gives (4,).

    Of the four equivalent formulas the one with the largest divisor is used for each matrix (Shepperd 1978).
    """
    r = np.asarray(rotations, dtype=np.float64)
    if r.ndim not in (2, 3) or r.shape[-2:] != (3, 3):
        raise ValueError(f"rotations must have shape (N, 3, 3) or (3, 3), got {r.shape}")
    m = r.reshape(-1, 3, 3)
    xx, yy, zz = m[:, 0, 0], m[:, 1, 1], m[:, 2, 2]
    sums = {(0, 1): m[:, 0, 1] + m[:, 1, 0], (0, 2): m[:, 0, 2] + m[:, 2, 0], (1, 2): m[:, 1, 2] + m[:, 2, 1]}
    turns = (m[:, 2, 1] - m[:, 1, 2], m[:, 0, 2] - m[:, 2, 0], m[:, 1, 0] - m[:, 0, 1])
    # Row k is 4 q_k q, so its k-th entry is 4 q_k^2.
    products = np.stack(
        [
            np.stack([1 + xx - yy - zz, sums[0, 1], sums[0, 2], turns[0]], axis=-1),
            np.stack([sums[0, 1], 1 - xx + yy - zz, sums[1, 2], turns[1]], axis=-1),
            np.stack([sums[0, 2], sums[1, 2], 1 - xx - yy + zz, turns[2]], axis=-1),
            np.stack([turns[0], turns[1], turns[2], 1 + xx + yy + zz], axis=-1),
        ],
        axis=1,
    )
    best = np.argmax(np.diagonal(products, axis1=1, axis2=2), axis=1)
    q = products[np.arange(len(m)), best]
    q = q / np.linalg.norm(q, axis=-1, keepdims=True)
    result: Float64 = np.where(q[:, 3:] < 0, -q, q).reshape(*r.shape[:-2], 4)
    return result


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


def read_trajectory(path: str | os.PathLike[str]) -> Trajectory:
    """
    Read a trajectory; the format is recognised from the content.

    - TUM: lines of ``t tx ty tz qx qy qz qw``;
    - Redwood ``.log``: blocks of three whole numbers, the first one the frame's index, and a 4x4 matrix;
    - 7-Scenes ``.pose.txt``: one 4x4 matrix, its time is 0.

    Lines that start with ``#`` are comments. Matrices are camera to world; their rotations are made exact.

    Parameters
    ----------
    path : path-like
        The file to read.

    Returns
    -------
    Trajectory

    Raises
    ------
    FileFormatError
        Names the file and the line.
    """
    rows = _read_rows(path)
    if not len(rows):
        raise FileFormatError(path, "the trajectory is empty")
    width = int(rows.widths[0])
    if width == 8:
        return _parse_tum(rows)
    if width == 3:
        return _parse_log(rows)
    if width == 4 and len(rows) == 4:
        rows.require_width(4, "4 numbers of a 4x4 matrix")
        return Trajectory(np.zeros(1), _exact(rows, rows.numbers.reshape(1, 4, 4), 0, 4))
    raise rows.error(
        0,
        "expected lines of 8 numbers (TUM), blocks of 3 numbers and a 4x4 matrix (Redwood), or a 4x4 matrix "
        f"(7-Scenes), got {width} numbers",
    )


def write_trajectory(path: str | os.PathLike[str], timestamps: npt.ArrayLike, poses: npt.ArrayLike) -> None:
    """
    Write a trajectory in TUM format (``t tx ty tz qx qy qz qw``), atomically and with all digits.

    Parameters
    ----------
    path : path-like
        The file to write.
    timestamps : (N,) array
        Seconds, or the frames' indices.
    poses : (N, 4, 4) array
        ``world_from_camera``.
    """
    trajectory = Trajectory(timestamps, poses)  # type: ignore[arg-type]
    if not np.isfinite(trajectory.poses).all():
        raise ValueError("poses must be finite, got NaN or infinity")
    largest = np.abs(trajectory.poses[:, :3, :3]).max(initial=0.0)
    if largest > 2:
        raise ValueError(f"poses must be rigid, got a rotation matrix with an entry of {largest:g}")
    rows = np.column_stack(
        [
            trajectory.timestamps,
            trajectory.poses[:, :3, 3],
            quaternion_from_matrix(trajectory.poses[:, :3, :3]),
        ]
    )
    with atomic_writer(path) as stream:
        stream.write(b"# timestamp tx ty tz qx qy qz qw\n")
        for row in rows:
            stream.write((" ".join(_shortest(value) for value in row) + "\n").encode())


def _read_rows(path: str | os.PathLike[str]) -> Rows:
    """Return the lines that hold numbers."""
    lines, ends, numbers = array("q"), array("q"), array("d")
    for line, content in enumerate(BytesIO(read_file(path)), start=1):
        told = content.partition(b"#")[0]
        if len(told) > _LONGEST_LINE:
            raise FileFormatError(path, f"not a trajectory: a line of {len(told)} bytes", line=line)
        words = told.split()
        if not words:
            continue
        try:
            numbers.extend(number_of(word.decode("ascii")) for word in words)
        except ValueError:
            text_of(path, content)
            reason = f"expected numbers, got {excerpt(content.strip())}"
            raise FileFormatError(path, reason, line=line) from None
        if not all(map(math.isfinite, numbers[-len(words) :])):
            reason = f"expected finite numbers, got {excerpt(content.strip())}"
            raise FileFormatError(path, reason, line=line)
        lines.append(line)
        ends.append(len(numbers))
    return Rows(path, np.frombuffer(lines, np.int64), np.frombuffer(ends, np.int64), np.frombuffer(numbers))


def _shortest(value: float) -> str:
    return repr(float(value)).removesuffix(".0")


def _parse_tum(rows: Rows) -> Trajectory:
    rows.require_width(8, "8 numbers (t tx ty tz qx qy qz qw)")
    table = rows.numbers.reshape(-1, 8)
    zero = np.flatnonzero((table[:, 4:] == 0).all(axis=1))
    if len(zero):
        raise rows.error(int(zero[0]), "the quaternion is 0")
    poses = np.zeros((len(table), 4, 4))
    for start in range(0, len(table), _ROWS_PER_BLOCK):  # a few rows at a time, for the sake of memory
        block = slice(start, start + _ROWS_PER_BLOCK)
        poses[block, :3, :3] = matrix_from_quaternion(table[block, 4:])
    poses[:, :3, 3] = table[:, 1:4]
    poses[:, 3, 3] = 1
    poses.flags.writeable = False
    return Trajectory(table[:, 0], poses)


def _parse_log(rows: Rows) -> Trajectory:
    is_header = np.arange(len(rows)) % 5 == 0
    wrong = np.flatnonzero(rows.widths != np.where(is_header, 3, 4))
    if len(wrong):
        what = "3 numbers before a matrix" if is_header[wrong[0]] else "4 numbers of a 4x4 matrix"
        raise rows.error(int(wrong[0]), f"expected {what}, got {rows.widths[wrong[0]]}")
    if len(rows) % 5:
        raise FileFormatError(rows.path, "the last 4x4 matrix is cut off", line=int(rows.lines[-1]))
    table = rows.numbers.reshape(-1, 19)
    broken = np.flatnonzero(table[:, 0] != np.floor(table[:, 0]))
    if len(broken):
        reason = f"expected three whole numbers before a matrix, got {table[broken[0], 0]:g} first"
        raise rows.error(5 * int(broken[0]), reason)
    poses = np.empty((len(table), 4, 4))
    for start in range(0, len(table), _ROWS_PER_BLOCK):
        block = slice(start, start + _ROWS_PER_BLOCK)
        poses[block] = _exact(rows, table[block, 3:].reshape(-1, 4, 4), 5 * start + 1, 5)
    poses.flags.writeable = False
    return Trajectory(table[:, 0], poses)


def _exact(rows: Rows, poses: Float64, first: int, step: int) -> Float64:
    """Return poses with exact rotations; pose i stands from row ``first + step * i`` on."""
    is_far = np.abs(poses[:, :3, :3]).max(axis=(1, 2)) > 2  # also what has no finite singular values
    u, stretch, vt = np.linalg.svd(np.where(is_far[:, None, None], np.eye(3), poses[:, :3, :3]))
    wrong = is_far | (np.abs(stretch - 1).max(axis=1) > 0.01) | (np.linalg.det(u @ vt) < 0)
    wrong |= ~np.isclose(poses[:, 3], (0, 0, 0, 1)).all(axis=1)
    if wrong.any():
        row = first + step * int(np.flatnonzero(wrong)[0])
        raise rows.error(row, "the 4x4 matrix is not a rotation and a translation")
    exact = poses.copy()
    exact[:, :3, :3] = u @ vt
    return exact


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
