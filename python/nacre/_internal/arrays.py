"""Validation of arrays: what comes in is checked once, here, and named in the error."""

from __future__ import annotations

import operator
import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre import _core

FloatArray = npt.NDArray[np.float32] | npt.NDArray[np.float64]

FARTHEST = 1e30
"""Positions that are farther away [m] are none: their squares are to be computed with."""

MOST_METRES = 50.0
"""The median depth [m] of an image whose unit can be right, as of the model."""


def as_array(name: str, value: npt.ArrayLike) -> npt.NDArray[Any]:
    """Return ``value`` as NumPy makes an array of it, of any dtype; nothing of it may be masked."""
    if np.ma.is_masked(value):
        raise TypeError(f"{name} must have no masked values, got some: fill them first, with NaN or with 0")
    try:
        return np.asarray(value)
    except (TypeError, ValueError) as error:  # what is no array says so itself; rows of different lengths
        kind = TypeError if isinstance(error, TypeError) else ValueError
        raise kind(f"{name} must be an array, got {type(value).__name__}: {error}") from None


def as_real(name: str, value: npt.ArrayLike) -> npt.NDArray[Any]:
    """Return ``value`` as an array of real numbers, in its dtype."""
    array = as_array(name, value)
    if array.dtype.kind not in "buif":
        raise TypeError(f"{name} must be an array of real numbers, got {_what_came(value, array)}")
    return array


def _what_came(value: npt.ArrayLike, array: npt.NDArray[Any]) -> str:
    """Say what came in place of an array of numbers: of a file how to read it."""
    if isinstance(value, str | os.PathLike):
        reads = "nacre.read_points(path) reads points, nacre.io.images.read_depth(path) a depth image"
        return f"{value!r}{f'; {reads}' if Path(value).suffix else ''}"
    is_none = array.ndim == 0 and array.dtype.kind == "O"
    return f"dtype {array.dtype}{f' ({type(value).__name__})' * is_none}"


def as_rows(array: npt.NDArray[Any], dtype: npt.DTypeLike) -> npt.NDArray[Any]:
    """
    Return an array in C order, itself where it is so already.

    NumPy lets a single row or column have any stride, a negative one too, which the C++ part does not take.
    What is too large for the dtype becomes infinite.
    """
    with np.errstate(over="ignore"):
        rows = np.ascontiguousarray(array, dtype=dtype)
    return rows if min(rows.strides, default=0) >= 0 and rows.flags.aligned else rows.copy()


def as_points(name: str, value: npt.ArrayLike) -> FloatArray:
    """
    Return ``value`` as a C-contiguous (N, 3) array of float32 or float64.

    float32 and float64 arrays that are already C-contiguous are returned as they are; other real dtypes
    become float64.
    """
    array = as_real(name, value)
    if array.ndim != 2 or array.shape[1] != 3:
        raise ValueError(f"{name} must have shape (N, 3), got {array.shape}")
    dtype = array.dtype if array.dtype in (np.float32, np.float64) else np.float64
    return as_rows(array, dtype)


def as_matching_points(name: str, value: npt.ArrayLike, like_name: str, num_points: int) -> FloatArray:
    """Return ``value`` as :func:`as_points` does, with one row for each of the points it belongs to."""
    array = as_points(name, value)
    if len(array) != num_points:
        raise ValueError(
            f"{name} must have one row per point of {like_name} ({num_points}), got {len(array)}"
        )
    return array


def as_unit_rows(name: str, value: npt.ArrayLike, like_name: str, num_points: int) -> npt.NDArray[np.float32]:
    """Return normals as float32 rows of unit length; NaN where a row is 0 or not finite."""
    given = as_matching_points(name, value, like_name, num_points)
    rows = as_rows(given, np.float32)
    with np.errstate(over="ignore", invalid="ignore"):
        is_other = np.abs(np.einsum("ij,ij->i", rows, rows) - 1.0) > 0.002
    if is_other.any():
        other = given[is_other].astype(np.float64)
        with np.errstate(invalid="ignore", divide="ignore"):
            other /= np.abs(other).max(axis=1, keepdims=True)
            other /= np.linalg.norm(other, axis=1, keepdims=True)
        rows = rows.copy()
        rows[is_other] = np.where(np.isfinite(other).all(axis=1, keepdims=True), other, np.nan)
    return rows


def as_values(name: str, value: npt.ArrayLike, size: int, of: str) -> npt.NDArray[Any]:
    """Return ``value`` as one real number for each of the ``size`` things it belongs to, in its dtype."""
    array = as_real(name, value)
    if array.shape != (size,):
        raise ValueError(f"{name} must have one entry per {of} ({size}), got shape {array.shape}")
    return array


def as_times(name: str, value: npt.ArrayLike) -> npt.NDArray[np.float64]:
    """Return ``value`` as a list of finite float64 times."""
    times = as_rows(as_real(name, value), np.float64)
    if times.ndim != 1 or times.shape != np.shape(value) or not np.isfinite(times).all():
        raise ValueError(f"{name} must be a list of finite times, got shape {np.shape(value)}")
    return times


def as_vector(name: str, value: npt.ArrayLike, size: int) -> npt.NDArray[np.float64]:
    """Return ``value`` as ``size`` finite float64 numbers."""
    array = as_rows(as_real(name, value), np.float64)
    if array.shape != (size,) or not np.isfinite(array).all():
        raise ValueError(f"{name} must be {size} finite numbers, got {value!r}")
    return array


def as_pose(name: str, value: npt.ArrayLike) -> npt.NDArray[np.float64]:
    """Return ``value`` as a rigid 4x4 float64 matrix."""
    array = as_rows(as_real(name, value), np.float64)
    if array.shape != (4, 4):
        raise ValueError(f"{name} must be a 4x4 matrix, got shape {array.shape}")
    rotation = array[:3, :3]
    is_rigid = (
        np.isfinite(array).all()
        and np.abs(rotation).max() < 2
        and np.allclose(rotation @ rotation.T, np.eye(3), atol=1e-5)
        and np.linalg.det(rotation) > 0
        and np.allclose(array[3], (0, 0, 0, 1))
    )
    if not is_rigid:
        raise ValueError(f"{name} must be a rigid transform (rotation and translation), got\n{array}")
    if np.abs(array[:3, 3]).max() > FARTHEST:
        raise ValueError(f"{name} must lead at most {FARTHEST:g} m away, got\n{array}")
    return array


def as_poses(name: str, value: npt.ArrayLike) -> npt.NDArray[np.float64]:
    """Return ``value`` as (N, 4, 4) rigid float64 matrices; one that is not finite is missing: all NaN."""
    array = as_rows(as_real(name, value), np.float64)
    if array.ndim != 3 or array.shape[1:] != (4, 4):
        raise ValueError(f"{name} must have shape (N, 4, 4), got {array.shape}")
    is_present = np.isfinite(array).all(axis=(1, 2))
    if np.isinf(array).any():
        array = np.where(is_present[:, None, None], array, np.nan)
    present = np.flatnonzero(is_present)
    rotation = array[present, :3, :3]
    with np.errstate(over="ignore", invalid="ignore"):
        is_rigid = (
            np.isclose(rotation @ rotation.transpose(0, 2, 1), np.eye(3), atol=1e-5).all(axis=(1, 2))
            & (np.linalg.det(rotation) > 0)
            & np.isclose(array[present, 3], (0, 0, 0, 1)).all(axis=1)
        )
    if not is_rigid.all():
        bad = present[np.argmin(is_rigid)]
        raise ValueError(f"{name}[{bad}] must be a rigid transform, got\n{array[bad]}")
    is_near = np.abs(array[present, :3, 3]).max(axis=1, initial=0) <= FARTHEST
    if not is_near.all():
        bad = present[np.argmin(is_near)]
        raise ValueError(f"{name}[{bad}] must lead at most {FARTHEST:g} m away, got\n{array[bad]}")
    return array


def stacked_poses(poses: Iterable[npt.ArrayLike | None]) -> npt.NDArray[np.float64]:
    """Return poses as (N, 4, 4), all NaN where there is none."""
    missing = np.full((4, 4), np.nan)
    return np.array([missing if pose is None else pose for pose in poses], np.float64).reshape(-1, 4, 4)


def as_depth(name: str, value: npt.ArrayLike, depth_scale: float = 1.0) -> npt.NDArray[np.float32]:
    """
    Return a depth image as (H, W) float32 metres.

    A copy is made unless ``value`` is C-contiguous float32 in metres.

    ``depth_scale`` is in stored units per metre. 0 and 65535 of integer images become NaN.
    """
    array = as_real(name, value)
    if array.ndim != 2:
        raise ValueError(f"{name} must have shape (H, W), got {array.shape}")
    scale = as_scale("depth_scale", depth_scale)
    if scale == 1.0 and array.dtype.kind in "ui":
        _check_whole_metres(name, array)
    return in_metres(array, scale)


def in_metres(stored: npt.NDArray[Any], scale: float) -> npt.NDArray[np.float32]:
    """Return a stored depth image in float32 metres."""
    if stored.dtype == np.uint16:
        return _core.depth_from_raw(as_rows(stored, np.uint16), scale)
    metres = as_rows(stored, np.float32)
    if stored.dtype.kind in "bui":
        metres = np.where((stored == 0) | (stored == 65535), np.float32(np.nan), metres)
    if scale != 1.0:
        with np.errstate(over="ignore"):
            metres = metres / np.float32(scale)
    return metres


def _check_whole_metres(name: str, stored: npt.NDArray[Any]) -> None:
    """Raise where integers cannot be metres: those of most cameras are millimetres."""
    measured = stored[(stored > 0) & (stored != 65535)]
    if measured.size and np.median(measured) > MOST_METRES:
        raise ValueError(
            f"depth_scale must be the stored units per metre of {name} (1000 for millimetres, 5000 for TUM), "
            f"got 1, with which its median depth is {np.median(measured):g} m"
        )


def as_colors(name: str, value: npt.ArrayLike, shape: tuple[int, ...]) -> npt.NDArray[np.uint8]:
    """Return colours as uint8 of a shape: integers from 0 to 255 as they are, floats from 0 to 1 scaled."""
    array = as_real(name, value)
    if array.shape != shape:
        alpha = f": leave alpha out with {name}[..., :3]" * (array.shape == (*shape[:-1], 4))
        raise ValueError(f"{name} must have shape {shape}, got {array.shape}{alpha}")
    if array.dtype == np.uint8:
        return as_rows(array, np.uint8)
    if array.dtype.kind == "b":
        raise TypeError(f"{name} must be integers from 0 to 255 or floats from 0 to 1, got bool")
    largest = 1 if array.dtype.kind == "f" else 255
    if array.size and not (array.min() >= 0 and array.max() <= largest):
        of_bytes = f"; give {name}.astype(np.uint8)" * bool(array.min() >= 0 and array.max() <= 255)
        raise ValueError(
            f"{name} must be integers from 0 to 255 or floats from 0 to 1, got {array.dtype} from "
            f"{array.min():g} to {array.max():g}{of_bytes}"
        )
    return np.rint(array * (255 / largest)).astype(np.uint8) if largest == 1 else as_rows(array, np.uint8)


def as_mask(name: str, value: npt.ArrayLike | None, shape: tuple[int, int]) -> npt.NDArray[np.uint8]:
    """Return a mask as (H, W) uint8, 1 where a pixel is used; an empty array for None."""
    if value is None:
        return np.zeros((0, 0), dtype=np.uint8)
    array = as_real(name, value)
    if array.shape != shape:
        raise ValueError(f"{name} must have the depth image's shape {shape}, got {array.shape}")
    return as_rows(array != 0, np.uint8)


def as_levels(name: str, value: npt.ArrayLike | None, shape: tuple[int, int]) -> npt.NDArray[np.uint8]:
    """Return an image of levels as (H, W) uint8; an empty array for None."""
    if value is None:
        return np.zeros((0, 0), dtype=np.uint8)
    array = as_real(name, value)
    if array.shape != shape:
        raise ValueError(f"{name} must have the depth image's shape {shape}, got {array.shape}")
    if array.dtype.kind not in "bui" or (array.size and not (array.min() >= 0 and array.max() <= 255)):
        raise ValueError(f"{name} must be of integers from 0 to 255, got {array.dtype}")
    return as_rows(array, np.uint8)


def as_attributes(
    name: str, value: Mapping[str, npt.ArrayLike] | None, shape: tuple[int, int]
) -> list[tuple[str, npt.NDArray[np.float32]]]:
    """Return named images, (H, W) or (H, W, C), as float32 arrays with a row for each pixel."""
    images = []
    if not isinstance(value, Mapping | None):
        raise TypeError(f"{name} must be a mapping of names to images, got {type(value).__name__}")
    for key, image in (value or {}).items():
        if not isinstance(key, str) or not key:
            raise TypeError(f"{name} must be named by words, got {key!r}")
        array = as_real(f"{name}[{key!r}]", image)
        if array.shape[:2] != shape or array.ndim not in (2, 3) or array.size == 0:
            raise ValueError(
                f"{name}[{key!r}] must have the depth image's shape {shape}, or {(*shape, 'C')} with "
                f"C channels, got {array.shape}"
            )
        rows = array.reshape(shape[0] * shape[1], -1)
        images.append((key, as_rows(rows, np.float32)))
    return images


def as_dtype(values: npt.NDArray[np.float64], dtype: np.dtype[Any]) -> npt.NDArray[Any]:
    """Return means in the type of what they are of: rounded and in range for integers."""
    if dtype.kind == "f":
        return values.astype(dtype)
    if dtype.kind == "b":
        return values >= 0.5
    info = np.iinfo(dtype)
    # The largest float64 that the type can hold: its own maximum may round up and out of range.
    largest = float(info.max) if int(float(info.max)) <= info.max else np.nextafter(float(info.max), 0.0)
    return np.clip(np.rint(values), float(info.min), largest).astype(dtype)


def localize(points: FloatArray) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.float64]]:
    """
    Split points into float32 coordinates about an origin and the origin.

    So far-away coordinates keep their digits.

    float32 points come back as they are, with origin 0.
    """
    if points.dtype == np.float32:
        return points, np.zeros(3)  # type: ignore[return-value]
    # Any place among the points will do.
    sample = points[:: max(1, len(points) // 1000)]
    finite = sample[np.isfinite(sample).all(axis=1)]
    if len(finite) == 0:
        finite = points[np.isfinite(points).all(axis=1)]
    with np.errstate(over="ignore"):
        origin = np.round(finite.mean(axis=0, dtype=np.float64)) if len(finite) else np.zeros(3)
    if not np.isfinite(origin).all():
        origin = np.zeros(3)
    # Many rows side by side: NumPy is slow on rows of three.
    local = np.empty(points.shape, np.float32)
    width = 256
    end = len(points) // width * width
    for part, shift in ((slice(0, end), np.tile(origin, width)), (slice(end, None), origin)):
        with np.errstate(over="ignore", invalid="ignore"):
            np.subtract(
                points[part].reshape(-1, shift.size),
                shift,
                out=local[part].reshape(-1, shift.size),
                casting="same_kind",
            )
    return local, origin


def as_triangles(name: str, value: npt.ArrayLike, num_vertices: int) -> npt.NDArray[np.int32]:
    """Return ``value`` as a C-contiguous (N, 3) int32 array of indices of ``num_vertices`` vertices."""
    array = as_array(name, value)
    if array.dtype.kind not in "iu" and array.size:
        raise TypeError(f"{name} must be an array of integers, got dtype {array.dtype}")
    if array.ndim != 2 or array.shape[1] != 3 or len(array) == 0:
        raise ValueError(f"{name} must have shape (N, 3) with at least one row, got {array.shape}")
    for index in (array.min(), array.max()):
        if not 0 <= index < num_vertices:
            raise ValueError(f"{name} must hold indices of the {num_vertices} vertices, got {index}")
    return as_rows(array, np.int32)


def as_count(name: str, value: Any, *, minimum: int = 0) -> int:
    """Return ``value`` as an int of at least ``minimum``."""
    try:
        count = operator.index(value)
    except TypeError:
        raise TypeError(f"{name} must be an integer, got {value!r}") from None
    if not minimum <= count < 2**31:
        expected = f"of at least {minimum}" if count < minimum else "below 2^31"
        raise ValueError(f"{name} must be an integer {expected}, got {count}")
    return count


def as_number(name: str, value: Any) -> float:
    """Return ``value`` as a float, NaN and infinite ones too; words are no numbers."""
    try:
        if isinstance(value, str | bytes):
            raise TypeError
        return float(value)
    except (TypeError, ValueError):
        raise TypeError(f"{name} must be a number, got {value!r}") from None
    except OverflowError:
        raise ValueError(f"{name} must be a number that a float can hold, got {value!r}") from None


def as_length(name: str, value: Any) -> float:
    """Return ``value`` as a float that is not negative and not NaN."""
    length = as_number(name, value)
    if not length >= 0:
        raise ValueError(f"{name} must be at least 0, got {length}")
    return length


def as_scale(name: str, value: Any) -> float:
    """Return ``value`` as the stored units per metre of a depth image."""
    scale = as_number(name, value)
    if not 1e-30 <= scale <= 1e30:
        raise ValueError(f"{name} must be a positive number of stored units per metre, got {value!r}")
    return scale


def as_flag(name: str, value: Any) -> bool:
    """Return ``value`` as a bool, which it must be."""
    if not isinstance(value, bool | np.bool_):
        raise TypeError(f"{name} must be True or False, got {value!r}")
    return bool(value)


def as_camera(name: str, value: Any) -> _core.Camera:
    """Return ``value``, which must be a camera."""
    if not isinstance(value, _core.Camera):
        raise TypeError(f"{name} must be a nacre.Camera, got {type(value).__name__}{_way_to_a_camera(value)}")
    return value


def _way_to_a_camera(value: Any) -> str:
    """Say how to make a camera of what was given in place of one."""
    if hasattr(value, "camera"):
        return "; give its .camera"
    if isinstance(value, str | os.PathLike):
        return "; give nacre.read_camera(path).camera"
    is_matrix = isinstance(value, np.ndarray) and value.shape == (3, 3)
    return "; nacre.Camera.from_matrix(width, height, K) makes one" * is_matrix
