"""Camera files: the plain recording's ``camera.json`` and Open3D's intrinsics."""

from __future__ import annotations

import json
import logging
import math
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from nacre._core import Camera
from nacre.arrays import as_camera, as_scale
from nacre.errors import FileFormatError
from nacre.io.atomic import atomic_writer

_log = logging.getLogger(__name__)

_KEYS = {
    "pinhole": {"model", "width", "height", "fx", "fy", "cx", "cy", "distortion", "depth", "depth_scale"},
    "orthographic": {"model", "width", "height", "pixel_size", "depth_scale"},
}


@dataclass(frozen=True)
class CameraFile:
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
    try:
        document = json.loads(Path(path).read_text(encoding="utf-8"))
    except json.JSONDecodeError as error:
        raise FileFormatError(path, f"not a JSON file: {error.msg}", line=error.lineno) from error
    except UnicodeDecodeError as error:
        raise FileFormatError(path, "not a JSON file: it is not text") from error
    return camera_of(path, document)


def camera_of(path: str | os.PathLike[str], document: Any) -> CameraFile:
    """Return the camera that a JSON object of a file describes; see :func:`read_camera`."""
    if not isinstance(document, dict):
        raise FileFormatError(
            path, f"a camera file must hold a JSON object, this holds a {type(document).__name__}"
        )
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
    return CameraFile(camera, scale)


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

    def numbers(self, key: str, count: int) -> list[float]:
        value = self.get(key)
        if not isinstance(value, list) or len(value) != count:
            raise FileFormatError(self.path, f"{key} must be a list of {count} numbers, got {value!r}")
        return [self._checked(key, item) for item in value]

    def _checked(self, key: str, value: Any) -> float:
        if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
            raise FileFormatError(self.path, f"{key} must be a finite number, got {value!r}")
        return float(value)


def _plain(fields: _Fields) -> Camera:
    model = fields.get("model")
    if not isinstance(model, str) or model not in _KEYS:
        raise FileFormatError(fields.path, f"model must be 'pinhole' or 'orthographic', got {model!r}")
    unknown = sorted(set(fields.document) - _KEYS[model])
    if unknown:
        _log.warning(
            "%s: ignored keys that a %s camera does not have: %s", fields.path, model, ", ".join(unknown)
        )
    width, height = fields.integer("width"), fields.integer("height")
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
    return Camera(width=fields.integer("width"), height=fields.integer("height"), fx=fx, fy=fy, cx=cx, cy=cy)
