"""What the page reads: bytes that say what went in, and are few."""

from __future__ import annotations

import gzip
import sys
from pathlib import Path

import numpy as np
import pytest

from nacre.viewer.packing import morton_order, pack, rounded

sys.path.insert(0, str(Path(__file__).parents[1]))
from packed_columns import unpacked


@pytest.mark.parametrize("rows", [0, 1, 500])
@pytest.mark.parametrize("dtype", ["uint8", "uint16", "uint32"])
def test_integers_come_back(dtype: str, rows: int) -> None:
    values = np.random.default_rng(0).integers(0, np.iinfo(dtype).max, (rows, 3), dtype, endpoint=True)
    np.testing.assert_array_equal(unpacked(pack({}, {"values": values}))["values"].reshape(rows, 3), values)


def test_floats_come_back() -> None:
    values = np.random.default_rng(1).exponential(size=200).astype(np.float32)
    np.testing.assert_array_equal(unpacked(pack({}, {"values": values}))["values"][:, 0], values)
    assert np.abs(rounded(values) / values - 1).max() <= 2**-12


def test_neighbors_in_space_are_near_in_order_and_compress_well() -> None:
    rng = np.random.default_rng(4)
    rows = np.column_stack([rng.integers(0, 65536, (20_000, 2)), np.full(20_000, 500)]).astype(np.uint16)
    sizes = [len(gzip.compress(pack({}, {"points": p}), 6)) for p in (rows, rows[morton_order(rows)])]
    assert sizes[1] < 0.85 * sizes[0]
    assert sorted(morton_order(rows)) == list(range(len(rows)))
