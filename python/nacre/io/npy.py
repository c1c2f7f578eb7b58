"""The arrays of NumPy's own files."""

from __future__ import annotations

import math
import os
from dataclasses import dataclass
from io import BytesIO
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.errors import FileFormatError
from nacre.io.raw import check_padding

_MOST_HEADER = 1000


@dataclass(frozen=True)
class NpyHeader:
    """What a ``.npy`` array says about itself."""

    shape: tuple[int, ...]
    by_columns: bool
    dtype: np.dtype[Any]
    size: int
    """Bytes of the header: where the data begins."""


def read_npy_header(path: str | os.PathLike[str], data: bytes) -> NpyHeader:
    """Return the header at the start of ``data``; ``path`` names it in errors."""
    stream = BytesIO(data)
    try:
        version = np.lib.format.read_magic(stream)
        read_header = {
            (1, 0): np.lib.format.read_array_header_1_0,
            (2, 0): np.lib.format.read_array_header_2_0,
        }[version]
        shape, by_columns, dtype = read_header(stream, _MOST_HEADER)
    except Exception as error:  # of numpy's own, and of Python's, with which it reads the header
        reason = str(error).partition(": <")[0]
        raise FileFormatError(path, f"not a readable .npy array: {reason}", offset=0) from error
    return NpyHeader(shape, by_columns, dtype, stream.tell())


def read_npy_array(path: str | os.PathLike[str], data: bytes, header: NpyHeader) -> npt.NDArray[Any]:
    """Return the array after its header, whose type must not be one of objects."""
    num_bytes = math.prod(header.shape) * header.dtype.itemsize
    if num_bytes > len(data) - header.size:
        reason = (
            f"not a readable .npy array: its shape promises {num_bytes} bytes, "
            f"{len(data) - header.size} are there"
        )
        raise FileFormatError(path, reason, offset=header.size)
    check_padding(path, data, header.size + num_bytes)
    array = np.frombuffer(data, header.dtype, math.prod(header.shape), header.size)
    return array.reshape(header.shape, order="F" if header.by_columns else "C").copy()
