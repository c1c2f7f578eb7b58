"""Random numbers that points have by where they are, whatever their place in a file."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from nacre import _core

Hashes = npt.NDArray[np.uint64]

_BINS = 20  # bits


def point_hashes(points: npt.NDArray[Any], seed: int, num_threads: int = 1) -> Hashes:
    """
    Return a random number for each point that depends on the seed and its exact coordinates alone.

    Parameters
    ----------
    points : (N, 3) float32 or float64
    seed : int
        Not negative.
    num_threads : int
        0 uses all.

    Returns
    -------
    (N,) uint64

    Notes
    -----
    Each coordinate's bits are mixed in by the finalizer of Steele, Lea and Flood, "Fast splittable
    pseudorandom number generators", 2014, with the constants of splitmix64.
    """
    hashes: Hashes = _core.point_hashes(np.ascontiguousarray(points), seed & 0xFFFFFFFFFFFFFFFF, num_threads)
    return hashes


class LowestHashes:
    """
    Which hash is the k-th lowest of more than memory holds, in two looks at all of them.

    The first look counts hashes by their first 20 bits; the second keeps those of the one bin that the k-th
    lies in, a millionth of them.
    """

    def __init__(self, k: int) -> None:
        self.k = k
        self._counts = np.zeros(1 << _BINS, np.int64)
        self._kept: list[Hashes] = []

    def count(self, hashes: Hashes) -> None:
        """Take a first look at some."""
        self._counts += np.bincount(_bin(hashes), minlength=1 << _BINS)

    def keep(self, hashes: Hashes) -> None:
        """Take a second look at some."""
        self._kept.append(hashes[_bin(hashes) == self._bin_of_kth()])

    def highest(self) -> int:
        """Return the k-th lowest hash, the highest of all where there are fewer."""
        kept = np.sort(np.concatenate([np.zeros(0, np.uint64), *self._kept]))
        rank = self.k - 1 - int(self._counts[: self._bin_of_kth()].sum())
        return int(kept[min(rank, len(kept) - 1)])

    def _bin_of_kth(self) -> int:
        ends = np.cumsum(self._counts)
        return int(np.searchsorted(ends, min(self.k, int(ends[-1])), side="left"))


def _bin(hashes: Hashes) -> npt.NDArray[np.int64]:
    return (hashes >> np.uint64(64 - _BINS)).astype(np.int64)
