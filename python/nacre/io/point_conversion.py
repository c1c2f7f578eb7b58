"""Points on their way into a file of another format: a piece at a time, where both formats allow it."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.io.cloud import Cloud
from nacre.io.las import is_las, silent_among
from nacre.io.points import (
    FINITE_SUFFIXES,
    STREAMED_SUFFIXES,
    holds,
    is_streamed,
    read_chunks,
    read_points,
    widen,
    write_chunks,
    write_points,
)

_ROWS_AT_ONCE = 1 << 18


@dataclass(frozen=True)
class Converted:
    """
    What was written, and what was not.

    Attributes
    ----------
    num_points : int
        Points in the file.
    fields : list of str
        What it has of each beside the place.
    not_finite_left_out : int
        Points that are not finite, for which the format has no place.
    not_numbers_left_out : list of str
        Attributes that are no numbers.
    """

    num_points: int
    fields: list[str]
    not_finite_left_out: int
    not_numbers_left_out: list[str]


def convert_points(source: str | os.PathLike[str], output: str | os.PathLike[str]) -> Converted:
    """
    Write a point file's points to another, as far as its format can hold them.

    Binary PLY and PCD files, LAS and LAZ become PLY, PCD, LAS, LAZ and COPC files without ever being in
    memory as a whole. Errors are those of :func:`nacre.read_points` and :func:`nacre.write_points`.
    """
    if is_streamed(source):
        return write_pieces(output, lambda: read_chunks(source, _ROWS_AT_ONCE), may_be_silent=is_las(source))
    cloud = read_points(source)
    return write_pieces(output, lambda: [cloud])


def write_pieces(
    output: str | os.PathLike[str], pieces: Callable[[], Iterable[Cloud]], *, may_be_silent: bool = False
) -> Converted:
    """Write a cloud whose pieces can be asked for more than once; attributes may say nothing, as in LAS."""
    look = _Look()
    for cloud in pieces():
        look.at(cloud)
    suffix = Path(output).suffix.lower()
    is_finite = suffix in FINITE_SUFFIXES
    kept = [name for name in look.numbers if not may_be_silent or name not in look.silent]

    def written() -> Iterator[Cloud]:
        for cloud in pieces():
            attributes = {name: cloud.attributes[name] for name in kept}
            rest = replace(cloud, attributes=attributes, path=None)
            yield rest[np.isfinite(rest.points).all(axis=1)] if is_finite and look.num_not_finite else rest

    num_points = look.num_points - (look.num_not_finite if is_finite else 0)
    if suffix in STREAMED_SUFFIXES and all(_is_told_by_type(output, name, look.types[name]) for name in kept):
        write_chunks(output, written(), num_points, look.extremes)
    else:
        cloud = _joined(list(written()))
        write_points(output, cloud, comments=cloud.comments)
    return Converted(
        num_points,
        [name for name in (*look.own, *kept) if holds(output, name)],
        look.num_points - num_points,
        sorted(set(look.types) - set(look.numbers)),
    )


def _is_told_by_type(output: str | os.PathLike[str], name: str, dtype: np.dtype[Any]) -> bool:
    """Say whether the type of an attribute tells how it is stored, which else all of its values do."""
    if is_las(output):
        return not (name == "intensity" and dtype.kind == "f")
    return not (Path(output).suffix.lower() == ".ply" and dtype.kind in "iu" and dtype.itemsize == 8)


def _joined(pieces: list[Cloud]) -> Cloud:
    """Return pieces with the same fields as one cloud."""
    first = pieces[0]
    if len(pieces) == 1:
        return first

    def all_of(values: Callable[[Cloud], npt.NDArray[Any] | None]) -> npt.NDArray[Any] | None:
        return None if values(first) is None else np.concatenate([values(piece) for piece in pieces])

    points = all_of(lambda piece: piece.points)
    assert points is not None
    attributes = {
        name: np.concatenate([piece.attributes[name] for piece in pieces]) for name in first.attributes
    }
    normals, colors = all_of(lambda piece: piece.normals), all_of(lambda piece: piece.colors)
    return Cloud(points, normals, colors, attributes, comments=first.comments)


@dataclass
class _Look:
    """What a first look at all pieces finds."""

    num_points: int = 0
    num_not_finite: int = 0
    bounds: npt.NDArray[np.float64] = field(default_factory=lambda: np.outer([np.inf, -np.inf], np.ones(3)))
    own: list[str] = field(default_factory=list)
    types: dict[str, np.dtype[Any]] = field(default_factory=dict)
    silent: set[str] = field(default_factory=set)  # attributes with the value of a LAS file that says nothing

    @property
    def extremes(self) -> npt.NDArray[np.float64]:
        return self.bounds[np.isfinite(self.bounds).all(axis=1)]

    @property
    def numbers(self) -> list[str]:
        return [name for name, dtype in self.types.items() if dtype.kind in "buif"]

    def at(self, cloud: Cloud) -> None:
        if not self.num_points:
            self.own = [name for name in ("normals", "colors") if getattr(cloud, name) is not None]
            self.types = {name: values.dtype for name, values in cloud.attributes.items()}
            self.silent = set(self.numbers)
        self.num_points += len(cloud)
        self.silent = silent_among(self.silent, cloud)
        is_finite = np.isfinite(cloud.points).all(axis=1)
        self.num_not_finite += len(cloud) - int(is_finite.sum())
        widen(self.bounds, cloud.points if is_finite.all() else cloud.points[is_finite])
