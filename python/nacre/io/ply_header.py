"""The header of a PLY file: which elements there are and what properties each of them has."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from nacre.errors import FileFormatError, meant
from nacre.io.raw import MAX_COMMENTS, decode, excerpt

TYPES = {
    name: np.dtype(code)
    for names, code in (
        ("char int8", "i1"),
        ("uchar uint8", "u1"),
        ("short int16", "i2"),
        ("ushort uint16", "u2"),
        ("int int32", "i4"),
        ("uint uint32", "u4"),
        ("float float32", "f4"),
        ("double float64", "f8"),
        ("int64", "i8"),
        ("uint64", "u8"),
    )
    for name in names.split()
}
BYTE_ORDERS: dict[str, Literal["<", ">"]] = {"binary_little_endian": "<", "binary_big_endian": ">"}
_FORMATS = ("ascii", *BYTE_ORDERS)
_KEYWORDS = ("format", "element", "property", "end_header")
_MAX_ELEMENTS = 1_000
_MAX_ENTRIES = 5_000


@dataclass(frozen=True)
class Property:
    """One value of each row of an element, or one list of values."""

    name: str
    dtype: np.dtype[Any]
    count_dtype: np.dtype[Any] | None
    """Type of a list's length; None for a single value."""


@dataclass(frozen=True)
class Element:
    """A table of the file."""

    name: str
    num_rows: int
    properties: tuple[Property, ...]
    line: int
    """The header's line, counted from 1, that names it."""


@dataclass(frozen=True)
class Header:
    """
    What a PLY file says about itself.

    Attributes
    ----------
    format : str
        ``ascii``, ``binary_little_endian`` or ``binary_big_endian``.
    elements : tuple of Element
    comments, obj_info : tuple of str
        The text of these lines; among the comments, what stray lines say.
    stray_lines : tuple of int
        The lines, counted from 1, that are none of the format's: some programs leave out ``comment``.
    newline : bytes
        What ends a line.
    size : int
        Bytes of the header: where the data begins.
    """

    format: str
    elements: tuple[Element, ...]
    comments: tuple[str, ...]
    obj_info: tuple[str, ...]
    stray_lines: tuple[int, ...]
    newline: bytes
    size: int


def read_header(path: str | os.PathLike[str], data: bytes) -> Header:
    """Return the header at the start of ``data``, the bytes of the file ``path``."""
    if not data:
        raise FileFormatError(path, "the file is empty")
    newline = b"\r" if data.startswith(b"ply\r") and not data.startswith(b"ply\r\n") else b"\n"
    parser = _Parser()
    position, number = 0, 0
    while True:
        number += 1
        if position >= len(data):
            raise FileFormatError(path, "the file ends before end_header", line=number)
        end = data.find(newline, position)
        line = data[position : end if end >= 0 else len(data)].strip()
        position = end + 1 if end >= 0 else len(data)
        try:
            if number == 1:
                if line != b"ply":
                    raise ValueError(f"a PLY file begins with 'ply', not {excerpt(line)}")
            elif line == b"end_header":
                return parser.finish(newline, position)
            else:
                parser.take(line, number)
        except ValueError as error:
            raise FileFormatError(path, str(error), line=number) from None


class _Parser:
    """The header's lines as read so far."""

    def __init__(self) -> None:
        self._format: str | None = None
        self._elements: dict[str, tuple[int, int, dict[str, Property]]] = {}
        self._properties: dict[str, Property] | None = None
        self._num_entries = self._num_notes = 0
        self._notes: dict[str, list[str]] = {"comment": [], "obj_info": []}
        self._stray_lines: list[int] = []

    def take(self, line: bytes, number: int) -> None:
        """Take in the line of this number, or raise a ValueError that says what is wrong with it."""
        first, *rest = line.split(maxsplit=1) or [b""]
        keyword = decode(first)
        if keyword in self._notes:
            self._count_note()
            self._notes[keyword].append(decode(rest[0]).strip() if rest else "")
            return
        if keyword not in _KEYWORDS[:-1]:
            self._pass_over(line, keyword, number)
            return
        words = [decode(word) for word in rest[0].split()] if rest else []
        self._num_entries += 1
        if self._num_entries > _MAX_ENTRIES:
            raise ValueError(f"more than {_MAX_ENTRIES} lines of elements and properties")
        if keyword == "format":
            if self._format is not None:
                raise ValueError("a second line 'format'")
            if len(words) != 2 or words[0] not in _FORMATS or words[1] != "1.0":
                raise ValueError(
                    f"expected 'format', one of {', '.join(_FORMATS)}, and '1.0', got {excerpt(line)}"
                )
            self._format = words[0]
        elif keyword == "element":
            if len(words) != 2 or not (words[1].isascii() and words[1].isdigit() and len(words[1]) < 20):
                raise ValueError(f"expected 'element', a name and a number of rows, got {excerpt(line)}")
            if len(self._elements) == _MAX_ELEMENTS:
                raise ValueError(f"more than {_MAX_ELEMENTS} elements")
            if words[0] in self._elements:
                raise ValueError(f"a second element {excerpt(words[0].encode())}")
            self._properties = {}
            self._elements[words[0]] = number, int(words[1]), self._properties
        else:
            self._take_property(words, line)

    def _pass_over(self, line: bytes, keyword: str, number: int) -> None:
        """Keep a line that is none of the format's as a comment, but not one that is almost of the format."""
        near = meant(keyword, _KEYWORDS)
        if near or not decode(line).isprintable():
            raise ValueError(f"unknown keyword in the header: {excerpt(line)}{near}")
        self._count_note()
        self._stray_lines.append(number)
        if line:
            self._notes["comment"].append(decode(line))

    def _count_note(self) -> None:
        self._num_notes += 1
        if self._num_notes > MAX_COMMENTS:
            raise ValueError(f"more than {MAX_COMMENTS} comments")

    def _take_property(self, words: list[str], line: bytes) -> None:
        if self._properties is None:
            raise ValueError("a property before the first element")
        is_list = words[:1] == ["list"]
        if len(words) != (4 if is_list else 2):
            raise ValueError(
                f"expected 'property TYPE NAME' or 'property list TYPE TYPE NAME', got {excerpt(line)}"
            )
        *types, name = words[1:] if is_list else words
        for type_name in types:
            if type_name not in TYPES:
                raise ValueError(f"unknown type {excerpt(type_name.encode())}; known are {', '.join(TYPES)}")
        if name in self._properties:
            raise ValueError(f"a second property {excerpt(name.encode())} of the same element")
        count_dtype = TYPES[types[0]] if is_list else None
        if count_dtype is not None and count_dtype.kind == "f":
            raise ValueError(f"the length of a list cannot be of type {types[0]}")
        self._properties[name] = Property(name, TYPES[types[-1]], count_dtype)

    def finish(self, newline: bytes, size: int) -> Header:
        """Return the header at its last line."""
        if self._format is None:
            raise ValueError("the header has no line 'format'")
        elements = tuple(
            Element(name, num_rows, tuple(properties.values()), line)
            for name, (line, num_rows, properties) in self._elements.items()
        )
        for element in elements:
            if element.num_rows and not element.properties:
                raise ValueError(f"element {element.name} has rows but no properties")
        notes = {keyword: tuple(lines) for keyword, lines in self._notes.items()}
        return Header(
            self._format,
            elements,
            notes["comment"],
            notes["obj_info"],
            tuple(self._stray_lines),
            newline,
            size,
        )
