"""Trajectories as files: TUM, Redwood, KITTI and 7-Scenes."""

from __future__ import annotations

import math
import os
from array import array
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Literal

import numpy as np
import numpy.typing as npt

from nacre._internal.arrays import FARTHEST
from nacre._internal.guided import guided
from nacre._internal.quaternions import matrix_from_quaternion, quaternion_from_matrix
from nacre.errors import FileFormatError
from nacre.io.atomic import atomic_writer
from nacre.io.raw import excerpt, number_of, read_file, require_path, text_of
from nacre.trajectory import Trajectory

Float64 = npt.NDArray[np.float64]
TrajectoryFormat = Literal["tum", "redwood", "kitti"]

_LONGEST_LINE = 4096
_POSES_PER_BLOCK = 1024  # for the sake of memory


@dataclass(frozen=True)
class _Block:
    """Some consecutive poses of a file."""

    path: str | os.PathLike[str]
    numbers: Float64
    """(N, K): all numbers of each pose."""
    lines: npt.NDArray[np.int64]
    """(N, L): where they stand."""
    first: int
    """How many poses come before."""

    def error(self, pose: int, reason: str, line: int = 0) -> FileFormatError:
        """Return the error for a line of a pose."""
        return FileFormatError(self.path, reason, line=int(self.lines[pose, line]))


@dataclass(frozen=True)
class _Format:
    """How many numbers the lines of a pose have, and what makes times and poses of them."""

    widths: tuple[int, ...]
    parse: Callable[[_Block], tuple[Float64, Float64]]


@guided()
def read_trajectory(path: str | os.PathLike[str]) -> Trajectory:
    """
    Read a trajectory; the format is recognised from the content.

    - TUM: lines of ``t tx ty tz qx qy qz qw``;
    - Redwood ``.log``: blocks of three whole numbers, the first one the frame's index, and a 4x4 matrix;
    - KITTI: lines of 12 numbers, the first three rows of the matrix; the times are 0, 1, 2, ...;
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
    blocks = [_near(block, *format_.parse(block)) for format_, block in _blocks(path, read_file(path))]
    if not blocks:
        raise FileFormatError(path, "the trajectory is empty")
    timestamps, poses = (np.concatenate(parts) for parts in zip(*blocks, strict=True))
    timestamps.flags.writeable = poses.flags.writeable = False  # a Trajectory need not copy them
    return Trajectory(timestamps, poses)


@guided()
def write_trajectory(
    path: str | os.PathLike[str],
    timestamps: npt.ArrayLike | Trajectory,
    poses: npt.ArrayLike | None = None,
    *,
    format: TrajectoryFormat | None = None,
) -> None:
    """
    Write a trajectory, atomically and with all digits.

    Parameters
    ----------
    path : path-like
        The file to write.
    timestamps : (N,) array, or Trajectory
        Seconds, or the frames' indices.
    poses : (N, 4, 4) array
        ``world_from_camera``, at least one; not with a Trajectory, which has its own.
    format : {"tum", "redwood", "kitti"}, optional
        - ``"tum"``: ``t tx ty tz qx qy qz qw``;
        - ``"redwood"``: three whole numbers and a 4x4 matrix; times that are fractions become 0, 1, 2, ...;
        - ``"kitti"``: the first three rows of the matrix; without times.

        None takes Redwood for files that end in ``.log``, else TUM.

    Raises
    ------
    TypeError, ValueError
        When an argument does not fit; the message names it.
    OSError
        When the file cannot be written.
    """
    require_path(path, "write_trajectory(path, trajectory)")
    ending = "redwood" if Path(path).suffix.lower() == ".log" else "tum"
    name = ending if format is None else format
    if name not in _WRITERS:
        raise ValueError(f"format must be one of {', '.join(_WRITERS)}, got {format!r}")
    if isinstance(timestamps, Trajectory):
        if poses is not None:
            raise ValueError("poses must not be given with a Trajectory, which has its own; got both")
    elif poses is None:
        got = type(timestamps).__name__
        way = "its .trajectory" if hasattr(timestamps, "trajectory") else "the times first, then the poses"
        raise TypeError(f"poses must be given, or timestamps be a nacre.Trajectory, got {got}; give {way}")
    else:
        timestamps = Trajectory(timestamps, poses)  # type: ignore[arg-type]
    trajectory = timestamps
    if not len(trajectory):
        raise ValueError(
            "poses must be at least one, got none: a file of none cannot be told from a broken one"
        )
    if not np.isfinite(trajectory.poses).all():
        raise ValueError("poses must be finite, got NaN or infinity")
    farthest = np.abs(trajectory.poses[:, :3, 3]).max(initial=0.0)
    if farthest > FARTHEST:
        raise ValueError(f"poses must lie at most {FARTHEST:g} m away, got {farthest:g}")
    largest = np.abs(trajectory.poses[:, :3, :3]).max(initial=0.0)
    if largest > 2:
        raise ValueError(f"poses must be rigid, got a rotation matrix with an entry of {largest:g}")
    with atomic_writer(path) as stream:
        stream.writelines(line.encode() for line in _WRITERS[name](trajectory))


def _tum_lines(trajectory: Trajectory) -> Iterator[str]:
    yield "# timestamp tx ty tz qx qy qz qw\n"
    quaternions = quaternion_from_matrix(trajectory.poses[:, :3, :3])
    for row in np.column_stack([trajectory.timestamps, trajectory.poses[:, :3, 3], quaternions]):
        yield _line(row)


def _redwood_lines(trajectory: Trajectory) -> Iterator[str]:
    times = trajectory.timestamps
    has_indices = (times == np.floor(times)).all()
    for i, pose in enumerate(trajectory.poses):
        index = int(times[i]) if has_indices else i
        yield f"{index} {index} {index + 1}\n"
        yield from map(_line, pose)


def _kitti_lines(trajectory: Trajectory) -> Iterator[str]:
    yield from map(_line, trajectory.poses[:, :3].reshape(-1, 12))


_WRITERS = {"tum": _tum_lines, "redwood": _redwood_lines, "kitti": _kitti_lines}

WRITE_FORMATS = tuple(_WRITERS)


def _rows(path: str | os.PathLike[str], data: bytes) -> Iterator[tuple[int, list[float]]]:
    """Yield the lines that hold numbers, with their place."""
    for line, content in enumerate(BytesIO(data), start=1):
        told = content.partition(b"#")[0]
        if len(told) > _LONGEST_LINE:
            raise FileFormatError(path, f"not a trajectory: a line of {len(told)} bytes", line=line)
        try:
            values = [number_of(word.decode("ascii")) for word in told.split()]
        except ValueError:
            text_of(path, content)
            reason = f"expected numbers, got {excerpt(content.strip())}"
            raise FileFormatError(path, reason, line=line) from None
        if not all(map(math.isfinite, values)):
            reason = f"expected finite numbers, got {excerpt(content.strip())}"
            raise FileFormatError(path, reason, line=line)
        if values:
            yield line, values


def _blocks(path: str | os.PathLike[str], data: bytes) -> Iterator[tuple[_Format, _Block]]:
    """Yield a file's poses, and the format that its first line is of."""
    numbers, lines = array("d"), array("q")
    format_ = None
    first = 0

    def block(format_: _Format) -> _Block:
        return _Block(
            path,
            np.array(numbers).reshape(-1, sum(format_.widths)),
            np.array(lines).reshape(-1, len(format_.widths)),
            first,
        )

    for line, values in _rows(path, data):
        if format_ is None:
            if len(values) not in _FORMATS:
                raise _unknown(path, line, len(values))
            format_ = _FORMATS[len(values)]
        width = format_.widths[len(lines) % len(format_.widths)]
        if len(values) != width:
            raise FileFormatError(path, f"expected {_EXPECTED[width]}, got {len(values)}", line=line)
        numbers.extend(values)
        lines.append(line)
        if len(lines) == _POSES_PER_BLOCK * len(format_.widths):
            yield format_, block(format_)
            first += _POSES_PER_BLOCK
            del numbers[:], lines[:]
    if format_ is None or not lines:
        return
    if len(lines) % len(format_.widths):
        if format_ is _FORMATS[4]:
            raise _unknown(path, lines[0], 4)
        raise FileFormatError(path, "the last 4x4 matrix is cut off", line=lines[-1])
    yield format_, block(format_)


def _parse_tum(block: _Block) -> tuple[Float64, Float64]:
    zero = np.flatnonzero((block.numbers[:, 4:] == 0).all(axis=1))
    if len(zero):
        raise block.error(int(zero[0]), "the quaternion is 0")
    poses = np.tile(np.eye(4), (len(block.numbers), 1, 1))
    poses[:, :3, :3] = matrix_from_quaternion(block.numbers[:, 4:])
    poses[:, :3, 3] = block.numbers[:, 1:4]
    return block.numbers[:, 0].copy(), poses


def _parse_redwood(block: _Block) -> tuple[Float64, Float64]:
    broken = np.flatnonzero(block.numbers[:, 0] != np.floor(block.numbers[:, 0]))
    if len(broken):
        first = block.numbers[broken[0], 0]
        reason = f"expected three whole numbers before a matrix, got {first:g} first"
        raise block.error(int(broken[0]), reason)
    return block.numbers[:, 0].copy(), _exact(block, block.numbers[:, 3:].reshape(-1, 4, 4), 1)


def _parse_kitti(block: _Block) -> tuple[Float64, Float64]:
    poses = np.tile(np.eye(4), (len(block.numbers), 1, 1))
    poses[:, :3] = block.numbers.reshape(-1, 3, 4)
    return block.first + np.arange(len(poses), dtype=np.float64), _exact(block, poses, 0)


def _parse_seven_scenes(block: _Block) -> tuple[Float64, Float64]:
    if len(block.numbers) != 1:
        raise _unknown(block.path, int(block.lines[0, 0]), 4)
    return np.zeros(1), _exact(block, block.numbers.reshape(1, 4, 4), 0)


_EXPECTED = {
    8: "8 numbers (t tx ty tz qx qy qz qw)",
    4: "4 numbers of a 4x4 matrix",
    3: "3 numbers before a matrix",
    12: "12 numbers of a 3x4 matrix",
}
_FORMATS = {
    8: _Format((8,), _parse_tum),
    12: _Format((12,), _parse_kitti),
    4: _Format((4, 4, 4, 4), _parse_seven_scenes),
    3: _Format((3, 4, 4, 4, 4), _parse_redwood),
}


def _unknown(path: str | os.PathLike[str], line: int, width: int) -> FileFormatError:
    reason = (
        "expected lines of 8 numbers (TUM) or 12 (KITTI), blocks of 3 numbers and a 4x4 matrix (Redwood), or "
        f"a 4x4 matrix (7-Scenes), got {width} numbers"
    )
    return FileFormatError(path, reason, line=line)


def _near(block: _Block, times: Float64, poses: Float64) -> tuple[Float64, Float64]:
    """Return times and poses as they are, if no position is too far to be computed with."""
    far = np.flatnonzero((np.abs(poses[:, :3, 3]) > FARTHEST).any(axis=1))
    if len(far):
        raise block.error(int(far[0]), f"the position is more than {FARTHEST:g} m away")
    return times, poses


def _exact(block: _Block, poses: Float64, line: int) -> Float64:
    """Return poses with exact rotations; their matrices begin at this line of each."""
    is_far = np.abs(poses[:, :3, :3]).max(axis=(1, 2)) > 2  # also what has no finite singular values
    u, stretch, vt = np.linalg.svd(np.where(is_far[:, None, None], np.eye(3), poses[:, :3, :3]))
    wrong = is_far | (np.abs(stretch - 1).max(axis=1) > 0.01) | (np.linalg.det(u @ vt) < 0)
    wrong |= ~np.isclose(poses[:, 3], (0, 0, 0, 1)).all(axis=1)
    if wrong.any():
        raise block.error(
            int(np.flatnonzero(wrong)[0]), "the matrix is not a rotation and a translation", line
        )
    exact = poses.copy()
    exact[:, :3, :3] = u @ vt
    return exact


def _line(values: Float64) -> str:
    return " ".join(repr(value).removesuffix(".0") for value in values.tolist()) + "\n"
