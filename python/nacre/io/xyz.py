"""XYZ files: text, a point a line."""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt

from nacre.errors import FileFormatError
from nacre.io.cloud import Cloud, Columns, check_comments, gather_columns, with_attributes
from nacre.io.raw import MAX_COMMENTS, TextTable, decode, excerpt, file_writer, read_file
from nacre.io.rows import encode_rows

_AXES = ("x", "y", "z")
_COLORS = ("red", "green", "blue")
_NORMALS = ("nx", "ny", "nz")
_ALIASES = {"r": "red", "g": "green", "b": "blue", "normal_x": "nx", "normal_y": "ny", "normal_z": "nz"}
# What a line without names may hold, by how many numbers it has: the first that fits.
_LAYOUTS: dict[int, list[tuple[str, ...]]] = {
    3: [_AXES],
    4: [(*_AXES, "intensity")],
    6: [(*_AXES, *_NORMALS), (*_AXES, *_COLORS)],
    7: [(*_AXES, "intensity", *_COLORS), (*_AXES, *_COLORS, "intensity")],
    9: [(*_AXES, *_COLORS, *_NORMALS), (*_AXES, *_NORMALS, *_COLORS)],
}
_SEPARATORS = bytes.maketrans(b",;", b"  ")


def read_cloud(path: str | os.PathLike[str]) -> Cloud:
    """Read an XYZ file; :func:`nacre.read_points` says what is returned and raised."""
    data = read_file(path).removeprefix(b"\xef\xbb\xbf")
    comments, names, start = _read_header(path, data)
    data = data.translate(_SEPARATORS)
    table = _read_table(path, data, start, names)
    columns = _named(path, data, start, table, names)
    used = set(_AXES)
    normals, colors = None, None
    if set(_NORMALS) <= set(columns):
        normals = gather_columns(columns, _NORMALS)
        used.update(_NORMALS)
    if set(_COLORS) <= set(columns) and _are_colors(gather_columns(columns, _COLORS)):
        colors = gather_columns(columns, _COLORS).astype(np.uint8)
        used.update(_COLORS)
    attributes = {name: column.copy() for name, column in columns.items() if name not in used}
    return Cloud(
        gather_columns(columns, _AXES), normals, colors, attributes, tuple(comments), path=Path(path)
    )


def _read_header(path: str | os.PathLike[str], data: bytes) -> tuple[list[str], tuple[str, ...] | None, int]:
    """Return the comments, the columns' names where they are told, and where the points begin."""
    comments: list[str] = []
    names: tuple[str, ...] | None = None
    position, number = 0, 0
    while position < len(data):
        number += 1
        end = data.find(b"\n", position)
        end = len(data) if end < 0 else end + 1
        line = data[position:end].strip()
        is_comment = line.startswith((b"#", b"//"))
        text = decode(line.lstrip(b"#/") if is_comment else line).strip()
        told = _names_in(text)
        if line and not is_comment and (names is not None or told is None):
            break
        position = end
        if told is not None:
            names = told
        elif is_comment:
            comments.append(text)
        if len(comments) > MAX_COMMENTS:
            raise FileFormatError(path, f"more than {MAX_COMMENTS} comments", line=number)
    return comments, names, position


def _names_in(text: str) -> tuple[str, ...] | None:
    """Return the names of columns that a line tells, or None."""
    words = [word.lower() for word in re.split(r"[\s,;]+", text) if word]
    names = tuple(_ALIASES.get(word, word) for word in words)
    return names if set(_AXES) <= set(names) and len(set(names)) == len(names) else None


def _read_table(
    path: str | os.PathLike[str], data: bytes, start: int, names: tuple[str, ...] | None
) -> npt.NDArray[np.float64]:
    """Return the numbers, a row for each line; all lines have as many."""
    num_points = sum(1 for line in data[start:].split(b"\n") if line.strip())
    width = None if names is None else len(names)
    rows = []
    for block in TextTable(path, data, start).blocks(num_points, "points"):
        width = int(block.widths[0]) if width is None else width
        block.require_width(width)
        rows.append(block.values.reshape(-1, width))
    if width is None:
        raise FileFormatError(path, "there is no point, nor a line of names", line=1)
    return np.concatenate(rows) if rows else np.zeros((0, width))


def _named(
    path: str | os.PathLike[str],
    data: bytes,
    start: int,
    table: npt.NDArray[np.float64],
    names: tuple[str, ...] | None,
) -> Columns:
    """Return the columns by their names."""
    for layout in _LAYOUTS.get(table.shape[1], []) if names is None else [names]:
        columns: Columns = dict(zip(layout, table.T, strict=True))
        if names is not None or _fits(columns):
            return columns
    first = data[start:].split(b"\n", 1)[0].strip()
    line = 1 + data.count(b"\n", 0, start)
    expected = "x y z, then r g b from 0 to 255, then nx ny nz of unit length, or a first line of names"
    raise FileFormatError(path, f"expected {expected}; got {excerpt(first)}", line=line)


def _fits(columns: Columns) -> bool:
    """Say whether what is to be colours, or else normals, may be that."""
    if "red" in columns:
        return _are_colors(gather_columns(columns, _COLORS))
    return "nx" not in columns or _are_unit(gather_columns(columns, _NORMALS))


def _are_colors(values: npt.NDArray[np.float64]) -> bool:
    return bool(((values >= 0) & (values <= 255) & (values == np.floor(values))).all())


def _are_unit(values: npt.NDArray[np.float64]) -> bool:
    squares = np.einsum("ij,ij->i", values, values)
    return bool((np.isnan(squares) | (squares == 0) | (np.abs(squares - 1) < 0.02)).all())


def write_cloud(
    path: str | os.PathLike[str], cloud: Cloud, *, comments: Sequence[str] = (), binary: bool = True
) -> None:
    """Write points as text after a line of names; :func:`nacre.write_points` has the parameters."""
    columns: Columns = dict(zip(_AXES, cloud.points.T, strict=True))
    if cloud.colors is not None:
        columns.update(zip(_COLORS, cloud.colors.T, strict=True))
    if cloud.normals is not None:
        columns.update(zip(_NORMALS, cloud.normals.T, strict=True))
    for name, values in cloud.attributes.items():
        if re.search(r"[,;#]", name):
            raise ValueError(f"attributes must not be called {name!r} in an XYZ file: it splits there")
        parts = {name: values} if values.ndim == 1 else {f"{name}_{i}": v for i, v in enumerate(values.T)}
        columns = with_attributes(columns, parts)
    lines = [f"# {line}".rstrip() for line in [*check_comments(comments), " ".join(columns)]]
    with file_writer(path) as stream:
        stream.write(("\n".join(lines) + "\n").encode())
        stream.writelines(encode_rows(columns.values(), binary=False))
