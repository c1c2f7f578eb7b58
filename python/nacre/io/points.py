"""Point files, whichever their format."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import ModuleType

import numpy.typing as npt

from nacre._internal.arrays import as_flag
from nacre._internal.guided import guided
from nacre._internal.point_exchange import ArrayOfPoints
from nacre.io import pcd, ply
from nacre.io.cloud import Cloud, cloud_of

_FORMATS = {".ply": ply, ".pcd": pcd}


def read_points(path: str | os.PathLike[str]) -> Cloud:
    """
    Read a point file.

    Parameters
    ----------
    path : path-like
        A ``.ply`` file (ascii, binary little or big endian; elements other than ``vertex`` are checked and
        left out) or a ``.pcd`` file (ascii, binary, binary_compressed).

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
    ValueError
        When the suffix is none of the above.

    Notes
    -----
    Formats: G. Turk, "The PLY Polygon File Format", 1994; "The PCD file format", Point Cloud Library.
    """
    cloud: Cloud = _format_of(path).read_cloud(path)
    return cloud


@guided(write_ascii="it is binary=False", pointcloud="points", filename="path")
def write_points(
    path: str | os.PathLike[str],
    points: npt.ArrayLike | ArrayOfPoints,
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
        A ``.ply`` file (``x y z nx ny nz red green blue``, then the attributes) or a ``.pcd`` file,
        version 0.7 (``x y z normal_x normal_y normal_z rgb``, then the attributes).
    points : (N, 3) array, or Cloud, Model or Consolidated
        Coordinates. What has normals, colours and attributes of its own is written with them, where no others
        are given. float32 is stored as float, everything else as double, so that no digit is lost.
    normals : (N, 3) array, optional
        Stored by the same rule.
    colors : (N, 3) array of integers from 0 to 255, or of floats from 0 to 1, optional
        Red, green, blue.
    attributes : mapping of str to (N,) or (N, K) array, optional
        Further fields, stored in their own type (bool as uint8, float16 as float). As PLY has no 64-bit
        integers, they become 32-bit ones there if all values fit.
    comments : sequence of str
        Lines for the header.
    binary : bool
        Binary little-endian; else text, from which every number is read back exactly.

    Raises
    ------
    TypeError, ValueError
        When an argument does not fit; the message names it.
    OSError
        When the file cannot be written (no such folder, no permission, a full disk); it has the path.
    """
    binary = as_flag("binary", binary)
    if isinstance(points, ArrayOfPoints):
        own = cloud_of(points)
        points = own.points
        normals = own.normals if normals is None else normals
        colors = own.colors if colors is None else colors
        attributes = own.attributes if attributes is None else attributes
    _format_of(path).write_cloud(
        path, points, normals=normals, colors=colors, attributes=attributes, comments=comments, binary=binary
    )


def _format_of(path: str | os.PathLike[str]) -> ModuleType:
    if not isinstance(path, str | os.PathLike):
        raise TypeError(
            "path must be a path, as in write_points(path, points) and read_points(path), "
            f"got {type(path).__name__}"
        )
    suffix = Path(path).suffix.lower()
    if suffix not in _FORMATS:
        raise ValueError(f"point files end in {' or '.join(_FORMATS)}, got {os.fspath(path)!r}")
    return _FORMATS[suffix]
