"""Points numbered, grouped and put in order by where they are, whatever their place in a file."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from nacre import _core

Hashes = npt.NDArray[np.uint64]
Numbers = npt.NDArray[np.int64]


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


def cube_numbers(
    points: npt.NDArray[Any], origin: npt.NDArray[np.float64], side: float, shape: Numbers
) -> Numbers:
    """Return the number of the cube that each point lies in, of those that fill a box."""
    numbers: Numbers = _core.cube_numbers(
        np.ascontiguousarray(points), origin, side, shape.tolist(), num_threads=1
    )
    return numbers


def group_by_number(numbers: Numbers) -> tuple[Numbers, Numbers, Numbers]:
    """Return the numbers that occur, ascending, how many rows have each, and these, group by group."""
    groups: tuple[Numbers, Numbers, Numbers] = _core.group_by_number(numbers)
    return groups


def order_by_hash(starts: Numbers, hashes: Hashes) -> tuple[Numbers, Hashes]:
    """Return the rows of each stretch between starts by ascending hash, and the hashes in this order."""
    order: tuple[Numbers, Hashes] = _core.order_by_hash(starts.tolist(), hashes, num_threads=0)
    return order
