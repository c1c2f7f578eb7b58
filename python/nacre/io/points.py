"""Point files, whichever their format."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy.typing as npt

from nacre._internal.arrays import as_flag
from nacre._internal.guided import guided
from nacre.io import e57, las, npz, pcd, ply, xyz
from nacre.io.cloud import Cloud, check_cloud, cloud_of
from nacre.io.raw import require_path

_FORMATS: dict[str, Any] = {
    ".ply": ply,
    ".pcd": pcd,
    ".las": las,
    ".laz": las,
    ".e57": e57,
    ".xyz": xyz,
    ".npz": npz,
}

SUFFIXES = tuple(_FORMATS)
FINITE_SUFFIXES = (".las", ".laz", ".e57")
"""Of formats that have no points that are not finite."""
STREAMED_SUFFIXES = (".ply", ".pcd", ".las", ".laz")
"""Of formats that can be written in pieces."""


@guided()
def read_points(path: str | os.PathLike[str]) -> Cloud:
    """
    Read a point file.

    Parameters
    ----------
    path : path-like
        - ``.ply``: ascii, binary little or big endian; elements other than ``vertex`` are checked and left
          out. Lines of the header that are none of PLY's become comments, with a warning.
        - ``.pcd``: ascii, binary, binary_compressed.
        - ``.las``, ``.laz`` (extra ``las``): any version; colours as 8 bits, all else as attributes.
          What the header says of the coordinate system is left out.
        - ``.e57`` (extra ``e57``): all scans, each in its place; normals (libE57's extension
          ``nor``), colours and ``intensity``.
        - ``.xyz``: text, a point a line, values between blanks, commas or semicolons: x y z, then r g b from
          0 to 255, then nx ny nz; or as a first line of names says.
        - ``.npz``: arrays ``points``, and ``normals``, ``colors`` and others if there are any.

    Returns
    -------
    Cloud
        Points, and, where the file has them, normals, colours, every other field, comments, and the image
        shape of an organised cloud. Coordinates come in the type in which they are stored; NaN is kept.

    Raises
    ------
    FileFormatError
        When the file is broken: nothing is ever read in part. The error names path, place and reason.
    OSError
        When the file cannot be read (FileNotFoundError, IsADirectoryError, ...).
    ImportError
        When the format needs a package that is not installed; the message says how to install it.
    ValueError
        When the suffix is none of the above.

    Notes
    -----
    Formats: G. Turk, "The PLY Polygon File Format", 1994; "The PCD file format", Point Cloud Library; "LAS
    specification 1.4", ASPRS, 2019; ASTM E2807, "3D imaging data exchange".
    """
    require_point_suffix(path)
    cloud: Cloud = _FORMATS[Path(path).suffix.lower()].read_cloud(path)
    return cloud


@guided(write_ascii="it is binary=False", pointcloud="points", filename="path")
def write_points(
    path: str | os.PathLike[str],
    points: Any,
    *,
    normals: npt.ArrayLike | None = None,
    colors: npt.ArrayLike | None = None,
    attributes: Mapping[str, npt.ArrayLike] | None = None,
    comments: Sequence[str] = (),
    binary: bool = True,
) -> None:
    """
    Write a point file, whole or not at all.

    An earlier file of this name stays as it was until the new one is complete and on the disk.

    Parameters
    ----------
    path : path-like
        - ``.ply``: ``x y z nx ny nz red green blue``, then the attributes.
        - ``.pcd``, version 0.7: ``x y z normal_x normal_y normal_z rgb``, then the attributes.
        - ``.las``, ``.laz``, version 1.4 (extra ``las``): coordinates in steps of a micrometre, coarser where
          points lie more than 4 km apart; ``.copc.laz`` is a COPC file, whose octree has levels of detail;
          colours, attributes that LAS knows (``intensity``,
          ``classification``, ``gps_time``, ...), and all else, the normals too, as extra bytes.
        - ``.e57`` (extra ``e57``): one scan, coordinates in float32 about an origin in float64; normals
          (libE57's extension ``nor``), colours, ``intensity`` and comments. What else there is has no place,
          which a warning tells.
        - ``.xyz``: text with a first line of names.
        - ``.npz``: each field an array, exactly.
    points : (N, 3) array, or Cloud, Model, Reconstruction or Consolidated
        Coordinates. What has normals, colours and attributes of its own (a model its
        :meth:`~nacre.Model.cloud`) is written with them, where no others are given. float32 is stored as
        float, everything else as double, so that no digit is lost.
    normals : (N, 3) array, optional
        Stored by the same rule.
    colors : (N, 3) array of integers from 0 to 255, or of floats from 0 to 1, optional
        Red, green, blue.
    attributes : mapping of str to (N,) or (N, K) array, optional
        Further fields, stored in their own type (bool as uint8, float16 as float). As PLY has no 64-bit
        integers, they become 32-bit ones there if all values fit.
    comments : sequence of str
        Lines for the header; LAS and E57 have none.
    binary : bool
        Binary little-endian; else text, from which every number is read back exactly. Of PLY and PCD: XYZ is
        always text, the others never.

    Raises
    ------
    TypeError, ValueError
        When an argument does not fit; the message names it.
    ImportError
        When the format needs a package that is not installed; the message says how to install it.
    OSError
        When the file cannot be written (no such folder, no permission, a full disk); it has the path.
    """
    binary = as_flag("binary", binary)
    require_point_suffix(path)
    own = cloud_of(points)
    cloud = check_cloud(
        own.points,
        own.normals if normals is None else normals,
        own.colors if colors is None else colors,
        own.attributes if attributes is None else attributes,
    )
    _FORMATS[Path(path).suffix.lower()].write_cloud(path, cloud, comments=comments, binary=binary)


def read_chunks(path: str | os.PathLike[str], num_rows: int) -> Iterator[Cloud]:
    """
    Yield a point file in pieces of so many points, all with the same fields.

    Binary PLY and PCD files, LAS and LAZ are never in memory as a whole; :func:`is_streamed` tells it. Of LAS
    files every dimension comes. Errors are those of :func:`read_points`.
    """
    require_point_suffix(path)
    format = _FORMATS[Path(path).suffix.lower()]
    chunks = format.read_chunks(path, num_rows) if hasattr(format, "read_chunks") else None
    if chunks is not None:
        yield from chunks
        return
    cloud = read_points(path)
    for first in range(0, max(len(cloud), 1), num_rows):
        yield cloud[first : first + num_rows]


def count_points(path: str | os.PathLike[str]) -> int | None:
    """Return how many points the header of a PLY, LAS or LAZ file promises; None of other formats."""
    require_point_suffix(path)
    format = _FORMATS[Path(path).suffix.lower()]
    return format.count_points(path) if hasattr(format, "count_points") else None


def is_streamed(path: str | os.PathLike[str]) -> bool:
    """Say whether a point file can be read in pieces."""
    require_point_suffix(path)
    format = _FORMATS[Path(path).suffix.lower()]
    if format is las:
        return True
    return hasattr(format, "read_chunks") and format.read_chunks(path, 1) is not None


def write_chunks(
    path: str | os.PathLike[str], chunks: Iterable[Cloud], num_points: int, extremes: npt.NDArray[Any]
) -> None:
    """
    Write pieces of a cloud one after the other, whole or not at all.

    Parameters
    ----------
    path : path-like
        A file whose name ends in one of :data:`STREAMED_SUFFIXES`.
    chunks : iterable of Cloud
        At least one, all with the same fields.
    num_points : int
        Of all pieces.
    extremes : (2, 3) array
        Points between which all coordinates lie, from which a LAS file has its steps.

    Raises
    ------
    ValueError, OSError
        As :func:`write_points` does.
    """
    format = _FORMATS[Path(path).suffix.lower()]
    if format is las:
        las.write_chunks(path, chunks, num_points, extremes)
    else:
        format.write_chunks(path, chunks, num_points)


def needs_extremes(path: str | os.PathLike[str]) -> bool:
    """Say whether :func:`write_chunks` uses the bounds of the points."""
    return _FORMATS[Path(path).suffix.lower()] is las


def widen(extremes: npt.NDArray[Any], points: npt.NDArray[Any]) -> None:
    """Widen (2, 3) lowest and highest coordinates until they hold finite points."""
    for axis in range(3):  # column by column, for NumPy is slow on rows of three
        along = points[:, axis]
        extremes[0, axis] = along.min(initial=extremes[0, axis])
        extremes[1, axis] = along.max(initial=extremes[1, axis])


def holds(path: str | os.PathLike[str], field: str) -> bool:
    """Say whether the format of a file has a place for a field: normals, colors, or an attribute."""
    return field in getattr(_FORMATS[Path(path).suffix.lower()], "FIELDS", (field,))


def require_point_suffix(path: str | os.PathLike[str]) -> None:
    """Raise where point files do not end so."""
    require_path(path, "write_points(path, points) and read_points(path)")
    if Path(path).suffix.lower() not in _FORMATS:
        raise ValueError(f"point files end in {', '.join(_FORMATS)}, got {os.fspath(path)!r}")
