"""Hashes, cubes and cells."""

from __future__ import annotations

import numpy as np
import pytest

from nacre._internal.cubes import point_hashes
from nacre.out_of_core.grid import divide_into_cells
from nacre.out_of_core.hashes import LowestHashes


def test_a_hash_is_of_the_coordinates_alone() -> None:
    points = np.random.default_rng(0).normal(size=(1000, 3)).astype(np.float32)
    hashes = point_hashes(points, 0)
    np.testing.assert_array_equal(point_hashes(points[::-1].astype(np.float64), 0), hashes[::-1])
    assert len(np.unique(hashes)) == 1000
    assert point_hashes(np.array([[0.0, 1, 2]]), 3) == point_hashes(np.array([[-0.0, 1, 2]]), 3)
    assert (point_hashes(points, 1) != hashes).all()
    assert np.mean(hashes / 2.0**64) == pytest.approx(0.5, abs=0.03)


@pytest.mark.parametrize("k", [1, 2, 777, 5000, 9000])
def test_the_kth_lowest_of_several_pieces(k: int) -> None:
    hashes = np.random.default_rng(k).integers(0, 2**64, 5000, dtype=np.uint64)
    lowest = LowestHashes(k)
    for piece in np.split(hashes, 3 * [1000]):
        lowest.count(piece)
    for piece in np.split(hashes, [17, 400]):
        lowest.keep(piece)
    assert lowest.highest() == np.sort(hashes)[min(k, 5000) - 1]


def test_cells_hold_every_cube_once_and_not_too_many_points() -> None:
    random = np.random.default_rng(0)
    places = np.unique(random.integers(0, 40, (600, 3)), axis=0)
    counts = random.integers(1, 50, len(places))
    cells = divide_into_cells(places, counts, 500)
    np.testing.assert_array_equal(np.sort(np.concatenate(cells)), np.arange(len(places)))
    sums = [counts[cell].sum() for cell in cells]
    assert max(sums) <= 500
    assert min(sums) > 100
    one = divide_into_cells(np.zeros((1, 3), np.int64), np.array([10**9]), 500)
    assert len(one) == 1  # a cube is never cut
