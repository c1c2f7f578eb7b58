"""Camera files: the plain recording's ``camera.json`` and Open3D's intrinsics."""

from __future__ import annotations

import json
import math
import os
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from nacre._internal.arrays import as_camera, as_scale
from nacre._internal.guided import GuidedNames, guided
from nacre._internal.warned import warn
from nacre.camera import Camera
from nacre.errors import FileFormatError, shown
from nacre.io.atomic import atomic_writer
from nacre.io.image_limits import MAX_PIXELS
from nacre.io.json_files import read_json

_MOST_BYTES = 1 << 15
# Lenses that are none: what lies beyond makes points that are not finite.
_FOCAL_LENGTHS = (1e-3, 1e9)
_LARGEST_DISTORTION = 1e6
_KEYS = {
    "pinhole": {"model", "width", "height", "fx", "fy", "cx", "cy", "distortion", "depth", "depth_scale"},
    "orthographic": {"model", "width", "height", "pixel_size", "depth_scale"},
}


@dataclass(frozen=True)
class CameraFile(GuidedNames):
    """
    What a camera file says.

    Attributes
    ----------
    camera : Camera
        The camera.
    depth_scale : float or None
        Stored depth units per metre; None where the file does not tell.
    """

    camera: Camera
    depth_scale: float | None


@guided()
def read_camera(path: str | os.PathLike[str]) -> CameraFile:
    """
    Read a camera from a plain recording's ``camera.json`` or from Open3D's intrinsics JSON.

    Open3D stores ``intrinsic_matrix`` column by column.

    Parameters
    ----------
    path : path-like
        The file to read.

    Returns
    -------
    CameraFile

    Raises
    ------
    FileFormatError
        Names the file and the key that is missing or wrong.
    """
    return camera_of(path, read_json(path, _MOST_BYTES))


def camera_of(path: str | os.PathLike[str], document: Any) -> CameraFile:
    """Return the camera that a JSON object of a file describes; see :func:`read_camera`."""
    if not isinstance(document, dict):
        raise FileFormatError(path, f"a camera file must hold a JSON object, got {shown(document)}")
    fields = _Fields(path, document)
    scale = fields.number("depth_scale") if "depth_scale" in document else None
    if scale is not None and scale <= 0:
        raise FileFormatError(path, f"depth_scale must be positive stored units per metre, got {scale!r}")
    try:
        camera = _open3d(fields) if "intrinsic_matrix" in document else _plain(fields)
    except FileFormatError:
        raise
    except ValueError as error:
        raise FileFormatError(path, str(error)) from error
    return CameraFile(check_lens(path, camera), scale)


def check_lens(path: str | os.PathLike[str], camera: Camera) -> Camera:
    """Return a camera that a file describes; refuse a lens whose points would not be finite."""
    for key, low, high, values in (
        ("fx and fy", *_FOCAL_LENGTHS, (camera.fx, camera.fy) if camera.model == "pinhole" else ()),
        ("distortion", 0.0, _LARGEST_DISTORTION, camera.distortion),
    ):
        if not all(low <= abs(value) <= high for value in values):
            raise FileFormatError(path, f"{key} must be from {low:g} to {high:g}, got {list(values)}")
    return camera


@guided()
def write_camera(path: str | os.PathLike[str], camera: Camera, depth_scale: float | None = None) -> None:
    """
    Write a camera as a plain recording's ``camera.json``, atomically.

    Parameters
    ----------
    path : path-like
        The file to write.
    camera : Camera
        The camera.
    depth_scale : float, optional
        Stored depth units per metre.
    """
    as_camera("camera", camera)
    document: dict[str, Any] = {"model": camera.model, "width": camera.width, "height": camera.height}
    if camera.model == "orthographic":
        document["pixel_size"] = camera.pixel_size
    else:
        document.update(fx=camera.fx, fy=camera.fy, cx=camera.cx, cy=camera.cy)
        document.update(distortion=list(camera.distortion), depth=camera.depth)
    if depth_scale is not None:
        document["depth_scale"] = as_scale("depth_scale", depth_scale)
    with atomic_writer(path) as stream:
        stream.write((json.dumps(document, indent=2) + "\n").encode())


class _Fields:
    """Typed access to a JSON object; an error names the file and the key."""

    def __init__(self, path: str | os.PathLike[str], document: dict[str, Any]) -> None:
        self.path = path
        self.document = document

    def get(self, key: str) -> Any:
        if key not in self.document:
            hint = "a pinhole camera has model, width, height, fx, fy, cx and cy"
            raise FileFormatError(self.path, f"the key {key!r} is missing; {hint}")
        return self.document[key]

    def number(self, key: str) -> float:
        return self._checked(key, self.get(key))

    def integer(self, key: str) -> int:
        value = self.number(key)
        if not value.is_integer():
            raise FileFormatError(self.path, f"{key} must be a whole number, got {value!r}")
        return int(value)

    def size(self) -> tuple[int, int]:
        width, height = self.integer("width"), self.integer("height")
        if not (width > 0 and height > 0 and width * height <= MAX_PIXELS):
            reason = f"width and height must be positive and give at most {MAX_PIXELS} pixels"
            raise FileFormatError(self.path, f"{reason}, got {width} x {height}")
        return width, height

    def numbers(self, key: str, count: int) -> list[float]:
        value = self.get(key)
        if not isinstance(value, list) or len(value) != count:
            raise FileFormatError(self.path, f"{key} must be a list of {count} numbers, got {shown(value)}")
        return [self._checked(key, item) for item in value]

    def _checked(self, key: str, value: Any) -> float:
        number = math.nan
        if isinstance(value, (int, float)) and not isinstance(value, bool):
            with suppress(OverflowError):
                number = float(value)
        if not math.isfinite(number):
            raise FileFormatError(self.path, f"{key} must be a finite number, got {shown(value)}")
        return number


def _plain(fields: _Fields) -> Camera:
    model = fields.get("model")
    if not isinstance(model, str) or model not in _KEYS:
        raise FileFormatError(fields.path, f"model must be 'pinhole' or 'orthographic', got {shown(model)}")
    unknown = sorted(set(fields.document) - _KEYS[model])
    if unknown:
        warn(f"{fields.path}: ignored keys that a {model} camera does not have: {', '.join(unknown)}")
    width, height = fields.size()
    if model == "orthographic":
        return Camera.orthographic(width=width, height=height, pixel_size=fields.number("pixel_size"))
    return Camera(
        width=width,
        height=height,
        **{key: fields.number(key) for key in ("fx", "fy", "cx", "cy")},
        distortion=fields.numbers("distortion", 5) if "distortion" in fields.document else [0.0] * 5,
        depth=str(fields.document.get("depth", "z")),
    )


def _open3d(fields: _Fields) -> Camera:
    matrix = fields.numbers("intrinsic_matrix", 9)
    fx, below_fx, zero, skew, fy, below_fy, cx, cy, one = matrix
    if (zero, below_fy, one) != (0, 0, 1) or below_fx != 0 or skew != 0:
        raise FileFormatError(
            fields.path,
            "intrinsic_matrix must be [fx, 0, 0, 0, fy, 0, cx, cy, 1], column by column and without skew, "
            f"got {matrix}",
        )
    width, height = fields.size()
    return Camera(width=width, height=height, fx=fx, fy=fy, cx=cx, cy=cy)
