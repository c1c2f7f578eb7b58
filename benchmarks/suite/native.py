"""The C++ peers, as shared libraries: C arrays in, C arrays out."""

from __future__ import annotations

import ctypes
import os
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

FOLDER = "NACRE_BENCHMARK_PEERS"
"""The environment variable that names the folder of the libraries."""


class AbsentError(RuntimeError):
    """The peer is not installed."""


@cache
def library(name: str) -> Any:
    """Load a peer's library."""
    path = Path(os.environ.get(FOLDER, ".")) / f"{name}.so"
    if not path.exists():
        raise AbsentError(f"{name} was not found on this machine")
    return ctypes.CDLL(str(path))


def function(peer: str, name: str, result: Any = None) -> Any:
    """Return a function of a peer; floats go in as double, integers as int64, arrays as pointers."""
    call = library(peer)[name]
    call.restype = result

    def convert(value: Any) -> Any:
        if isinstance(value, np.ndarray):
            return ctypes.c_void_p(value.ctypes.data)
        if isinstance(value, float):
            return ctypes.c_double(value)
        return ctypes.c_int64(value)

    return lambda *arguments: call(*map(convert, arguments))


def version(peer: str) -> str:
    """Return the version that a peer was built from."""
    text: bytes = function(peer, "version", ctypes.c_char_p)()
    return text.decode()


POINTER = ctypes.c_int64


def touched(shape: tuple[int, ...], dtype: npt.DTypeLike) -> npt.NDArray[Any]:
    """Return an array whose pages are in memory, as a C++ user would keep one."""
    return np.zeros(shape, dtype) + np.zeros((), dtype)
