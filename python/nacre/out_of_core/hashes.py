"""Which of many hashes are the lowest."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from nacre._internal.cubes import Hashes

_BINS = 20  # bits


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
