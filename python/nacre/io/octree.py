"""Points divided among the nodes of an octree, whether memory holds them all or not."""

from __future__ import annotations

import tempfile
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import numpy.typing as npt

from nacre._internal.cubes import Hashes, group_by_number, point_hashes

Records = npt.NDArray[Any]
Codes = npt.NDArray[np.int64]
Key = tuple[int, int, int, int]
"""Of a node: its level, and where it stands along the axes among the 2^level of that level."""

CELLS_PER_SIDE = 128
"""Of a node, each of which gives it a point."""
_BITS = 21  # of each axis in a code
_CELL_BITS = 7
_DEEPEST = _BITS - _CELL_BITS
_LEAF = 1 << 15  # points that are not divided any more: two cells deep, where they lie on a surface
_POINTS_PER_BLOCK = 2_000_000
_DEEPEST_BLOCK = 8
_ROWS_AT_ONCE = 1 << 20


@dataclass(frozen=True)
class Cube:
    """
    The root, in whole steps of the coordinates.

    Attributes
    ----------
    origin : (3,) int64
        Its lowest corner.
    bits : int
        Its side is 2^bits steps.
    """

    origin: npt.NDArray[np.int64]
    bits: int

    @classmethod
    def around(cls, lower: npt.NDArray[np.int64], upper: npt.NDArray[np.int64]) -> Cube:
        """Return the smallest whose corner is the lower bound."""
        return cls(lower, max(int((upper - lower).max()).bit_length(), 1))

    def codes(self, records: Records) -> Codes:
        """Return the place of each point along the Z-order curve, whose leading bits are its nodes."""
        codes = np.zeros(len(records), np.int64)
        for axis, name in enumerate("XYZ"):
            place = np.clip(records[name].astype(np.int64) - self.origin[axis], 0, (1 << self.bits) - 1)
            shift = self.bits - _BITS
            codes |= _spread(place >> shift if shift > 0 else place << -shift) << axis
        return codes


def nodes(
    records: Iterable[Records], cube: Cube, num_points: int, folder: Path
) -> Iterator[tuple[Key, Records]]:
    """
    Yield the nodes that have points, those of coarse levels first.

    A node has, of those that no node above has, the point of the lowest hash of each of its 128^3 cells, and
    all that are left where these are few. The nodes follow from the set of points, whatever their order.

    Parameters
    ----------
    records : iterable of (N,) records
        With whole coordinates ``X``, ``Y``, ``Z``.
    cube : Cube
    num_points : int
        Of all of them.
    folder : Path
        Where points are kept, twice, where they are more than two millions.
    """
    if num_points <= _POINTS_PER_BLOCK:
        whole = np.concatenate(list(records))
        yield from divided(whole, cube)
        return
    with tempfile.TemporaryFile(dir=folder) as unsorted, tempfile.TemporaryFile(dir=folder) as stream:
        blocks, dtype = _keep(records, cube, unsorted)
        blocks.sort(unsorted, stream, cube, dtype)
        unsorted.truncate(0)
        above = _Above(blocks.levels)
        for block in range(len(blocks.levels)):
            here = blocks.read(stream, block, dtype)
            above.look_at(block, here, cube.codes(here), _hashes(here))
        yield from above.nodes()
        for block, level in enumerate(blocks.levels.tolist()):
            here = blocks.read(stream, block, dtype)
            here = here[above.left(block, len(here))]
            yield from _divided(here, cube.codes(here), _hashes(here), level)


def divided(records: Records, cube: Cube) -> Iterator[tuple[Key, Records]]:
    """Yield the same nodes of points in memory."""
    yield from _divided(records, cube.codes(records), _hashes(records), level=0)


@dataclass(frozen=True)
class _Blocks:
    """Nodes that memory holds with all that is below them, and where their points are in a file."""

    codes: Codes  # of the cubes of the finest blocks that hold points
    owners: npt.NDArray[np.int64]  # the block of each
    levels: npt.NDArray[np.int64]
    starts: npt.NDArray[np.int64]

    @classmethod
    def of(cls, codes: Codes, counts: npt.NDArray[np.int64]) -> _Blocks:
        """Divide the root until a block has few points enough."""
        owners = np.zeros(len(codes), np.int64)
        levels: list[int] = []
        sizes: list[int] = []
        left = [(0, 0, len(codes))]
        while left:
            level, first, last = left.pop()
            size = int(counts[first:last].sum())
            if size <= _POINTS_PER_BLOCK or level == _DEEPEST_BLOCK:
                owners[first:last] = len(levels)
                levels.append(level)
                sizes.append(size)
                continue
            children = codes[first:last] >> 3 * (_DEEPEST_BLOCK - level - 1)
            begins = first + np.flatnonzero(np.diff(children, prepend=-1))
            ends = [*begins[1:].tolist(), last]
            left += [(level + 1, b, e) for b, e in zip(begins.tolist(), ends, strict=True)][::-1]
        return cls(codes, owners, np.array(levels), np.concatenate([[0], np.cumsum(sizes)]))

    def sort(self, unsorted: BinaryIO, stream: BinaryIO, cube: Cube, dtype: np.dtype[Any]) -> None:
        """Write the points block after block."""
        ends = self.starts[:-1].copy()
        unsorted.seek(0)
        while len(records := np.fromfile(unsorted, dtype, _ROWS_AT_ONCE)):
            places = np.searchsorted(self.codes, cube.codes(records) >> 3 * (_BITS - _DEEPEST_BLOCK))
            blocks, counts, order = group_by_number(self.owners[places])
            content = _taken(records, order)
            for block, begin, count in zip(blocks, np.cumsum(counts) - counts, counts, strict=True):
                stream.seek(int(ends[block]) * dtype.itemsize)
                stream.write(content[begin : begin + count].view(np.uint8).data)
            ends[blocks] += counts
        stream.flush()

    def read(self, stream: BinaryIO, block: int, dtype: np.dtype[Any]) -> Records:
        """Return the points of a block."""
        stream.seek(int(self.starts[block]) * dtype.itemsize)
        return np.fromfile(stream, dtype, int(self.starts[block + 1] - self.starts[block]))


def _keep(records: Iterable[Records], cube: Cube, stream: BinaryIO) -> tuple[_Blocks, np.dtype[Any]]:
    """Write points to a file as they come, and tell into which blocks they are to be divided."""
    totals: dict[int, int] = {}
    dtype: np.dtype[Any] = np.dtype(np.uint8)
    for piece in records:
        dtype = piece.dtype
        piece.tofile(stream)
        codes, counts, _ = group_by_number(cube.codes(piece) >> 3 * (_BITS - _DEEPEST_BLOCK))
        for code, count in zip(codes.tolist(), counts.tolist(), strict=True):
            totals[code] = totals.get(code, 0) + count
    stream.flush()
    codes = np.array(sorted(totals), np.int64)
    return _Blocks.of(codes, np.array([totals[code] for code in codes.tolist()], np.int64)), dtype


class _Above:
    """The nodes above the blocks, which have some of the points that a block would have itself."""

    def __init__(self, levels: npt.NDArray[np.int64]) -> None:
        self._levels = levels
        self._parts: list[tuple[Records, Codes, Hashes, npt.NDArray[np.int64]]] = []
        self._taken: list[npt.NDArray[np.int64]] = []

    def look_at(self, block: int, records: Records, codes: Codes, hashes: Hashes) -> None:
        """Note the points of a block that nodes above it may have, which are those of its own cells."""
        order = _order(codes, hashes)
        rows = order[_lowest_of_cells(codes[order], hashes[order], int(self._levels[block]))]
        self._parts.append((records[rows], codes[rows], hashes[rows], rows))

    def nodes(self) -> Iterator[tuple[Key, Records]]:
        """Yield them."""
        records, codes, hashes = (np.concatenate([part[i] for part in self._parts]) for i in range(3))
        lengths = [len(part[3]) for part in self._parts]
        levels = np.repeat(self._levels, lengths)
        is_taken = np.zeros(len(codes), bool)
        left = _order(codes, hashes)
        for level in range(int(self._levels.max())):
            left = left[levels[left] > level]
            taken = _lowest_of_cells(codes[left], hashes[left], level)
            is_taken[left[taken]] = True
            yield from _of_level(records, codes, left[taken], level)
            left = np.delete(left, taken)
        ends = np.cumsum(lengths)[:-1]
        self._taken = [
            part[3][taken] for part, taken in zip(self._parts, np.split(is_taken, ends), strict=True)
        ]
        self._parts.clear()

    def left(self, block: int, num_points: int) -> npt.NDArray[np.bool_]:
        """Say which points of a block no node above it has."""
        is_left = np.ones(num_points, bool)
        is_left[self._taken[block]] = False
        return is_left


def _divided(records: Records, codes: Codes, hashes: Hashes, level: int) -> Iterator[tuple[Key, Records]]:
    """Yield the nodes from a level on, of points that are those of whole nodes there."""
    left = _order(codes, hashes)
    while len(left):
        here = codes[left]
        node = here >> 3 * (_BITS - level)
        begins = np.flatnonzero(np.diff(node, prepend=-1))
        sizes = np.diff(begins, append=len(node))
        is_taken = np.repeat(sizes <= _LEAF, sizes)
        is_taken[_lowest_of_cells(here, hashes[left], level)] = True
        is_taken |= level == _DEEPEST
        yield from _of_level(records, codes, left[is_taken], level)
        left = left[~is_taken]
        level += 1


def _of_level(
    records: Records, codes: Codes, rows: npt.NDArray[np.intp], level: int
) -> Iterator[tuple[Key, Records]]:
    """Yield the nodes of a level with the points of these rows, which are in the order of their codes."""
    node = codes[rows] >> 3 * (_BITS - level)
    begins = np.flatnonzero(np.diff(node, prepend=-1))
    for begin, end in zip(begins.tolist(), [*begins[1:].tolist(), len(rows)], strict=True):
        place = int(node[begin])
        x, y, z = (sum((place >> (3 * bit + axis) & 1) << bit for bit in range(level)) for axis in range(3))
        yield (level, x, y, z), _taken(records, rows[begin:end])


def _lowest_of_cells(codes: Codes, hashes: Hashes, level: int) -> npt.NDArray[np.intp]:
    """Return where the point of the lowest hash of each cell of a level is, of points ordered by codes."""
    if not len(codes):
        return np.zeros(0, np.intp)
    cells = codes >> 3 * (_BITS - level - _CELL_BITS)
    begins = np.flatnonzero(np.diff(cells, prepend=-1))
    lowest = np.repeat(np.minimum.reduceat(hashes, begins), np.diff(begins, append=len(cells)))
    found = np.flatnonzero(hashes == lowest)
    first: npt.NDArray[np.intp] = found[np.flatnonzero(np.diff(cells[found], prepend=-1))]
    return first


def _order(codes: Codes, hashes: Hashes) -> npt.NDArray[np.intp]:
    """Return the order by codes, and of the few points that have the same one by hashes."""
    order = np.argsort(codes)
    same = np.diff(codes[order]) == 0
    tied = np.flatnonzero(np.concatenate([same, [False]]) | np.concatenate([[False], same]))
    rows = np.sort(order[tied])
    order[tied] = rows[np.lexsort((hashes[rows], codes[rows]))]
    return order


def _hashes(records: Records) -> Hashes:
    points = np.column_stack([records[name].astype(np.float64) for name in "XYZ"])
    return point_hashes(points, seed=0)


def _taken(records: Records, rows: npt.NDArray[np.intp]) -> Records:
    taken: Records = np.ascontiguousarray(records).view(f"V{records.dtype.itemsize}").take(rows)
    return taken.view(records.dtype)


def _spread(values: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
    """Return 21 bits with two zeros between each and the next."""
    for shift, mask in (
        (32, 0x1F00000000FFFF), (16, 0x1F0000FF0000FF), (8, 0x100F00F00F00F00F),
        (4, 0x10C30C30C30C30C3), (2, 0x1249249249249249),
    ):  # fmt: skip
        values = (values | values << shift) & mask
    return values
