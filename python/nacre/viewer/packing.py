"""Columns of numbers as bytes that compress well; ``web/data.js`` reads them."""

from __future__ import annotations

import json
import struct
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

Column = npt.NDArray[Any]

_UNSIGNED = {1: np.uint8, 2: np.uint16, 4: np.uint32}


def pack(header: Mapping[str, Any], columns: Mapping[str, Column]) -> bytes:
    """
    Return a block of bytes: the header's length (uint32), the header as JSON, and the columns.

    Parameters
    ----------
    header : mapping
        What JSON can say; "columns" is added to it.
    columns : mapping of (N,) or (N, C) arrays
        Of uint8, uint16, uint32 or float32.

    Notes
    -----
    Each column is stored as differences between rows, most significant bytes apart from least significant
    ones, as HDF5's shuffle filter does: neighbors that resemble each other become runs of equal bytes.
    """
    tables = {
        name: column.reshape(len(column), *column.shape[1:] or (1,)) for name, column in columns.items()
    }
    described = [
        {"name": name, "type": table.dtype.name, "rows": table.shape[0], "width": table.shape[1]}
        for name, table in tables.items()
    ]
    text = json.dumps({**header, "columns": described}, allow_nan=False).encode()
    return b"".join([struct.pack("<I", len(text)), text, *map(_shuffled, tables.values())])


def _shuffled(table: Column) -> bytes:
    bits = np.ascontiguousarray(table).view(_UNSIGNED[table.itemsize])
    differences = np.diff(bits, axis=0, prepend=np.zeros((1, bits.shape[1]), bits.dtype))
    stored = np.ascontiguousarray(differences.T).astype(f"<u{table.itemsize}")
    return stored[..., None].view(np.uint8).transpose(0, 2, 1).tobytes()


def rounded(values: npt.NDArray[Any]) -> npt.NDArray[np.float32]:
    """Return positive numbers rounded to 12 bits, 0.02 %: the rest is noise that does not compress."""
    bits = values.astype(np.float32).view(np.uint32)
    return np.asarray((bits + np.uint32(0x800)) & np.uint32(0xFFFFF000), np.uint32).view(np.float32)


def morton_order(rows: npt.NDArray[np.uint16]) -> npt.NDArray[np.int64]:
    """Return the order of points along a Morton curve (1966) through 1024 cells a side."""
    cells = (rows >> 6).astype(np.uint32)
    for shift, mask in ((16, 0x30000FF), (8, 0x300F00F), (4, 0x30C30C3), (2, 0x9249249)):
        cells = (cells | (cells << np.uint32(shift))) & np.uint32(mask)
    code = cells[:, 0] | (cells[:, 1] << np.uint32(1)) | (cells[:, 2] << np.uint32(2))
    return np.argsort(code, kind="stable")


def pack_files(files: Iterable[tuple[str, bytes]]) -> bytes:
    """Return named blocks as one: the names and sizes as :func:`pack` writes a header, and the blocks."""
    blocks = dict(files)
    sizes = {name: len(block) for name, block in blocks.items()}
    return pack({"sizes": sizes}, {}) + b"".join(blocks.values())
