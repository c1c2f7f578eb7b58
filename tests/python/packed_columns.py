"""What is in the blocks of bytes that the viewer's page reads."""

from __future__ import annotations

import json
import struct
from typing import Any

import numpy as np


def header_of(block: bytes) -> Any:
    """Return the header of what pack returned."""
    (size,) = struct.unpack_from("<I", block)
    return json.loads(block[4 : 4 + size])


def unpacked(block: bytes) -> dict[str, np.ndarray[Any, Any]]:
    """Undo pack, as data.js does."""
    (size,) = struct.unpack_from("<I", block)
    at, columns = 4 + size, {}
    for column in header_of(block)["columns"]:
        rows, width = column["rows"], column["width"]
        dtype = np.dtype(column["type"])
        planes = np.frombuffer(block, np.uint8, rows * width * dtype.itemsize, at)
        bits = planes.reshape(width, dtype.itemsize, rows).transpose(0, 2, 1).copy()
        differences = bits.view(f"<u{dtype.itemsize}").reshape(width, rows)
        values = np.cumsum(differences, axis=1, dtype=f"u{dtype.itemsize}").T.copy()
        columns[column["name"]] = values.view(dtype)
        at += rows * width * dtype.itemsize
    assert at == len(block)
    return columns
