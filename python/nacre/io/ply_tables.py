"""The tables of a PLY file: the values of each element."""

from __future__ import annotations

import os
import struct
from array import array
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from nacre.errors import FileFormatError
from nacre.io.cloud import native
from nacre.io.ply_header import Element, Property
from nacre.io.raw import TextBlock, TextTable

ByteOrder = Literal["<", ">"]

_MAX_DTYPE_BYTES = (1 << 31) - 1


@dataclass(frozen=True)
class Ragged:
    """The lists of one property: all their values in one array, and the length of each list."""

    values: npt.NDArray[Any]
    counts: npt.NDArray[np.signedinteger[Any]]

    def as_array(self) -> npt.NDArray[Any]:
        """Return an (N, K) array where all lists have K values, else an array of arrays."""
        if len(self.counts) == 0 or (self.counts == self.counts[0]).all():
            return native(self.values.reshape(len(self.counts), -1 if len(self.values) else 0))
        rows = np.empty(len(self.counts), dtype=object)
        rows[:] = np.split(native(self.values), np.cumsum(self.counts)[:-1])
        return rows


Table = dict[str, "npt.NDArray[Any] | Ragged"]


def read_text_table(text: TextTable, element: Element) -> Table:
    """Read the next rows of a text as the table of ``element``."""
    check_table_size(
        text.path, element, element.num_rows * 2 * len(element.properties) - 1, len(text.data) - text.offset
    )
    columns = {
        entry.name: np.empty(element.num_rows, dtype=entry.dtype)
        for entry in element.properties
        if entry.count_dtype is None
    }
    lists: dict[str, list[Ragged]] = {
        entry.name: [] for entry in element.properties if entry.count_dtype is not None
    }
    row = 0
    for block in text.blocks(element.num_rows, f"rows of element {element.name}"):
        if not lists:
            block.require_width(len(element.properties))
        cursor = block.firsts.copy()
        ends = block.firsts + block.widths
        for entry in element.properties:
            exhausted = np.flatnonzero(cursor >= ends)
            if len(exhausted):
                raise block.error(int(block.firsts[exhausted[0]]), f"the line ends before {entry.name}")
            if entry.count_dtype is None:
                columns[entry.name][row : row + len(cursor)] = block.column(cursor, entry.dtype, entry.name)
                cursor += 1
            else:
                cursor += 1
                part = _read_text_lists(block, cursor, ends, entry, entry.count_dtype)
                cursor += part.counts
                lists[entry.name].append(part)
        surplus = np.flatnonzero(cursor != ends)
        if len(surplus):
            raise block.error(int(cursor[surplus[0]]), "the line holds more values than the header names")
        row += len(cursor)
    table: Table = {}
    for entry in element.properties:
        table[entry.name] = (
            columns[entry.name] if entry.count_dtype is None else _join(lists[entry.name], entry)
        )
    return table


def _read_text_lists(
    block: TextBlock,
    cursor: npt.NDArray[np.intp],
    ends: npt.NDArray[np.intp],
    entry: Property,
    count_dtype: np.dtype[Any],
) -> Ragged:
    """Return the lists whose first values are at ``cursor`` and whose lengths stand before them."""
    counts = block.column(cursor - 1, count_dtype, f"the length of {entry.name}").astype(np.int64)
    wrong = np.flatnonzero((counts < 0) | (counts > ends - cursor))
    if len(wrong):
        reason = f"the line does not hold {counts[wrong[0]]} values of {entry.name}"
        raise block.error(int(block.firsts[wrong[0]]), reason)
    items = np.repeat(cursor - (np.cumsum(counts) - counts), counts) + np.arange(counts.sum())
    return Ragged(block.column(items, entry.dtype, entry.name), counts)


def _join(parts: list[Ragged], entry: Property) -> Ragged:
    values = [np.empty(0, dtype=entry.dtype), *(part.values for part in parts)]
    counts = [np.empty(0, dtype=np.int64), *(part.counts for part in parts)]
    return Ragged(np.concatenate(values), np.concatenate(counts))


def read_binary_table(
    path: str | os.PathLike[str], data: bytes, position: int, element: Element, byte_order: ByteOrder
) -> tuple[Table, int]:
    """Read the bytes from ``position`` on as the table of ``element``; also return where it ends."""
    if not element.properties:
        return {}, position
    row_bytes = sum((entry.count_dtype or entry.dtype).itemsize for entry in element.properties)
    check_table_size(path, element, element.num_rows * row_bytes, len(data) - position)
    found = _read_equal_rows(data, position, element, byte_order)
    return found or _read_unequal_rows(path, data, position, element, byte_order)


def check_table_size(path: str | os.PathLike[str], element: Element, smallest: int, num_bytes: int) -> None:
    """Refuse a number of rows that cannot be in the rest of the file, before memory is set aside for it."""
    if smallest > num_bytes:
        raise FileFormatError(
            path,
            f"the header promises {element.num_rows} rows of element {element.name}, at least {smallest} "
            f"bytes, but {num_bytes} bytes are left in the file",
            line=element.line,
        )


def _read_equal_rows(
    data: bytes, position: int, element: Element, byte_order: ByteOrder
) -> tuple[Table, int] | None:
    """Return the table and its end if the lists of all rows are as long as those of the first, else None."""
    fields: list[tuple[str, Any] | tuple[str, Any, tuple[int]]] = []
    row_bytes = 0
    for i, entry in enumerate(element.properties):
        dtype = entry.dtype.newbyteorder(byte_order)
        if entry.count_dtype is None:
            fields.append((f"values{i}", dtype))
            row_bytes += dtype.itemsize
            continue
        count_dtype = entry.count_dtype.newbyteorder(byte_order)
        first = data[position + row_bytes : position + row_bytes + count_dtype.itemsize]
        if len(first) < count_dtype.itemsize:
            return None
        count = int(np.frombuffer(first, count_dtype)[0])
        row_bytes += count_dtype.itemsize + count * dtype.itemsize
        if count < 0 or row_bytes > min(len(data), _MAX_DTYPE_BYTES):
            return None
        fields += [(f"count{i}", count_dtype), (f"values{i}", dtype, (count,))]
    if position + row_bytes * element.num_rows > len(data):
        return None
    rows = np.frombuffer(data, np.dtype(fields), element.num_rows, position)
    table: Table = {}
    for i, entry in enumerate(element.properties):
        table[entry.name] = column = rows[f"values{i}"]
        if entry.count_dtype is not None:
            counts = rows[f"count{i}"].astype(_counting(entry.count_dtype))
            if (counts != column.shape[1]).any():
                return None
            table[entry.name] = Ragged(column.reshape(-1), counts)
    return table, position + rows.nbytes


def _read_unequal_rows(
    path: str | os.PathLike[str], data: bytes, position: int, element: Element, byte_order: ByteOrder
) -> tuple[Table, int]:
    """Return the table and its end when each row says only at its lists where the next begins."""
    start = position
    steps: list[tuple[Property, struct.Struct | None, int, bytearray, array[int]]] = []
    for entry in element.properties:
        count_type = None if entry.count_dtype is None else _integer_struct(entry.count_dtype, byte_order)
        counts = array("b")
        if entry.count_dtype is not None:
            counts = array(_counting(entry.count_dtype).char, [0]) * element.num_rows
        steps.append((entry, count_type, entry.dtype.itemsize, bytearray(), counts))
    try:
        for row in range(element.num_rows):
            for _, count_type, size, payload, counts in steps:
                if count_type is not None:
                    (count,) = count_type.unpack_from(data, position)
                    position += count_type.size
                    if count > len(data):
                        raise struct.error
                    counts[row] = count
                    size *= count
                payload += data[position : position + size]
                position += size
                if size < 0 or position > len(data):
                    raise struct.error
    except struct.error:
        reason = f"element {element.name} does not end within the file, or a list has a negative length"
        raise FileFormatError(path, reason, offset=start) from None
    table: Table = {}
    for entry, count_type, _, payload, counts in steps:
        values = np.frombuffer(payload, entry.dtype.newbyteorder(byte_order))
        table[entry.name] = (
            values if count_type is None else Ragged(values, np.frombuffer(counts, counts.typecode))
        )
    return table, position


def _counting(dtype: np.dtype[Any]) -> np.dtype[np.signedinteger[Any]]:
    """Return a small type that holds what the lengths of lists of this type can be."""
    if dtype.itemsize == 1:
        return np.dtype(np.int16)
    return np.dtype(np.int32) if dtype.itemsize == 2 else np.dtype(np.int64)


def _integer_struct(dtype: np.dtype[Any], byte_order: ByteOrder) -> struct.Struct:
    code = {1: "b", 2: "h", 4: "i", 8: "q"}[dtype.itemsize]
    return struct.Struct(byte_order + (code.upper() if dtype.kind == "u" else code))
