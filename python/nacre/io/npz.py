"""NPZ files: points as NumPy keeps arrays."""

from __future__ import annotations

import os
import zipfile
from collections.abc import Sequence
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.errors import FileFormatError, shown
from nacre.io.cloud import Cloud, Columns, check_cloud, check_comments, with_attributes
from nacre.io.npy import read_npy_array, read_npy_header
from nacre.io.raw import file_writer, read_file

_OWN = ("points", "normals", "colors", "comments")
_LARGEST_RATIO = 1032  # of deflate


def read_cloud(path: str | os.PathLike[str]) -> Cloud:
    """Read the arrays of an NPZ file; :func:`nacre.read_points` says what is returned and raised."""
    members = read_arrays(path)
    if "points" not in members:
        found = ", ".join(members) or "nothing"
        raise FileFormatError(path, f"there is no array points in it, but {found}", offset=0)
    comments = members.pop("comments", np.zeros(0, "U1"))
    if comments.dtype.kind != "U" or comments.ndim != 1:
        raise FileFormatError(path, "comments must be a list of texts", offset=0)
    attributes = {name: array for name, array in members.items() if name not in _OWN}
    try:
        cloud = check_cloud(members["points"], members.get("normals"), members.get("colors"), attributes)
    except (ValueError, TypeError) as error:
        raise FileFormatError(path, str(error), offset=0) from error
    return Cloud(
        cloud.points, cloud.normals, cloud.colors, cloud.attributes, tuple(comments.tolist()), path=Path(path)
    )


def read_arrays(path: str | os.PathLike[str]) -> Columns:
    """Return the arrays of an NPZ file by their names; FileFormatError where it is damaged."""
    data = read_file(path)
    arrays: Columns = {}
    try:
        with zipfile.ZipFile(BytesIO(data)) as archive:
            for member in archive.infolist():
                name = member.filename.removesuffix(".npy")
                if member.file_size > _LARGEST_RATIO * len(data):
                    raise FileFormatError(path, f"{name} claims to have {member.file_size} bytes", offset=0)
                arrays[name] = _array(path, name, archive.read(member))
    except (FileFormatError, MemoryError):
        raise
    except Exception as error:  # of zipfile and zlib, of many kinds
        raise FileFormatError(path, f"not a readable .npz archive: {error}", offset=0) from error
    return arrays


def _array(path: str | os.PathLike[str], name: str, data: bytes) -> npt.NDArray[Any]:
    header = read_npy_header(path, data)
    if header.dtype.kind not in "buifU" or header.dtype.itemsize == 0 or min(header.shape, default=0) < 0:
        reason = f"{name} must be an array of numbers, this is {shown(header.shape)} of {shown(header.dtype)}"
        raise FileFormatError(path, reason, offset=0)
    return read_npy_array(path, data, header)


def write_cloud(
    path: str | os.PathLike[str], cloud: Cloud, *, comments: Sequence[str] = (), binary: bool = True
) -> None:
    """Write each field as an array of its own, exactly; :func:`nacre.write_points` has the parameters."""
    columns: dict[str, npt.NDArray[Any]] = {"points": cloud.points}
    if cloud.normals is not None:
        columns["normals"] = cloud.normals
    if cloud.colors is not None:
        columns["colors"] = cloud.colors
    columns = with_attributes(columns, cloud.attributes)
    for name in cloud.attributes:
        if "/" in name or name in _OWN:
            raise ValueError(f"attributes must not be called {name!r} in an NPZ file")
    lines = check_comments(comments)
    if any(lines):
        columns["comments"] = np.array(lines)
    write_arrays(path, columns)


def write_arrays(path: str | os.PathLike[str], columns: Columns, *, compressed: bool = False) -> None:
    """Write arrays by their names to an NPZ file, the same bytes at all times."""
    method = zipfile.ZIP_DEFLATED if compressed else zipfile.ZIP_STORED
    with file_writer(path) as stream, zipfile.ZipFile(stream, "w") as archive:
        for name, array in columns.items():
            entry = zipfile.ZipInfo(f"{name}.npy")
            entry.compress_type = method
            with archive.open(entry, "w", force_zip64=True) as member:
                np.lib.format.write_array(member, array, allow_pickle=False)
