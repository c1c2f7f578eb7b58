"""E57 files (ASTM E2807): points of laser scanners, by pye57."""

from __future__ import annotations

import errno
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre._internal.arrays import localize
from nacre._internal.warned import warn_of_loss
from nacre.errors import FileFormatError
from nacre.io.atomic import atomic_path
from nacre.io.cloud import Cloud, check_comments
from nacre.io.e57_scan import AXES, COLORS, NORMALS, read_description, read_normals, write_scan
from nacre.io.raw import MAX_COMMENTS, require_regular

_MISSING = 'E57 files need pye57: pip install "nacre[e57]"'
FIELDS = ("normals", "colors", "intensity")
"""What there is a place for beside coordinates."""


def read_cloud(path: str | os.PathLike[str]) -> Cloud:
    """
    Read an E57 file; :func:`nacre.read_points` says what is returned and raised.

    All scans come together, each in its place; points that are marked as invalid are left out.
    """
    pye57 = _import_pye57()
    size = require_regular(path).stat().st_size
    with Path(path).open("rb"):  # else the library says nothing of a folder, or of a file without permission
        pass
    try:
        with pye57.E57(os.fspath(path)) as file:
            for i in range(file.scan_count):
                _check_count(path, file.get_header(i).point_count, size)
            scans = [
                file.read_scan(i, intensity=True, colors=True, ignore_missing_fields=True)
                for i in range(file.scan_count)
            ]
            normals = [read_normals(file, pye57.libe57, i) for i in range(file.scan_count)]
            told = [line for i in range(file.scan_count) for line in read_description(file, i).splitlines()]
    except (MemoryError, FileFormatError):
        raise
    except Exception as error:  # of several kinds, the library's own among them
        raise FileFormatError(path, f"not a readable E57 file: {_reason(error)}", offset=0) from error
    points = _joined(scans, AXES)
    known = [rows for rows in normals if rows is not None]
    colors, intensity = _joined(scans, COLORS), _joined(scans, ("intensity",))
    return Cloud(
        np.zeros((0, 3)) if points is None else points,
        np.concatenate(known) if known and len(known) == len(normals) else None,
        colors=None if colors is None else colors.astype(np.uint8),
        attributes={} if intensity is None else {"intensity": intensity[:, 0]},
        comments=tuple(dict.fromkeys(told))[:MAX_COMMENTS],
        path=Path(path),
    )


def _check_count(path: str | os.PathLike[str], count: int, size: int) -> None:
    """Refuse a number of points that cannot be in the file, before memory is set aside for it."""
    if count > 8 * size:  # less than a bit of a point
        raise FileFormatError(path, f"{count} points are promised in {size} bytes", offset=0)


def _joined(scans: list[Any], names: tuple[str, ...]) -> npt.NDArray[Any] | None:
    """Return fields side by side, of all scans one after the other; None where a scan has them not."""
    if not scans or not all(name in scan for scan in scans for name in names):
        return None
    return np.concatenate([np.column_stack([scan[name] for name in names]) for scan in scans])


def write_cloud(
    path: str | os.PathLike[str], cloud: Cloud, *, comments: Sequence[str] = (), binary: bool = True
) -> None:
    """
    Write points as one scan of an E57 file; :func:`nacre.write_points` has the parameters.

    Coordinates are float32 about a place that the scan's pose gives in float64.
    """
    pye57 = _import_pye57()
    if not len(cloud) or not np.isfinite(cloud.points).all():
        raise ValueError("points must be finite, and at least one, in an E57 file, got others")
    lines = check_comments(comments)
    local, origin = localize(cloud.points)
    columns = dict(zip(AXES, _columns(local, np.float32), strict=True))
    if cloud.normals is not None:  # 0, where one is not known
        known = np.isfinite(cloud.normals).all(axis=1, keepdims=True)
        columns.update(zip(NORMALS, _columns(np.where(known, cloud.normals, 0), np.float32), strict=True))
    if cloud.colors is not None:
        columns.update(zip(COLORS, _columns(cloud.colors, np.uint8), strict=True))
    left_out = []
    for name, values in cloud.attributes.items():
        if name == "intensity" and values.ndim == 1 and np.isfinite(values).all():
            columns[name] = values.astype(np.float32)
        else:
            left_out.append(name)
    warn_of_loss(path, left_out)
    with atomic_path(path) as temporary:
        try:
            with pye57.E57(os.fspath(temporary), mode="w") as file:
                write_scan(file, pye57.libe57, columns, Path(path).stem, origin, "\n".join(lines))
        except pye57.libe57.E57Exception as error:
            raise OSError(errno.EIO, _reason(error), os.fspath(path)) from error


def _columns(rows: npt.NDArray[Any], dtype: npt.DTypeLike) -> npt.NDArray[Any]:
    return np.ascontiguousarray(rows.T, dtype)


def _reason(error: Exception) -> str:
    """Return the first line of an error, which the library follows by places in its own source."""
    return str(error).partition("\n")[0] or type(error).__name__


def _import_pye57() -> Any:
    try:
        import pye57
    except ImportError as error:
        raise ImportError(_MISSING, name="pye57") from error
    return pye57
