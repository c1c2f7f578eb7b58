"""Tables written row by row, as bytes or as text."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import chain
from typing import Any

import numpy as np
import numpy.typing as npt

Arrays = list[npt.NDArray[Any]]

_ROWS_PER_BLOCK = 1 << 16


def encode_rows(columns: Iterable[npt.NDArray[Any]], *, binary: bool) -> Iterator[bytes | memoryview]:
    """
    Yield a table in pieces: packed and little-endian, or a line of text for each row.

    ``columns`` are (N,) or (N, K) arrays. From the text every value is read back bit for bit.
    """
    for rows in _blocks(columns):
        yield _binary(rows) if binary else _text(rows)


def encode_lines(line: str, columns: Iterable[npt.NDArray[Any]]) -> Iterator[bytes]:
    """Yield text in pieces: for each row its numbers in the places ``{}`` of ``line``, exact as they are."""
    for rows in _blocks(columns):
        yield _filled(line, rows)


def _blocks(columns: Iterable[npt.NDArray[Any]]) -> Iterator[Arrays]:
    columns = list(columns)
    for start in range(0, len(columns[0]), _ROWS_PER_BLOCK):
        yield [column[start : start + _ROWS_PER_BLOCK] for column in columns]


def _binary(columns: Arrays) -> memoryview:
    fields = [(f"f{i}", column.dtype.newbyteorder("<"), column.shape[1:]) for i, column in enumerate(columns)]
    dtype = np.dtype(fields)
    rows = np.empty(len(columns[0]), dtype=dtype)
    for i, column in enumerate(columns):
        rows[f"f{i}"] = column
    return rows.view(np.uint8).data


def _text(columns: Arrays) -> bytes:
    width = sum(column[0].size for column in columns)
    return _filled(" ".join(width * ["{}"]) + "\n", columns)


def _filled(line: str, columns: Arrays) -> bytes:
    codes: list[str] = []
    values: list[list[Any]] = []
    for column in columns:
        for part in column.reshape(len(column), -1).T:
            # Nine digits tell all float32 apart; repr gives the fewest that tell all float64 apart.
            codes.append("%d" if part.dtype.kind in "iu" else "%.9g" if part.dtype.itemsize == 4 else "%r")
            values.append(part.tolist())
    template = line.format(*codes) * len(columns[0])
    return (template % tuple(chain.from_iterable(zip(*values, strict=True)))).encode()
