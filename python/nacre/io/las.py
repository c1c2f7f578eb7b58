"""LAS 1.4 and LAZ files: points of surveys, by laspy."""

from __future__ import annotations

import math
import os
import struct
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from itertools import chain, islice
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import numpy.typing as npt

from nacre._internal import arrays
from nacre._internal.warned import warn_of_loss
from nacre.errors import FileFormatError
from nacre.io import copc
from nacre.io.atomic import atomic_path
from nacre.io.cloud import Cloud, Columns, check_comments, native
from nacre.io.raw import MAX_COMMENTS, decode, require_regular

_MISSING = 'LAS and LAZ files need laspy and lazrs: pip install "nacre[las]"'
NORMALS = ("NormalX", "NormalY", "NormalZ")  # as the Point Data Abstraction Library names them
COLORS = ("red", "green", "blue")
_POINTS_PER_CHUNK = 1_000_000
_HEADER = struct.Struct("<96xIIBHI116x")  # data offset, number of records, point format, bytes and number
_RECORD_BYTES = 54  # of a variable length record, at least
_COMPRESSED = 0x80
_FINEST_SCALE = 1e-6  # [m]
_DAY_AND_YEAR = (
    90  # where the header says when it was written; zeros: not known, and the same cloud the same bytes
)
_DESCRIPTION = ("LASF_Spec", 3)  # a record of text
_MOST_TEXT = 65_534  # bytes of it, before a zero
_DEFAULTS = {"return_number": 1, "number_of_returns": 1}
_PLAIN, _COLORED = 6, 7  # the point formats of LAS 1.4
_EXTREMES_ARE_TOLD = 0b110  # of extra bytes: bits of their options


def read_cloud(path: str | os.PathLike[str]) -> Cloud:
    """
    Read a LAS or LAZ file; :func:`nacre.read_points` says what is returned and raised.

    Coordinates are scaled and shifted as the header says. Dimensions that every file has are left out where
    they are the same as in a file that says nothing: 0, and the first of one return.
    """
    with _opened(path) as reader:
        chunks = list(reader.chunk_iterator(_POINTS_PER_CHUNK))
        is_wide = any(map(has_wide_colors, chunks))
        names = list(reader.header.point_format.dimension_names)
        cloud = cloud_of(Path(path), chunks, names, is_wide, keep_all=False)
    _check_count(path, len(cloud), reader.header.point_count)
    return replace(cloud, comments=comments_of(reader.header))


def read_chunks(path: str | os.PathLike[str], num_rows: int) -> Iterator[Cloud]:
    """Yield a LAS or LAZ file in pieces of so many points, one at least, with every dimension that it has."""
    is_wide = _any_is_wide(path, num_rows)
    num_read = 0
    with _opened(path) as reader:
        names = list(reader.header.point_format.dimension_names)
        comments = comments_of(reader.header)
        for chunk in reader.chunk_iterator(num_rows):
            num_read += len(chunk)
            yield replace(cloud_of(Path(path), [chunk], names, is_wide, keep_all=True), comments=comments)
        if not num_read:
            yield replace(cloud_of(Path(path), [], names, is_wide, keep_all=True), comments=comments)
    _check_count(path, num_read, reader.header.point_count)


def count_points(path: str | os.PathLike[str]) -> int:
    """Return how many points the header promises."""
    with _opened(path) as reader:
        return int(reader.header.point_count)


def comments_of(header: Any) -> tuple[str, ...]:
    """Return the lines in which a file describes what is in it."""
    found = (record for record in header.vlrs if (record.user_id, record.record_id) == _DESCRIPTION)
    texts = (decode(bytes(record.record_data).partition(b"\0")[0]) for record in found)
    return tuple(islice((line for text in texts for line in text.splitlines()), MAX_COMMENTS))


def is_las(path: str | os.PathLike[str]) -> bool:
    """Say whether a file is LAS or LAZ, by its name."""
    return Path(path).suffix.lower() in (".las", ".laz")


def silent_among(names: Iterable[str], cloud: Cloud) -> set[str]:
    """Return those of some attributes that are everywhere as in a file that says nothing of them."""
    return {name for name in names if (cloud.attributes[name] == default_of(name)).all()}


def default_of(name: str) -> int:
    """Return the value of a dimension of which a file says nothing."""
    return _DEFAULTS.get(name, 0)


@contextmanager
def _opened(path: str | os.PathLike[str]) -> Iterator[Any]:
    """Open a file; what laspy and lazrs raise while it is read becomes a FileFormatError."""
    laspy = import_laspy()
    size = require_regular(path).stat().st_size
    with Path(path).open("rb") as stream:
        check_header(path, stream, size)
        stream.seek(0)
        with readable(path), laspy.open(stream, closefd=False, read_evlrs=False) as reader:
            yield reader


@contextmanager
def readable(path: str | os.PathLike[str]) -> Iterator[None]:
    """Make a FileFormatError of what laspy and lazrs raise."""
    try:
        yield
    except (MemoryError, OSError, GeneratorExit, FileFormatError):
        raise
    except BaseException as error:  # of laspy, and of lazrs, which panics
        if isinstance(error, KeyboardInterrupt | SystemExit):
            raise
        raise FileFormatError(path, f"not a readable LAS file: {error}", offset=0) from error


def _check_count(path: str | os.PathLike[str], found: int, expected: int) -> None:
    if found != expected:
        reason = f"the header promises {expected} points, {found} are in the file"
        raise FileFormatError(path, reason, offset=Path(path).stat().st_size)


def check_header(path: str | os.PathLike[str], stream: BinaryIO, size: int) -> None:
    """Refuse a header whose tables cannot be in the file, before memory and time are spent on them."""
    header = stream.read(_HEADER.size)
    if not header.startswith(b"LASF") or len(header) < _HEADER.size:
        raise FileFormatError(path, "a LAS file begins with 'LASF' and a header of 227 bytes", offset=0)
    start, num_records, point_format, point_bytes, num_points = _HEADER.unpack(header)
    if not _HEADER.size <= start <= size:
        reason = f"the header promises points from byte {start} on, the file has {size} bytes"
        raise FileFormatError(path, reason, offset=96)
    if num_records * _RECORD_BYTES > start:
        reason = f"{num_records} records are promised in {start} bytes"
        raise FileFormatError(path, reason, offset=100)
    if point_format & _COMPRESSED:
        _check_chunk_table(path, stream, start, size)
    elif num_points * point_bytes > size - start:
        reason = f"the header promises {num_points} points of {point_bytes} bytes, {size - start} are left"
        raise FileFormatError(path, reason, offset=107)


def _check_chunk_table(path: str | os.PathLike[str], stream: BinaryIO, start: int, size: int) -> None:
    """Refuse more chunks of compressed points than the file can hold: lazrs would end the process."""
    place = start
    for at in (start, size - 8):  # where the table is; -1: that is told at the end, as from a stream
        stream.seek(max(at, 0))
        (place,) = struct.unpack("<q", stream.read(8).ljust(8, b"\xff"))
        if place != -1:
            break
    stream.seek(min(max(place, 0), size))
    _, num_chunks = struct.unpack("<II", stream.read(8).ljust(8, b"\xff"))
    if num_chunks > size:
        raise FileFormatError(path, f"{num_chunks} chunks are promised in {size} bytes", offset=max(place, 0))


def cloud_of(path: Path, chunks: list[Any], names: list[str], is_wide: bool, *, keep_all: bool) -> Cloud:
    """Return records with the dimensions of these names, of which those that tell nothing may be left out."""

    def column(name: str) -> npt.NDArray[Any]:
        parts = [np.asarray(chunk[name]) for chunk in chunks]
        return native(np.concatenate(parts)) if parts else np.zeros(0)

    points = np.column_stack([column(axis) for axis in "xyz"]).astype(np.float64).reshape(-1, 3)
    normals, colors = None, None
    used = {"X", "Y", "Z"}
    if set(NORMALS) <= set(names):
        normals = np.column_stack([column(name) for name in NORMALS])
        used.update(NORMALS)
    if set(COLORS) <= set(names):
        stored = np.column_stack([column(name) for name in COLORS]).astype(np.uint16)
        colors = (stored >> (8 * is_wide)).astype(np.uint8)
        used.update(COLORS)
    attributes: Columns = {}
    for name in (name for name in names if name not in used):
        values = column(name)
        if keep_all or not (values == default_of(name)).all():
            attributes[name] = values
    return Cloud(points, normals, colors, attributes, path=path)


def has_wide_colors(chunk: Any) -> bool:
    """Say whether colours fill 16 bits: some programs store 8."""
    names = set(chunk.point_format.dimension_names)
    return set(COLORS) <= names and any(np.asarray(chunk[name]).max(initial=0) > 255 for name in COLORS)


def _any_is_wide(path: str | os.PathLike[str], num_rows: int) -> bool:
    """Say the same of a whole file, of which mostly the first points tell it."""
    with _opened(path) as reader:
        if not set(COLORS) <= set(reader.header.point_format.dimension_names):
            return False
        return any(map(has_wide_colors, reader.chunk_iterator(num_rows)))


def write_cloud(
    path: str | os.PathLike[str], cloud: Cloud, *, comments: Sequence[str] = (), binary: bool = True
) -> None:
    """
    Write points as a LAS 1.4 file, compressed where it ends in ``.laz``, COPC where in ``.copc.laz``.

    :func:`nacre.write_points` has the parameters.

    Coordinates are whole steps of a micrometre, or coarser where the points lie more than 4 km apart.
    """
    if not np.isfinite(cloud.points).all():
        raise ValueError("points must be finite in a LAS file, got some that are not")
    write_chunks(path, [replace(cloud, comments=tuple(comments))], len(cloud), cloud.points)


def write_chunks(
    path: str | os.PathLike[str], chunks: Iterable[Cloud], num_points: int, extremes: arrays.FloatArray
) -> None:
    """Write pieces of a cloud, all with the same fields, within the bounds of ``extremes``, as one file."""
    laspy = import_laspy()
    pieces = iter(chunks)
    first = next(pieces)
    header = _las_header(laspy, first, extremes)
    if first.comments:
        header.vlrs.append(laspy.VLR(*_DESCRIPTION, "", _description(path, first.comments)))
    records = (_las_points(laspy, cloud, header) for cloud in chain([first], pieces))
    with atomic_path(path) as temporary, temporary.open("r+b") as stream:
        if copc.is_copc(path):
            arrays_of_records = (record.array for record in records)
            copc.write(stream, header, arrays_of_records, num_points, _bounds(extremes), temporary.parent)
        else:
            is_compressed = Path(path).suffix.lower() == ".laz"
            writer = laspy.LasWriter(stream, header, do_compress=is_compressed, closefd=False)
            for record in records:
                writer.write_points(record)
            writer.close()
        stream.seek(_DAY_AND_YEAR)
        stream.write(bytes(4))


def _description(path: str | os.PathLike[str], comments: Sequence[str]) -> bytes:
    """Return comments as a record has them, which holds no more than its length can say."""
    text = "\n".join(check_comments(comments)).encode()
    warn_of_loss(path, [f"comments of more than {_MOST_TEXT} bytes"] if len(text) > _MOST_TEXT else [])
    return text[:_MOST_TEXT].decode(errors="ignore").encode() + b"\0"


def _bounds(points: arrays.FloatArray) -> npt.NDArray[np.float64]:
    """Return the lowest and the highest coordinates."""
    extremes = np.zeros((2, 3))
    if len(points):
        extremes[:] = points.min(axis=0), points.max(axis=0)
    return extremes


def _las_header(laspy: Any, cloud: Cloud, extremes: arrays.FloatArray) -> Any:
    """Return a header with a dimension for each field of a cloud."""
    header = laspy.LasHeader(version="1.4", point_format=_PLAIN if cloud.colors is None else _COLORED)
    header.offsets, header.scales = _quantization(extremes)
    header.generating_software = "nacre"
    standard = set(header.point_format.dimension_names)
    for name, values in _extra_columns(cloud).items():
        if name not in standard:
            dtype = values.dtype.str[1:] if values.ndim == 1 else f"{values.shape[1]}{values.dtype.str[1:]}"
            header.add_extra_dim(laspy.ExtraBytesParams(name=name, type=dtype))
    for record in header.vlrs.get("ExtraBytesVlr"):
        for dimension in record.extra_bytes_structs:
            dimension.options &= ~_EXTREMES_ARE_TOLD  # laspy tells those of the first point
    return header


def _las_points(laspy: Any, cloud: Cloud, header: Any) -> Any:
    """Return the points of a cloud as records of a file with this header."""
    record = laspy.ScaleAwarePointRecord.zeros(len(cloud), header=header)
    record.x, record.y, record.z = cloud.points.astype(np.float64).T
    if cloud.colors is not None:
        record.red, record.green, record.blue = cloud.colors.T.astype(np.uint16) * 257
    for name, value in _DEFAULTS.items():
        record[name] = np.full(len(cloud), value)
    standard = set(header.point_format.standard_dimension_names)
    for name, values in _extra_columns(cloud).items():
        record[name] = _fitted(name, values, header.point_format) if name in standard else values
    return record


def _quantization(points: arrays.FloatArray) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Return the offset and the step of each axis: a power of ten with which all points fit 32 bits."""
    if not len(points):
        return np.zeros(3), np.full(3, _FINEST_SCALE)
    low, high = points.min(axis=0).astype(np.float64), points.max(axis=0).astype(np.float64)
    offsets = np.round(low / 2 + high / 2)
    half = float(np.maximum(high - offsets, offsets - low).max())
    exponent = math.ceil(math.log10(half / (2**31 - 2))) if half > 0 else -math.inf
    return offsets, np.full(3, max(10.0**exponent, _FINEST_SCALE))


def _extra_columns(cloud: Cloud) -> Columns:
    """Return what is written beside coordinates and colours, by its name in the file."""
    columns: Columns = {}
    if cloud.normals is not None:
        columns.update(zip(NORMALS, cloud.normals.T, strict=True))
    for name, values in cloud.attributes.items():
        if name in columns or name in {"X", "Y", "Z", "x", "y", "z", *COLORS}:
            raise ValueError(f"attributes must not be called {name!r}: the file has that name already")
        if (values.ndim == 2 and not 1 <= values.shape[1] <= 3) or len(name) > 32:
            raise ValueError(
                f"attributes[{name!r}] must have 1 to 3 values per point and a name of at most 32 letters in "
                f"a LAS file, got shape {values.shape}"
            )
        columns[name] = values if values.ndim == 1 or values.shape[1] > 1 else values[:, 0]
    return columns


def _fitted(name: str, values: npt.NDArray[Any], point_format: Any) -> npt.NDArray[Any]:
    """Return values for a dimension that LAS has; intensities from 0 to 1 are spread over its 16 bits."""
    dimension = point_format.dimension_by_name(name)
    if dimension.dtype is not None and dimension.dtype.kind == "f":
        return np.asarray(values, dimension.dtype)
    if name == "intensity" and values.dtype.kind == "f" and ((values >= 0) & (values <= 1)).all():
        return np.asarray(np.rint(dimension.max * values), np.uint16)
    fits = (values >= dimension.min) & (values <= dimension.max) & (values == np.floor(values))
    if values.ndim != 1 or not fits.all():
        expected = f"whole numbers from {dimension.min} to {dimension.max}"
        expected += " or real ones from 0 to 1" * (name == "intensity")
        wrong = values[~fits][0] if values.ndim == 1 else f"shape {values.shape}"
        raise ValueError(f"attributes[{name!r}] must be {expected} in a LAS file, got {wrong}")
    return values.astype(np.int64)


def import_laspy() -> Any:
    """Return laspy, where it and lazrs are there."""
    try:
        import laspy
        import lazrs  # noqa: F401
    except ImportError as error:
        raise ImportError(_MISSING, name=error.name) from error
    return laspy
