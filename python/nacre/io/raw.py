"""Whole files as bytes, tables of text in them, and errors that name the file."""

from __future__ import annotations

import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from io import BytesIO
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import numpy.typing as npt

from nacre.errors import FileFormatError
from nacre.io.atomic import atomic_writer

MAX_COMMENTS = 10_000

_BLOCK_BYTES = 1 << 15
_HEAD_BYTES = 1 << 16
_PADDING = b" \t\r\n\0"
_BYTES_PER_ROW_GUESS = 32
_IS_SPACE = np.zeros(256, dtype=bool)
_IS_SPACE[list(b" \t\n\r\v\f")] = True


def require_path(path: object, calls: str) -> None:
    """Raise where a path is none; the calls that show where it stands."""
    if not isinstance(path, str | os.PathLike):
        raise TypeError(f"path must be a path, as in {calls}, got {type(path).__name__}")


def read_file(path: str | os.PathLike[str], most: int | None = None) -> bytes:
    """Return the bytes of a regular file, ``most`` at most; a pipe or a device is refused."""
    size = require_regular(path).stat().st_size
    if most is not None and size > most:
        raise FileFormatError(path, f"larger than what it can hold: {size} bytes, more than {most}")
    return Path(path).read_bytes()


def read_head(path: str | os.PathLike[str], last: bytes) -> bytes:
    """Return the bytes of a regular file to the end of a header, whose last line begins so, or beyond."""
    head = b""
    with require_regular(path).open("rb") as stream:
        while block := stream.read(_HEAD_BYTES):
            head += block
            at = head.find(last)
            if at >= 0 and (head.find(b"\n", at + 1) >= 0 or len(block) < _HEAD_BYTES):
                break
    return head


def read_records(
    path: str | os.PathLike[str],
    offset: int,
    dtype: np.dtype[Any],
    count: int,
    num_rows: int,
    *,
    are_last: bool,
) -> Iterator[npt.NDArray[Any]]:
    """
    Yield ``count`` records of a file from a byte on, so many at a time; of none an empty piece.

    Where they are the last of the file, what follows must be padding.
    """
    with Path(path).open("rb") as stream:
        stream.seek(offset)
        for first in range(0, max(count, 1), num_rows):
            wanted = min(num_rows, count - first)
            rows = np.fromfile(stream, dtype, wanted)
            if len(rows) < wanted:
                raise FileFormatError(path, "the file became shorter while it was read", offset=offset)
            yield rows
        end = stream.tell()
        if are_last and stream.read(_HEAD_BYTES).strip(_PADDING):
            raise FileFormatError(path, "bytes follow the data that the header promises", offset=end)


def require_regular(path: str | os.PathLike[str]) -> Path:
    """Return a path; raise where it is neither a regular file nor a folder."""
    mode = Path(path).stat().st_mode
    if not stat.S_ISREG(mode) and not stat.S_ISDIR(mode):
        raise FileFormatError(path, "not a regular file")
    return Path(path)


def read_text(path: str | os.PathLike[str], most: int | None = None) -> str:
    """Return the text of a regular file of UTF-8."""
    return text_of(path, read_file(path, most))


def text_of(path: str | os.PathLike[str], data: bytes) -> str:
    """Return the text of a file's bytes, which must be UTF-8."""
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError as error:
        raise FileFormatError(path, "not text: these bytes are no UTF-8", offset=error.start) from None


@contextmanager
def file_writer(path: str | os.PathLike[str]) -> Iterator[BinaryIO]:
    """Open a file through :func:`atomic_writer`; every OSError names ``path`` itself."""
    try:
        with atomic_writer(path) as stream:
            yield stream
    except OSError as error:
        raise OSError(error.errno, error.strerror, os.fspath(path)) from error


def excerpt(text: bytes) -> str:
    """Return text from a file in a form and length that is fit for an error message."""
    shown = text[:40].decode("ascii", errors="backslashreplace")
    return repr(shown) + ("..." if len(text) > 40 else "")


def decode(text: bytes) -> str:
    """Return text of unknown encoding."""
    try:
        return text.decode("utf-8")
    except UnicodeDecodeError:
        return text.decode("latin-1")


def check_padding(path: str | os.PathLike[str], data: bytes, end: int) -> None:
    """Refuse a file that goes on after the data its header promises; blanks and zero bytes are padding."""
    if data[end:].strip(_PADDING):
        raise FileFormatError(
            path, f"{len(data) - end} bytes follow the data that the header promises", offset=end
        )


@dataclass(frozen=True)
class TextBlock:
    """Some consecutive rows of a :class:`TextTable`."""

    path: str | os.PathLike[str]
    data: bytes
    start: int
    end: int
    widths: npt.NDArray[np.intp]
    """Number of values in each row."""

    @cached_property
    def firsts(self) -> npt.NDArray[np.intp]:
        """Index of each row's first value."""
        return np.cumsum(self.widths) - self.widths

    @cached_property
    def tokens(self) -> list[bytes]:
        """The values of all rows as text."""
        return self.data[self.start : self.end].split()

    @cached_property
    def values(self) -> npt.NDArray[np.float64]:
        """The values of all rows as numbers."""
        try:
            if self.data.find(b"_", self.start, self.end) < 0:  # Python would read 1_0 as 10
                return np.array(self.tokens, dtype=np.float64)
        except ValueError:
            pass
        token = next(i for i, text in enumerate(self.tokens) if not _is_number(text))
        raise self.error(token, f"{excerpt(self.tokens[token])} is not a number")

    def error(self, token: int, reason: str) -> FileFormatError:
        """Return the error for the value with this index, with its line."""
        row = int(np.searchsorted(self.firsts, token, side="right")) - 1
        line = 1 + self.data.count(b"\n", 0, self.start)
        for text in self.data[self.start : self.end].split(b"\n"):
            if text.split():
                row -= 1
            if row < 0:
                break
            line += 1
        return FileFormatError(self.path, reason, line=line)

    def require_width(self, width: int) -> None:
        """Raise where a row has not this many values."""
        wrong = np.flatnonzero(self.widths != width)
        if len(wrong):
            found = self.widths[wrong[0]]
            raise self.error(int(self.firsts[wrong[0]]), f"expected {width} values, found {found}")

    def column(self, tokens: npt.NDArray[np.intp], dtype: np.dtype[Any], name: str) -> npt.NDArray[Any]:
        """Return the values with these indices, checked to be of ``dtype``."""
        values = self.values[tokens]
        if dtype.kind == "f":
            with np.errstate(over="ignore"):
                return values.astype(dtype)
        limits = np.iinfo(dtype)
        fits = (values >= limits.min) & (values <= limits.max) & (values == np.floor(values))
        wrong = np.flatnonzero(~fits)
        if len(wrong):
            token = int(tokens[wrong[0]])
            raise self.error(token, f"{excerpt(self.tokens[token])} does not fit {name} of type {dtype.name}")
        if dtype.itemsize < 8:
            return values.astype(dtype)
        try:  # float64 holds whole numbers exactly up to 2**53 only
            return np.array([int(self.tokens[token]) for token in tokens], dtype=dtype)
        except (ValueError, OverflowError):
            raise self.error(int(tokens[0]), f"{name} holds a value that does not fit {dtype.name}") from None


def code_lines(data: bytes) -> Iterator[tuple[int, bytes]]:
    """Yield numbered lines without comments; a backslash at its end joins a line with the next."""
    parts: list[bytes] = []
    number = 0
    for number, raw in enumerate(BytesIO(data.removeprefix(b"\xef\xbb\xbf")), 1):
        line = raw.partition(b"#")[0].rstrip()
        parts.append(line.removesuffix(b"\\"))
        if not line.endswith(b"\\"):
            yield number, b" ".join(parts)
            parts.clear()
    yield number, b" ".join(parts)


def number_of(text: str) -> float:
    """Return a number written in ASCII digits; raise a ValueError where Python alone would take it (1_0)."""
    if not text.isascii() or "_" in text:
        raise ValueError(f"{excerpt(text.encode())} is not a number")
    return float(text)


def _is_number(text: bytes) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return b"_" not in text


class TextTable:
    """Rows of numbers in a text, one row a line, blank lines passed over; read forward in blocks."""

    def __init__(self, path: str | os.PathLike[str], data: bytes, offset: int) -> None:
        self.path = path
        self.data = data
        self.offset = offset

    def blocks(self, num_rows: int, what: str) -> Iterator[TextBlock]:
        """Yield the next ``num_rows`` rows in blocks; ``what`` names them in the error if there are fewer."""
        data, missing = self.data, num_rows
        num_bytes = missing * _BYTES_PER_ROW_GUESS
        while missing > 0:
            start = self.offset
            if start >= len(data):
                reason = f"the header promises {num_rows} {what}, the file ends after {num_rows - missing}"
                raise FileFormatError(self.path, reason, offset=len(data))
            num_bytes = min(2 * num_bytes, _BLOCK_BYTES)
            newline = data.find(b"\n", start + num_bytes)
            end = len(data) if newline < 0 else newline + 1
            codes = np.frombuffer(data, np.uint8, end - start, start)
            is_space = _IS_SPACE[codes]
            is_first = ~is_space
            is_first[1:] &= is_space[:-1]
            line_ends = np.append(np.flatnonzero(codes == ord("\n")), end - start)
            widths = np.diff(np.searchsorted(np.flatnonzero(is_first), line_ends), prepend=0)
            rows = np.flatnonzero(widths)[:missing]
            if len(rows) == missing:
                end = min(start + int(line_ends[rows[-1]]) + 1, len(data))
            self.offset = end
            missing -= len(rows)
            if len(rows):
                yield TextBlock(self.path, data, start, end, widths[rows])
