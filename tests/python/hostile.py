"""Values that strangers pass: arrays of every kind and condition, and scalars of every kind."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[Any]


class Arrayed:
    """Something that NumPy can make an array of."""

    def __init__(self, array: Array) -> None:
        self.array = array

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> Array:
        """Return the array."""
        return self.array if dtype is None else self.array.astype(dtype)


def _first_row(array: Array, value: float) -> Array:
    changed = np.array(array, np.result_type(array, np.float32))
    if changed.size:
        changed.reshape(-1)[0] = value
    return changed


def _collinear(array: Array) -> Array:
    steps = np.arange(array.shape[0] if array.ndim else 1, dtype=np.float64)
    return np.broadcast_to(steps.reshape(-1, *[1] * (array.ndim - 1)), array.shape).astype(np.float64)


# What may be in an array of real numbers.
CONDITIONS: dict[str, Callable[[Array], Any]] = {
    "a NaN": lambda a: _first_row(a, math.nan),
    "an inf": lambda a: _first_row(a, math.inf),
    "all NaN": lambda a: np.full(a.shape, np.nan),
    "all inf": lambda a: np.full(a.shape, -np.inf),
    "empty": lambda a: a[:0],
    "empty rows": lambda a: np.zeros((3, 0)),
    "one": lambda a: a[:1],
    "two": lambda a: a[:2],
    "the same": lambda a: np.broadcast_to(a[:1], a.shape),
    "collinear": _collinear,
    "zeros": np.zeros_like,
    "negative": lambda a: -a.astype(np.float64),
    "1e-12": lambda a: 1e-12 * a.astype(np.float64),
    "1e12": lambda a: 1e12 * a.astype(np.float64),
    "1e12 away": lambda a: 1e12 + a.astype(np.float64),
    "1e300": lambda a: 1e300 * a.astype(np.float64),
    "1e-300": lambda a: 1e-300 * a.astype(np.float64),
    "3e38": lambda a: np.full(a.shape, 3e38, np.float32),
    "1e-42": lambda a: np.full(a.shape, 1e-42, np.float32),
    "one far": lambda a: _first_row(a, 1e30),
    "more": lambda a: np.concatenate([a, a]),
    "deeper": lambda a: a[None],
    "flatter": lambda a: a.reshape(-1),
    "cut": lambda a: a[..., :-1],
    "a number": lambda a: 3.0,
    **{
        f"dtype {t}": lambda a, t=t: (np.abs(a) * 3).astype(t)
        for t in ("?", "i1", "u1", "i2", "u2", "i4", "u4", "i8", "u8", "f2", "g")
    },
}

# What is no array of real numbers, and must be refused.
IMPOSSIBLE: dict[str, Callable[[Array], Any]] = {
    "complex": lambda a: a.astype(complex),
    "objects": lambda a: a.astype(object),
    "words": lambda a: a.astype(str),
    "bytes": lambda a: a.astype("S8"),
    "records": lambda a: np.zeros(a.shape, [("x", "f4"), ("y", "f4")]),
    "dates": lambda a: np.zeros(a.shape, "M8[s]"),
    "ragged": lambda a: [[1.0, 2.0, 3.0], [1.0]],
    "a word": lambda a: "points",
    "a dict": lambda a: {"x": 1},
    "masked": lambda a: np.ma.masked_array(a, mask=np.arange(a.size).reshape(a.shape) % 2),
    "an object": lambda a: object(),
}


def _mapped(folder: Path) -> Callable[[Array], Array]:
    def mapped(array: Array) -> Array:
        path = folder / "array.npy"
        np.save(path, array)
        loaded: Array = np.load(path, mmap_mode="r")
        return loaded

    return mapped


def forms(folder: Path) -> dict[str, Callable[[Array], Any]]:
    """Return ways to hold the same values: the answer must be the same."""
    return {
        "strided": lambda a: np.repeat(a, 2, axis=0)[::2],
        "backwards": lambda a: a[::-1].copy()[::-1],
        "Fortran": np.asfortranarray,
        "byte-swapped": lambda a: a.astype(a.dtype.newbyteorder()),
        "read-only": _read_only,
        "a list": lambda a: a.tolist(),
        "a matrix": _matrix,
        "nothing masked": lambda a: np.ma.masked_array(a, mask=False),
        "an object with an array": Arrayed,
        "a memory map": _mapped(folder),
        "unaligned": _unaligned,
    }


def _matrix(array: Array) -> Any:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", PendingDeprecationWarning)
        return np.asmatrix(array) if array.ndim == 2 else array


def _read_only(array: Array) -> Array:
    copy = array.copy()
    copy.flags.writeable = False
    return copy


def _unaligned(array: Array) -> Array:
    memory = np.zeros(array.nbytes + 1, np.uint8)
    view = memory[1:].view(array.dtype).reshape(array.shape)
    view[...] = array
    return view


FLOATS: dict[str, Any] = {
    "0": 0.0, "-0": -0.0, "negative": -1.0, "tiny": 1e-300, "1e-12": 1e-12, "1e12": 1e12, "huge": 1e300,
    "NaN": math.nan, "inf": math.inf, "-inf": -math.inf, "beyond": 2**2000, "float32": np.float32(0.5),
    "int": 1, "int64": np.int64(1), "bool": True, "array of none": np.array(0.5),
}  # fmt: skip
INTEGERS: dict[str, Any] = {
    "0": 0, "negative": -1, "1": 1, "2": 2, "most": 2**31 - 1, "int32": 2**31, "int64": 2**63, "beyond": 2**70,
    "numpy": np.int64(3), "uint8": np.uint8(3), "bool": True,
}  # fmt: skip
NO_NUMBERS: dict[str, Any] = {
    "a word": "3", "a list": [1, 2], "complex": 1j, "an object": object(), "a dict": {}, "bytes": b"1",
}  # fmt: skip
NO_INTEGERS: dict[str, Any] = NO_NUMBERS | {"a half": 1.5, "NaN": math.nan, "a float": 3.0}
NO_FLAGS: dict[str, Any] = {"a word": "yes", "a list": [True], "an object": object()}
NO_WORDS: dict[str, Any] = {"unknown": "such a thing", "empty": "", "a number": 3, "bytes": b"fuse"}
NO_OBJECTS: dict[str, Any] = {"a word": "camera", "a number": 3, "an object": object()}


def values_for(valid: Any) -> Iterator[tuple[str, Any, bool]]:
    """Yield (condition, value, whether it must be refused) for an argument for which ``valid`` is one."""
    if isinstance(valid, np.ndarray):
        for name, change in (CONDITIONS | IMPOSSIBLE).items():
            try:
                value = change(valid)
            except (ValueError, IndexError, TypeError):  # this array cannot be so
                continue
            yield name, value, name in IMPOSSIBLE
        return
    groups: list[tuple[dict[str, Any], bool]]
    if isinstance(valid, bool):
        groups = [({"True": True, "False": False, "numpy": np.True_}, False), (NO_FLAGS, True)]
    elif isinstance(valid, int):
        groups = [(INTEGERS, False), (NO_INTEGERS, True)]
    elif isinstance(valid, float):
        groups = [(FLOATS, False), (NO_NUMBERS, True)]
    elif isinstance(valid, str):
        groups = [(NO_WORDS, True)]
    else:
        groups = [(NO_OBJECTS, True)]
    for values, refused in groups:
        for name, value in values.items():
            yield name, value, refused
