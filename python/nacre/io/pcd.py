"""PCD files of the Point Cloud Library (ascii, binary, binary_compressed)."""

from __future__ import annotations

import dataclasses
import os
import struct
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.errors import FileFormatError
from nacre.io import lzf
from nacre.io.cloud import Cloud, Columns, check_comments, gather_floats, native, with_attributes
from nacre.io.raw import (
    MAX_COMMENTS,
    TextTable,
    check_padding,
    decode,
    excerpt,
    file_writer,
    read_file,
    read_head,
    read_records,
)
from nacre.io.rows import encode_rows

_KEYWORDS = frozenset(
    ("VERSION", "FIELDS", "SIZE", "TYPE", "COUNT", "WIDTH", "HEIGHT", "VIEWPOINT", "POINTS", "DATA")
)
_VERSIONS = frozenset((".5", ".6", ".7", "0.5", "0.6", "0.7"))
_ENCODINGS = ("ascii", "binary", "binary_compressed")
_CODES = {("F", "4"): "f4", ("F", "8"): "f8"} | {
    (kind, size): kind.lower() + size for kind in "IU" for size in ("1", "2", "4", "8")
}
_NORMALS = ("normal_x", "normal_y", "normal_z")
_MAX_FIELDS = 10_000
_MAX_ROW_BYTES = 1 << 30


@dataclass(frozen=True)
class _Field:
    name: str
    dtype: np.dtype[Any]
    count: int

    @property
    def num_bytes(self) -> int:
        return self.dtype.itemsize * self.count

    @property
    def is_padding(self) -> bool:
        return self.name == "_"


@dataclass(frozen=True)
class _Header:
    fields: tuple[_Field, ...]
    num_points: int
    shape: tuple[int, int] | None
    encoding: str
    comments: tuple[str, ...]
    size: int

    @property
    def row_bytes(self) -> int:
        return sum(field.num_bytes for field in self.fields)


def _read_header(path: str | os.PathLike[str], data: bytes) -> _Header:
    if not data:
        raise FileFormatError(path, "the file is empty")
    entries: dict[str, list[str]] = {}
    comments: list[str] = []
    position, number = 0, 0
    try:
        while "DATA" not in entries:
            number += 1
            if position >= len(data):
                raise ValueError("the file ends before DATA")
            end = data.find(b"\n", position)
            end = len(data) if end < 0 else end
            line = data[position:end].strip()
            position = min(end + 1, len(data))
            if line.startswith(b"#"):
                if len(comments) == MAX_COMMENTS:
                    raise ValueError(f"more than {MAX_COMMENTS} comments")
                if not line.startswith(b"# .PCD v"):
                    comments.append(decode(line[1:].strip()))
            elif line:
                keyword, *words = map(decode, line.split(maxsplit=_MAX_FIELDS + 1))
                keyword = "FIELDS" if keyword == "COLUMNS" else keyword
                if keyword not in _KEYWORDS:
                    raise ValueError(f"unknown keyword in the header: {excerpt(line)}")
                if keyword in entries or not words:
                    raise ValueError(f"{'a second line' if words else 'no value after'} {keyword}")
                entries[keyword] = words
        return _interpret(entries, comments, position)
    except ValueError as error:
        raise FileFormatError(path, str(error), line=number) from None


def _interpret(entries: dict[str, list[str]], comments: list[str], size: int) -> _Header:
    """Return the header made of these lines, or raise a ValueError that says what is wrong with them."""
    for keyword in ("FIELDS", "SIZE", "TYPE"):
        if keyword not in entries:
            raise ValueError(f"the header has no line {keyword}")
    version = entries.get("VERSION", ["0.7"])[0]
    if version not in _VERSIONS:
        raise ValueError(f"VERSION must be 0.5, 0.6 or 0.7, got {excerpt(version.encode())}")
    encoding = entries["DATA"][0]
    if encoding not in _ENCODINGS:
        raise ValueError(f"DATA must be one of {', '.join(_ENCODINGS)}, got {excerpt(encoding.encode())}")
    viewpoint = " ".join(entries.get("VIEWPOINT", []))
    if viewpoint not in ("", "0 0 0 1 0 0 0"):
        if len(comments) == MAX_COMMENTS:
            raise ValueError(f"more than {MAX_COMMENTS} comments, as one of which VIEWPOINT is kept")
        comments = [*comments, f"VIEWPOINT {viewpoint}"]
    num_points, shape = _interpret_shape(entries)
    return _Header(_interpret_fields(entries), num_points, shape, encoding, tuple(comments), size)


def _interpret_fields(entries: dict[str, list[str]]) -> tuple[_Field, ...]:
    names = entries["FIELDS"]
    if len(names) > _MAX_FIELDS:
        raise ValueError(f"more than {_MAX_FIELDS} fields")
    counts = entries.get("COUNT", ["1"] * len(names))
    for keyword, words in (("SIZE", entries["SIZE"]), ("TYPE", entries["TYPE"]), ("COUNT", counts)):
        if len(words) != len(names):
            raise ValueError(f"{keyword} has {len(words)} values for {len(names)} FIELDS")
    fields = []
    for name, kind, num_bytes, count in zip(names, entries["TYPE"], entries["SIZE"], counts, strict=True):
        if (kind, num_bytes) not in _CODES:
            raise ValueError(f"field {excerpt(name.encode())} has unknown TYPE {kind} of SIZE {num_bytes}")
        fields.append(_Field(name, np.dtype(_CODES[kind, num_bytes]), _whole("COUNT", count)))
        if fields[-1].count < 1:
            raise ValueError(f"field {excerpt(name.encode())} has COUNT {count}")
    by_name = {field.name: field for field in fields if not field.is_padding}
    if len(by_name) < sum(not field.is_padding for field in fields):
        raise ValueError(f"a field is named twice in FIELDS {' '.join(names)}")
    for name in "xyz":
        if name not in by_name or by_name[name].count != 1:
            raise ValueError(f"there is no field {name} with COUNT 1")
    if sum(field.num_bytes for field in fields) > _MAX_ROW_BYTES:
        raise ValueError("the fields of one point are too large")
    return tuple(fields)


def _interpret_shape(entries: dict[str, list[str]]) -> tuple[int, tuple[int, int] | None]:
    """Return the number of points and the shape of an organised cloud."""
    if "WIDTH" not in entries and "HEIGHT" not in entries:
        return _whole("POINTS", entries.get("POINTS", [""])[0]), None
    width = _whole("WIDTH", entries.get("WIDTH", [""])[0])
    height = _whole("HEIGHT", entries.get("HEIGHT", ["1"])[0])
    if "POINTS" in entries and _whole("POINTS", entries["POINTS"][0]) != width * height:
        raise ValueError(f"POINTS {entries['POINTS'][0]} is not WIDTH {width} times HEIGHT {height}")
    return width * height, (height, width) if height > 1 else None


def _whole(keyword: str, text: str) -> int:
    if not (text.isascii() and text.isdigit() and len(text) < 20):
        raise ValueError(f"{keyword} must be a whole number, got {excerpt(text.encode())}")
    return int(text)


def read_cloud(path: str | os.PathLike[str]) -> Cloud:
    """Read a PCD file; :func:`nacre.read_points` says what is returned and raised."""
    data = read_file(path)
    header = _read_header(path, data)
    if header.encoding == "ascii":
        columns = _read_ascii(path, data, header)
    elif header.encoding == "binary":
        columns = _read_binary(path, data, header)
    else:
        columns = _read_compressed(path, data, header)
    return _cloud_of(path, header, columns)


def read_chunks(path: str | os.PathLike[str], num_rows: int) -> Iterator[Cloud] | None:
    """Return a binary PCD file in pieces of so many points; None where it is of another kind."""
    header = _read_header(path, read_head(path, b"\nDATA"))
    if header.encoding != "binary":
        return None
    size = Path(path).stat().st_size
    _check_size(path, header, header.num_points * header.row_bytes, size - header.size)
    header = dataclasses.replace(header, shape=None)
    tables = read_records(path, header.size, _row_type(header), header.num_points, num_rows, are_last=True)
    return (_cloud_of(path, header, _columns_of(rows, header)) for rows in tables)


def _cloud_of(path: str | os.PathLike[str], header: _Header, columns: Columns) -> Cloud:
    points = gather_floats(columns, ("x", "y", "z"))
    used = {"x", "y", "z"}
    normals, colors = None, None
    scalars = {name: column for name, column in columns.items() if column.ndim == 1}
    if all(name in scalars and scalars[name].dtype.kind == "f" for name in _NORMALS):
        normals = gather_floats(columns, _NORMALS)
        used.update(_NORMALS)
    attributes: Columns = {}
    for name in ("rgb", "rgba"):
        packed = scalars.get(name)
        if colors is None and packed is not None and packed.dtype.itemsize == 4:
            # Packed as 0xAARRGGBB, in a float for the sake of old programs.
            channels = native(packed).astype(packed.dtype.newbyteorder("<")).view(np.uint8).reshape(-1, 4)
            colors = np.ascontiguousarray(channels[:, 2::-1])
            used.add(name)
            if name == "rgba" and "alpha" not in columns:
                attributes["alpha"] = channels[:, 3].copy()
    attributes.update({name: native(column) for name, column in columns.items() if name not in used})
    return Cloud(points, normals, colors, attributes, header.comments, header.shape, Path(path))


def _check_size(path: str | os.PathLike[str], header: _Header, num_bytes: int, num_available: int) -> None:
    """Refuse a number of points that cannot be in the file, before memory is set aside for it."""
    if num_bytes > num_available:
        raise FileFormatError(
            path,
            f"the header promises {header.num_points} points, at least {num_bytes} bytes, "
            f"but {num_available} bytes are left in the file",
            offset=header.size,
        )


def _read_ascii(path: str | os.PathLike[str], data: bytes, header: _Header) -> Columns:
    width = sum(field.count for field in header.fields)
    _check_size(path, header, header.num_points * 2 * width - 1, len(data) - header.size)
    columns = {
        field.name: np.empty((header.num_points, field.count), dtype=field.dtype)
        for field in header.fields
        if not field.is_padding
    }
    text = TextTable(path, data, header.size)
    row = 0
    for block in text.blocks(header.num_points, "points"):
        block.require_width(width)
        cursor = block.firsts
        rows = slice(row, row + len(cursor))
        for field in header.fields:
            if not field.is_padding:
                tokens = (cursor[:, None] + np.arange(field.count)).reshape(-1)
                values = block.column(tokens, field.dtype, field.name)
                columns[field.name][rows] = values.reshape(-1, field.count)
            cursor = cursor + field.count
        row = rows.stop
    check_padding(path, data, text.offset)
    counts = {field.name: field.count for field in header.fields}
    return {name: column if counts[name] > 1 else column[:, 0] for name, column in columns.items()}


def _read_binary(path: str | os.PathLike[str], data: bytes, header: _Header) -> Columns:
    num_bytes = header.num_points * header.row_bytes
    _check_size(path, header, num_bytes, len(data) - header.size)
    check_padding(path, data, header.size + num_bytes)
    return _columns_of(np.frombuffer(data, _row_type(header), header.num_points, header.size), header)


def _row_type(header: _Header) -> np.dtype[Any]:
    return np.dtype([(f"f{i}", _stored(field)) for i, field in enumerate(header.fields)])


def _columns_of(rows: npt.NDArray[Any], header: _Header) -> Columns:
    return {field.name: rows[f"f{i}"] for i, field in enumerate(header.fields) if not field.is_padding}


def _stored(field: _Field) -> Any:
    dtype = field.dtype.newbyteorder("<")
    return dtype if field.count == 1 else (dtype, (field.count,))


def _read_compressed(path: str | os.PathLike[str], data: bytes, header: _Header) -> Columns:
    """Read compressed data: the fields one after the other, each for all points, as one LZF block."""
    start = header.size + 8
    if start > len(data):
        raise FileFormatError(path, "the file ends before the compressed data", offset=len(data))
    compressed_size, size = struct.unpack_from("<II", data, header.size)
    if compressed_size > len(data) - start:
        reason = (
            f"{compressed_size} bytes of compressed data are promised, {len(data) - start} are in the file"
        )
        raise FileFormatError(path, reason, offset=header.size)
    check_padding(path, data, start + compressed_size)
    stored = header.fields
    if size != header.num_points * header.row_bytes:  # the Point Cloud Library leaves padding out here
        stored = tuple(field for field in header.fields if not field.is_padding)
    if size != header.num_points * sum(field.num_bytes for field in stored):
        reason = f"{size} bytes of data are promised, which is not {header.num_points} points"
        raise FileFormatError(path, reason, offset=header.size + 4)
    if size > compressed_size * lzf.MAX_RATIO:
        reason = f"{compressed_size} bytes of compressed data cannot hold {size} bytes"
        raise FileFormatError(path, reason, offset=header.size)
    try:
        content = lzf.decompress(data[start : start + compressed_size], size)
    except ValueError as error:
        raise FileFormatError(path, str(error), offset=start) from None
    columns: Columns = {}
    position = 0
    for field in stored:
        if not field.is_padding:
            dtype = field.dtype.newbyteorder("<")
            values = np.frombuffer(content, dtype, header.num_points * field.count, position)
            columns[field.name] = values if field.count == 1 else values.reshape(-1, field.count)
        position += header.num_points * field.num_bytes
    return columns


def write_cloud(
    path: str | os.PathLike[str], cloud: Cloud, *, comments: Sequence[str] = (), binary: bool = True
) -> None:
    """Write points as a PCD file, version 0.7; :func:`nacre.write_points` has the parameters."""
    columns = _stored_columns(cloud, binary)
    with file_writer(path) as stream:
        stream.write(_header(columns, len(cloud), comments, binary))
        stream.writelines(encode_rows(columns.values(), binary=binary))


def write_chunks(path: str | os.PathLike[str], chunks: Iterable[Cloud], num_points: int) -> None:
    """Write pieces of a cloud, all with the same fields and of ``num_points`` in all, as one PCD file."""
    with file_writer(path) as stream:
        for number, cloud in enumerate(chunks):
            columns = _stored_columns(cloud, True)
            if number == 0:
                stream.write(_header(columns, num_points, cloud.comments, True))
            stream.writelines(encode_rows(columns.values(), binary=True))


def _stored_columns(cloud: Cloud, binary: bool) -> Columns:
    columns: Columns = {name: cloud.points[:, i] for i, name in enumerate(("x", "y", "z"))}
    if cloud.normals is not None:
        columns.update({name: cloud.normals[:, i] for i, name in enumerate(_NORMALS)})
    if cloud.colors is not None:
        columns["rgb"] = _pack(cloud.colors, binary)
    if "_" in cloud.attributes:
        raise ValueError("attributes must not be called '_', which means padding in a PCD file")
    columns = with_attributes(columns, cloud.attributes)
    empty = [name for name, column in cloud.attributes.items() if column.ndim == 2 and column.shape[1] == 0]
    if empty:
        raise ValueError(f"attributes[{empty[0]!r}] must have at least one value per point in a PCD file")
    return columns


def _header(columns: Columns, num_points: int, comments: Sequence[str], binary: bool) -> bytes:
    header = {
        "VERSION": ["0.7"],
        "FIELDS": columns,
        "SIZE": [str(column.dtype.itemsize) for column in columns.values()],
        "TYPE": [column.dtype.kind.upper() for column in columns.values()],
        "COUNT": [str(1 if column.ndim == 1 else column.shape[1]) for column in columns.values()],
        "WIDTH": [str(num_points)],
        "HEIGHT": ["1"],
        "VIEWPOINT": ["0 0 0 1 0 0 0"],
        "POINTS": [str(num_points)],
        "DATA": ["binary" if binary else "ascii"],
    }
    lines = [
        "# .PCD v0.7 - Point Cloud Data file format",
        *(f"# {line}".rstrip() for line in check_comments(comments)),
    ]
    lines += [f"{keyword} {' '.join(words)}" for keyword, words in header.items()]
    return ("\n".join(lines) + "\n").encode()


def _pack(colors: npt.NDArray[np.uint8], binary: bool) -> npt.NDArray[Any]:
    """Return 0x00RRGGBB, in a float as the Point Cloud Library has it; its texts have the whole number."""
    channels = colors.astype(np.uint32)
    packed = (channels[:, 0] << 16) | (channels[:, 1] << 8) | channels[:, 2]
    return packed.view(np.float32) if binary else packed
