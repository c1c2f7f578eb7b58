"""A point file in memory, and what a point file to be written must look like."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre._internal import arrays
from nacre._internal.array_of_points import ArrayOfPoints
from nacre._internal.kinds import as_items, as_kind
from nacre._internal.value_equality import Value
from nacre.io.raw import MAX_COMMENTS

Columns = dict[str, npt.NDArray[Any]]


@dataclass(frozen=True, eq=False, repr=False)
class Cloud(ArrayOfPoints, Value):
    """
    The points of a file with everything that the file holds for each of them.

    Attributes
    ----------
    points : (N, 3) float32 or float64
        Coordinates, in the type in which they are stored.
    normals : (N, 3) float32 or float64, or None
    colors : (N, 3) uint8, or None
        Red, green, blue.
    attributes : dict of str to (N,) or (N, K) array
        Every other field, by its name in the file and in its type. A PLY list of varying length is an
        array of arrays (dtype object).
    comments : tuple of str
        The comments of the file's header.
    shape : (int, int) or None
        Rows and columns of an organised cloud: ``points.reshape(*shape, 3)`` is its image.
    path : Path or None
        The file.
    """

    points: arrays.FloatArray
    normals: arrays.FloatArray | None = None
    colors: npt.NDArray[np.uint8] | None = None
    attributes: Columns = field(default_factory=dict)
    comments: tuple[str, ...] = ()
    shape: tuple[int, int] | None = None
    path: Path | None = None

    def __post_init__(self) -> None:
        """Take lists, and colours from 0 to 1, for the arrays that they stand for."""
        points = self.points
        if not (isinstance(points, np.ndarray) and points.ndim == 2 and points.shape[1] == 3):
            points = arrays.as_points("points", points)
            object.__setattr__(self, "points", points)
        if self.normals is not None and np.shape(self.normals) != points.shape:
            arrays.as_matching_points("normals", self.normals, "points", len(points))
        colors = self.colors
        if colors is not None and not (
            getattr(colors, "dtype", None) == np.uint8 and colors.shape == points.shape
        ):
            object.__setattr__(self, "colors", arrays.as_colors("colors", colors, points.shape))

    def __len__(self) -> int:
        return len(self.points)

    def __getitem__(self, rows: slice | npt.ArrayLike) -> Cloud:
        """Return some of the points with all that belongs to them: a slice, a mask or indices."""
        if not isinstance(rows, slice):
            picked = arrays.as_array("rows", rows)
            if picked.ndim != 1 or (picked.size and picked.dtype.kind not in "bui"):
                raise TypeError(
                    f"rows must be a slice, a mask or indices, got {rows!r}; one is cloud.points[0], and "
                    "fields are in cloud.attributes, by their names"
                )
            rows = picked if picked.size else np.zeros(0, np.int64)
        return Cloud(
            self.points[rows],
            None if self.normals is None else self.normals[rows],
            None if self.colors is None else self.colors[rows],
            {name: values[rows] for name, values in self.attributes.items()},
            self.comments,
            path=self.path,
        )

    __iter__ = None  # rows are iterated over as arrays: cloud.points

    def __repr__(self) -> str:
        parts = [f"{len(self)} points", self.points.dtype.name]
        if self.shape is not None:
            parts.append(f"{self.shape[0]} rows x {self.shape[1]} columns")
        parts += [name for name in ("normals", "colors") if getattr(self, name) is not None]
        parts += [f"{name}: {array.dtype.name}" for name, array in self.attributes.items()]
        if self.path is not None:
            parts.append(f"path={str(self.path)!r}")
        return f"Cloud({', '.join(parts)})"

    def _repr_png_(self) -> bytes | None:
        from nacre.pictures.notebook import picture_of_points

        return picture_of_points(self.points, self.normals, self.colors)


def cloud_of(points: Any) -> Cloud:
    """Return points as a cloud: themselves, that of what has one, or an array without more."""
    own = points if isinstance(points, Cloud) else getattr(points, "cloud", None)
    if callable(own):
        own = own()
    return own if isinstance(own, Cloud) else Cloud(arrays.as_points("points", points))


def gather_columns(columns: Columns, names: tuple[str, ...]) -> npt.NDArray[Any]:
    """Return these columns side by side as a C-contiguous (N, len(names)) array of their common type."""
    dtype = np.result_type(*(columns[name] for name in names)).newbyteorder("=")
    gathered = np.empty((len(columns[names[0]]), len(names)), dtype=dtype)
    for i, name in enumerate(names):
        gathered[:, i] = columns[name]
    return gathered


def gather_floats(columns: Columns, names: tuple[str, ...]) -> arrays.FloatArray:
    """Return :func:`gather_columns` as float32 where that holds the stored type exactly, else as float64."""
    gathered = gather_columns(columns, names)
    return gathered.astype(np.result_type(gathered.dtype, np.float32), copy=False)


def native(array: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Return a C-contiguous copy in this machine's byte order."""
    return np.array(array, dtype=array.dtype.newbyteorder("="), order="C")


def check_cloud(
    points: npt.ArrayLike,
    normals: npt.ArrayLike | None,
    colors: npt.ArrayLike | None,
    attributes: Mapping[str, npt.ArrayLike] | None,
) -> Cloud:
    """Return the arguments of a writer as a :class:`Cloud`, or raise an error that names the wrong one."""
    points = arrays.as_points("points", points)
    if normals is not None:
        normals = arrays.as_matching_points("normals", normals, "points", len(points))
    if colors is not None:
        colors = arrays.as_colors("colors", colors, (len(points), 3))
    given = {} if attributes is None else attributes
    as_kind("attributes", given, Mapping, "a mapping of names to arrays")
    checked = {name: _as_attribute(name, value, len(points)) for name, value in given.items()}
    return Cloud(points, normals, colors, checked)


def with_attributes(columns: Columns, attributes: Columns) -> Columns:
    """Return the fields to write: columns and attributes, whose names must differ."""
    for name in attributes:
        if name in columns:
            raise ValueError(f"attributes must not be called {name!r}: the file has that name already")
    return {**columns, **attributes}


def check_comments(comments: Sequence[str]) -> list[str]:
    """Return the comments line by line."""
    if isinstance(comments, str):
        raise TypeError(f"comments must be a sequence of strings, got the string {comments!r}")
    lines = [
        line for comment in as_items("comments", comments) for line in (str(comment).splitlines() or [""])
    ]
    if len(lines) > MAX_COMMENTS:
        raise ValueError(f"comments must be at most {MAX_COMMENTS} lines, got {len(lines)}")
    return lines


def _as_attribute(name: str, value: npt.ArrayLike, num_points: int) -> npt.NDArray[Any]:
    if not isinstance(name, str) or not name.isascii() or not name.isprintable() or " " in name or not name:
        raise ValueError(f"attributes must have names of visible ASCII characters, got {name!r}")
    array = arrays.as_array(f"attributes[{name!r}]", value)
    if array.dtype.kind not in "buif" or array.dtype.itemsize > 8:
        raise TypeError(f"attributes[{name!r}] must be an array of real numbers, got dtype {array.dtype}")
    if array.ndim not in (1, 2) or len(array) != num_points:
        raise ValueError(
            f"attributes[{name!r}] must have shape ({num_points},) or ({num_points}, K), got {array.shape}"
        )
    if array.dtype.kind == "b":
        return array.astype(np.uint8)
    if array.dtype == np.float16:
        return array.astype(np.float32)
    return array.astype(array.dtype.newbyteorder("="), copy=False)
