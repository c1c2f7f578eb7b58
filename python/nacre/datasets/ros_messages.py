"""Images and cameras in messages of ROS."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre._internal.warned import warn
from nacre.camera import Camera
from nacre.datasets.rational_lens import polynomial_of
from nacre.errors import FileFormatError
from nacre.io.cameras import check_lens
from nacre.io.images import decode_color, decoded

IMAGE, COMPRESSED_IMAGE = "sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage"
CAMERA_INFO = "sensor_msgs/msg/CameraInfo"
MILLIMETRES, METRES = ("16UC1", "mono16", "Z16"), ("32FC1",)
CHANNELS = {"rgb8": (0, 1, 2), "bgr8": (2, 1, 0), "rgba8": (0, 1, 2), "bgra8": (2, 1, 0), "mono8": (0, 0, 0)}

# What is read of a message; of arrays, the type of their values.
_FIELDS: dict[str, dict[str, type | str]] = {
    IMAGE: {"height": int, "width": int, "encoding": str, "is_bigendian": int, "step": int, "data": "u1"},
    COMPRESSED_IMAGE: {"format": str, "data": "u1"},
    CAMERA_INFO: {"height": int, "width": int, "k": "f8", "d": "f8"},
}


def check_fields(message: Any, kind: str, place: Path) -> None:
    """Refuse a message that has not the fields of its kind: recordings bring their own definitions."""
    for name, wanted in _FIELDS.get(kind, {}).items():
        value = _field(message, name)
        if isinstance(wanted, str):
            is_right = isinstance(value, np.ndarray) and value.dtype == wanted
        else:
            is_right = isinstance(value, wanted) and not (isinstance(value, int) and value < 0)
        if not is_right or (name == "k" and value.size != 9):
            raise FileFormatError(place, f"not a {kind} of ROS: its {name} is {str(value)[:40]}")


def _field(message: Any, name: str) -> Any:
    """Return a field, or None; some have capitals in ROS 1."""
    return getattr(message, name, getattr(message, name.upper(), None))


def pixels(message: Any, place: Path) -> npt.NDArray[Any]:
    """Return the pixels of an uncompressed image, (H, W) or (H, W, C)."""
    encoding = message.encoding
    if encoding in CHANNELS or encoding == "8UC1":
        dtype, channels = np.dtype("u1"), 1 if encoding in ("mono8", "8UC1") else len(encoding) - 1
    else:
        dtype, channels = np.dtype("f4" if encoding in METRES else "u2"), 1
    dtype = dtype.newbyteorder(">" if message.is_bigendian else "<")
    row = message.width * channels * dtype.itemsize
    data = np.asarray(message.data, np.uint8).reshape(-1)
    if message.step < row or len(data) < message.height * message.step:
        raise FileFormatError(place, f"the image of {message.width} x {message.height} is cut short")
    rows = data[: message.height * message.step].reshape(message.height, message.step)[:, :row]
    image = np.ascontiguousarray(rows).view(dtype).reshape(message.height, message.width, channels)
    return image[..., 0] if channels == 1 else image


def compressed_depth(message: Any, place: Path) -> npt.NDArray[Any]:
    """Return the pixels of a compressedDepth image: a header of 12 bytes, then a PNG of 16 bits."""
    data = bytes(message.data)
    start = data.find(b"\x89PNG")
    if start < 0 or "32FC1" in message.format:
        raise FileFormatError(place, f"compressed depth must be a PNG of 16 bits, this is {message.format!r}")
    with decoded(data[start:], place, ("PNG",)) as image:
        return np.array(image, dtype=np.uint16)


def without_tail(data: bytes) -> bytes:
    """Return an image of ROS 1 without the depth units that RealSense's recorder writes behind its end."""
    at = 12  # sequence number and time stamp
    try:
        for fixed in (8, 5):  # after frame_id: height, width; after the encoding: endianness and step
            at += 4 + struct.unpack_from("<I", data, at)[0] + fixed
        return data[: at + 4 + struct.unpack_from("<I", data, at)[0]]
    except struct.error:
        return data


def intrinsics(info: Any) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Return the matrix and the distortion of a camera_info."""
    return np.asarray(_field(info, "k")).reshape(3, 3), np.asarray(_field(info, "d"))


def have_one_lens(info: Any, other: Any) -> bool:
    """Say whether two camera_info have the same matrix, to a hundredth of the focal length."""
    matrix = intrinsics(info)[0]
    return np.allclose(intrinsics(other)[0], matrix, rtol=0.01, atol=0.01 * matrix[0, 0])


def camera_of(info: Any, place: Path) -> Camera:
    """Return the camera of a camera_info; a ValueError says what is wrong with it."""
    matrix, _ = intrinsics(info)
    camera = Camera(
        info.width, info.height, matrix[0, 0], matrix[1, 1], matrix[0, 2], matrix[1, 2],
        distortion=_distortion(info),
    )  # fmt: skip
    return check_lens(place, camera)


def _distortion(info: Any) -> list[float]:
    """Return k1 k2 p1 p2 k3; what this form can't hold is told."""
    matrix, d = intrinsics(info)
    model = getattr(info, "distortion_model", "") or "plumb_bob"
    if not d.any() or (model != "equidistant" and len(d) in (4, 5)):
        return [float(c) for c in d[:5]] if len(d) in (4, 5) else [0.0] * 5
    if model != "rational_polynomial" or len(d) < 8 or not np.isfinite(d).all() or d[8:].any():
        warn(f"the distortion of the depth camera ({model}, {len(d)} coefficients) is left out")
        return [0.0] * 5
    radius = np.hypot(info.width, info.height) / (2 * matrix[0, 0])
    (k1, k2, k3), error = polynomial_of(d[[0, 1, 4, 5, 6, 7]], radius)
    if error * matrix[0, 0] > 1:
        warn(f"the lens is known to {error * matrix[0, 0]:.1f} pixels at the edges of the images")
    return [k1, k2, float(d[2]), float(d[3]), k3]


def depth_of(message: Any, depth_scale: float, place: Path) -> npt.NDArray[np.float32]:
    """Return a depth image [m] of a message, raw or compressed; integers are divided by the scale."""
    is_raw = hasattr(message, "encoding")
    encoding = message.encoding if is_raw else message.format.split(";")[0].strip()
    if encoding not in MILLIMETRES + METRES:
        known = ", ".join(MILLIMETRES + METRES)
        raise FileFormatError(place, f"depth images are {known}, this one is {encoding}")
    image = pixels(message, place) if is_raw else compressed_depth(message, place)
    metres = np.array(image if encoding in METRES else image / depth_scale, np.float32)
    metres[~(metres > 0) | ~np.isfinite(metres) | (image == 65535)] = np.nan
    return metres


def color_of(message: Any, place: Path) -> npt.NDArray[np.uint8]:
    """Return a colour image of a message, raw or compressed."""
    if not hasattr(message, "encoding"):
        return decode_color(bytes(message.data), place)
    if message.encoding not in CHANNELS:
        raise FileFormatError(place, f"colour images are {', '.join(CHANNELS)}, this is {message.encoding}")
    image = pixels(message, place)
    image = image if image.ndim == 3 else image[..., None]
    return np.ascontiguousarray(image[..., CHANNELS[message.encoding]])
