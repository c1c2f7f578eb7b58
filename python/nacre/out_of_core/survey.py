"""A first look at a cloud that is larger than memory: its extent, its density, and what its points have."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre._internal.cubes import Hashes, point_hashes
from nacre.errors import FileFormatError
from nacre.io.cloud import Cloud
from nacre.io.las import is_las, silent_among
from nacre.io.points import SUFFIXES, is_streamed, read_chunks, require_point_suffix, widen
from nacre.kdtree import KdTree
from nacre.out_of_core.rows import Rows, finite_among, row_type, to_cloud, to_rows

PathLike = str | os.PathLike[str]

_SAMPLE_SIZE = 100_000
_NEIGHBORS = 17  # itself included
_BYTES_PER_BYTE = 8  # of memory, where a file has to be read whole


@dataclass(frozen=True)
class Source:
    """Point files that are one cloud, read in pieces."""

    paths: tuple[Path, ...]

    @classmethod
    def of(cls, source: PathLike | Iterable[PathLike]) -> Source:
        """Return the files that are meant: one, those of a folder, or several; raise where there are none."""
        if isinstance(source, str | os.PathLike):
            path = Path(source)
            if not path.is_dir():
                require_point_suffix(path)
                return cls((path,))
            found = sorted(p for p in path.iterdir() if p.suffix.lower() in SUFFIXES and p.is_file())
            if not found:
                raise FileNotFoundError(2, f"no point file ({', '.join(SUFFIXES)}) in the folder", str(path))
            return cls(tuple(found))
        paths = tuple(Path(path) for path in source)
        if not paths:
            raise ValueError("source must be a point file, a folder of them, or several, got none")
        for path in paths:
            require_point_suffix(path)
        return cls(paths)

    def check_memory(self, memory: int) -> None:
        """Refuse files that have to be read whole and are too large for that."""
        for path in self.paths:
            size = path.stat().st_size
            if size * _BYTES_PER_BYTE > memory and not is_streamed(path):
                raise ValueError(
                    f"{path} must be of a kind that can be read in pieces (binary PLY, binary PCD, LAS, LAZ) "
                    f"to be read within a memory of {memory} bytes, it is one of {size} bytes that must be "
                    "read whole: nacre convert makes another of it"
                )

    def chunks(self, num_rows: int) -> Iterator[tuple[Path, Cloud]]:
        """Yield the points in pieces, with the file of each."""
        for path in self.paths:
            for cloud in read_chunks(path, num_rows):
                yield path, cloud


@dataclass(frozen=True)
class Survey:
    """
    What is known of a cloud.

    Attributes
    ----------
    dtype : dtype
        Of its rows.
    num_points, num_left_out : int
        Points that are finite, and those that are not.
    lower, upper : (3,) float64
        The bounding box.
    spacing : float
        How far apart points are, as if they lay evenly on a surface; 0 where all are in one place.
    sample : (S, 3) float64
        The 100 000 points of the lowest hashes, all where there are fewer.
    """

    dtype: np.dtype[Any]
    num_points: int
    num_left_out: int
    lower: npt.NDArray[np.float64]
    upper: npt.NDArray[np.float64]
    spacing: float
    sample: npt.NDArray[np.float64]


def survey(source: Source, num_rows: int) -> Survey:
    """Read a cloud in pieces of so many points, and tell what is in it."""
    look = _Look()
    for path, cloud in source.chunks(num_rows):
        look.at(path, cloud)
    return look.result(source)


def finite_rows(source: Source, of: Survey, num_rows: int) -> Iterator[Rows]:
    """Yield the finite points of a cloud in pieces."""
    for _, cloud in source.chunks(num_rows):
        rows = to_rows(cloud, of.dtype)
        yield finite_among(rows, rows["points"])


class _Look:
    """What has been seen of a cloud."""

    def __init__(self) -> None:
        self._first: tuple[Path, np.dtype[Any]] | None = None
        self._silent: set[str] = set()  # dimensions of LAS files that tell nothing up to now
        self._num_points = self._num_left_out = 0
        self._extremes = np.array([np.full(3, np.inf), np.full(3, -np.inf)])
        self._hashes: Hashes = np.zeros(0, np.uint64)
        self._sample = np.zeros((0, 3))

    def at(self, path: Path, cloud: Cloud) -> None:
        dtype = row_type(cloud)
        if self._first is None:
            self._first = path, dtype
            if is_las(path):
                self._silent = set(cloud.attributes)
        elif dtype != self._first[1]:
            first = f"{self._first[0]} has {_told(self._first[1])}"
            raise FileFormatError(
                path, f"its fields must be those of the first file: {first}, it {_told(dtype)}"
            )
        self._silent = silent_among(self._silent, cloud)
        finite = finite_among(cloud.points, cloud.points)
        self._num_left_out += len(cloud) - len(finite)
        if len(finite):
            self._num_points += len(finite)
            widen(self._extremes, finite)
            self._keep_lowest(finite)

    def _keep_lowest(self, points: npt.NDArray[np.float64]) -> None:
        """Keep the points of the lowest hashes, which are the same in whatever order they come."""
        hashes = point_hashes(points, seed=0)
        if len(self._hashes) == _SAMPLE_SIZE:
            low = np.flatnonzero(hashes < self._hashes[-1])
            hashes, points = hashes[low], points[low]
        all_hashes = np.concatenate([self._hashes, hashes])
        order = np.argsort(all_hashes)[:_SAMPLE_SIZE]
        self._sample = np.concatenate([self._sample, points])[order]
        self._hashes = all_hashes[order]

    def result(self, source: Source) -> Survey:
        if self._first is None or not self._num_points:
            raise ValueError(f"{_shown(source.paths)}: there is no finite point")
        dtype = row_type(to_cloud(np.zeros(0, self._first[1])), frozenset(self._silent))
        return Survey(
            dtype,
            self._num_points,
            self._num_left_out,
            self._extremes[0],
            self._extremes[1],
            spacing_of(self._sample, len(self._sample) / self._num_points),
            self._sample,
        )


def spacing_of(sample: npt.NDArray[Any], fraction: float = 1.0) -> float:
    """
    Return how far apart points are of which these are a random fraction.

    Where points lie on a surface, k of them lie on an area of pi r^2, if r is the median distance to the k-th
    nearest.
    """
    if len(sample) < 2:
        return 0.0
    k = min(_NEIGHBORS, len(sample))
    distances = np.asarray(KdTree(sample).query(sample, k)[0])[:, -1]
    return float(np.median(distances)) * float(np.sqrt(np.pi / k * fraction))


def _told(dtype: np.dtype[Any]) -> str:
    return ", ".join(f"{name.split()[-1]} {dtype[name].base}" for name in dtype.names or ())


def _shown(paths: Sequence[Path]) -> str:
    return str(paths[0]) + (f" and {len(paths) - 1} more" if len(paths) > 1 else "")
