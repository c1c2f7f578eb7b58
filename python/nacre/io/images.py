"""Depth and colour images, in and out. PNG and JPEG need pillow, EXR needs OpenEXR, PGM and npy nothing."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from nacre._internal.guided import guided
from nacre._internal.pillow import import_pillow
from nacre.errors import FileFormatError, shown
from nacre.io.atomic import atomic_writer
from nacre.io.image_limits import check_exr, check_pixels, checked_png
from nacre.io.npy import read_npy_array, read_npy_header
from nacre.io.raw import check_padding, read_file

if TYPE_CHECKING:
    from PIL.Image import Image

DEPTH_SUFFIXES = (".png", ".pgm", ".npy", ".exr")
ATTRIBUTE_SUFFIXES = (".png", ".tif", ".tiff", ".jpg", ".jpeg", ".npy")
COLOR_SUFFIXES = (".png", ".jpg", ".jpeg", ".ppm", ".bmp", ".webp")

_COLOR_FORMATS = ("PNG", "JPEG", "PPM", "BMP", "WEBP")
_ATTRIBUTE_FORMATS = ("PNG", "TIFF", "JPEG")
_EXR_DEPTH_CHANNELS = ("Z", "depth", "Depth", "Y", "R")
_PGM_GAP = rb"(?:\s|#[^\n]*\n){1,1000}"
_PGM_HEADER = re.compile(_PGM_GAP.join((rb"P5", *3 * (rb"(\d{1,20})",))) + rb"\s")


@guided()
def read_depth(path: str | os.PathLike[str]) -> npt.NDArray[Any]:
    """
    Read a depth image as it is stored, without any scaling.

    Parameters
    ----------
    path : path-like
        A 16-bit PNG or PGM image, a ``.npy`` array, or an EXR image (channel Z, Y or R, or its only one).

    Returns
    -------
    (H, W) array
        uint16 for PNG and PGM, the stored type for ``.npy`` and EXR.

    Raises
    ------
    FileFormatError
        The file is damaged, or it is not a depth image (8 bit, colour, not two-dimensional).
    ImportError
        The format needs a package that is not installed; the message says how to install it.
    """
    path = Path(path)
    readers = {".png": _read_png, ".pgm": _read_pgm, ".npy": _read_npy, ".exr": _read_exr}
    reader = readers.get(path.suffix.lower())
    if reader is None:
        raise FileFormatError(path, f"a depth image must be one of {', '.join(DEPTH_SUFFIXES)}")
    stored = reader(path)
    if stored.ndim != 2 or stored.size == 0 or stored.dtype.kind not in "uif":
        raise FileFormatError(
            path, f"a depth image must be (H, W) numbers, this is {stored.shape} of {stored.dtype}"
        )
    return stored


@guided()
def read_color(path: str | os.PathLike[str]) -> npt.NDArray[np.uint8]:
    """
    Read a colour image as (H, W, 3) uint8 RGB; grey images are repeated, transparency is dropped.

    Raises
    ------
    FileFormatError
        The file is damaged or has more than 8 bits per channel.
    ImportError
        pillow is not installed.
    """
    return decode_color(read_file(path), path)


def decode_color(
    data: bytes, path: str | os.PathLike[str], size: tuple[int, int] | None = None
) -> npt.NDArray[np.uint8]:
    """Read a colour image from bytes, brought to a size (width, height); ``path`` names it in errors."""
    with decoded(data, path, _COLOR_FORMATS) as image:
        if image.mode.startswith(("I", "F")):
            raise FileFormatError(
                path, f"a colour image must have 8 bits per channel, this has mode {image.mode}"
            )
        rgb = image.convert("RGB")
        if size is not None and rgb.size != size:
            rgb = rgb.resize(size, import_pillow().Resampling.BOX)
        return np.array(rgb, dtype=np.uint8)


def read_attribute(path: str | os.PathLike[str]) -> npt.NDArray[np.float32]:
    """
    Read an image of anything, with the values that are stored, as (H, W) or (H, W, C) float32.

    Raises
    ------
    FileFormatError
        The file is damaged or holds no image.
    ImportError
        pillow is not installed, and the file is no ``.npy`` array.
    """
    path = Path(path)
    if path.suffix.lower() == ".npy":
        stored = _read_npy(path)
    else:
        with decoded(read_file(path), path, _ATTRIBUTE_FORMATS) as image:
            stored = np.array(image.convert("L") if image.mode in ("1", "P") else image)
    if stored.ndim not in (2, 3) or stored.size == 0 or stored.dtype.kind not in "buif":
        raise FileFormatError(
            path, f"an image must be (H, W) or (H, W, C) numbers, this is {stored.shape} of {stored.dtype}"
        )
    with np.errstate(over="ignore"):
        return np.ascontiguousarray(stored, dtype=np.float32)


def write_depth_png(path: str | os.PathLike[str], depth: npt.ArrayLike, *, fast: bool = False) -> None:
    """Write (H, W) uint16 stored depth units as a 16-bit PNG, atomically; ``fast`` compresses less."""
    array = np.ascontiguousarray(depth)
    if array.dtype != np.uint16 or array.ndim != 2:
        raise ValueError(f"depth must be (H, W) uint16, got {array.shape} of {array.dtype}")
    _write_image(path, array, "PNG", compress_level=1 if fast else 6)


def write_color_png(path: str | os.PathLike[str], color: npt.ArrayLike) -> None:
    """Write an (H, W, 3) uint8 RGB image as a PNG, atomically."""
    _write_image(path, _checked_color(color), "PNG")


def write_color_jpeg(path: str | os.PathLike[str], color: npt.ArrayLike) -> None:
    """Write an (H, W, 3) uint8 RGB image as a JPEG, atomically: in a tenth of a PNG's time, but not exact."""
    _write_image(path, _checked_color(color), "JPEG", quality=95)


def encode_jpeg(color: npt.ArrayLike) -> bytes:
    """Return an (H, W, 3) uint8 RGB image as a JPEG whose colours are as fine as its light."""
    stream = BytesIO()
    import_pillow().fromarray(_checked_color(color)).save(stream, "JPEG", quality=92, subsampling=0)
    return stream.getvalue()


def _checked_color(color: npt.ArrayLike) -> npt.NDArray[np.uint8]:
    array: npt.NDArray[Any] = np.ascontiguousarray(color)
    if array.dtype != np.uint8 or array.ndim != 3 or array.shape[2] != 3:
        raise ValueError(f"color must be (H, W, 3) uint8, got {array.shape} of {array.dtype}")
    return array


def _write_image(path: str | os.PathLike[str], array: npt.NDArray[Any], format: str, **options: Any) -> None:
    image = import_pillow().fromarray(array)
    with atomic_writer(path, named=False) as stream:
        image.save(stream, format=format, **options)


@contextmanager
def decoded(data: bytes, path: str | os.PathLike[str], formats: Sequence[str]) -> Iterator[Image]:
    """
    Decode an image of certain formats; whatever pillow raises for a damaged file becomes a FileFormatError.

    Other formats are not tried, some of which start programs (Ghostscript).
    """
    pillow = import_pillow()
    data = checked_png(path, data)
    try:
        image = pillow.open(BytesIO(data), formats=formats)
        check_pixels(path, *image.size, file_size=len(data), format=image.format)
        image.load()
    except (FileFormatError, MemoryError):
        raise
    except pillow.DecompressionBombError as error:
        raise FileFormatError(path, f"refused: {error}") from error
    except Exception as error:
        reason = "not an image" if isinstance(error, pillow.UnidentifiedImageError) else str(error)
        raise FileFormatError(path, f"the image is damaged or truncated: {reason}") from error
    with image:
        yield image


def _read_png(path: Path) -> npt.NDArray[Any]:
    with decoded(read_file(path), path, ("PNG",)) as image:
        if not image.mode.startswith("I"):
            raise FileFormatError(
                path,
                f"a depth image must have 16 bits and one channel, this is 8-bit with mode {image.mode}; "
                "save the depth itself, in millimetres say, not a picture of it",
            )
        return np.asarray(image).astype(np.uint16, copy=False)


def _read_pgm(path: Path) -> npt.NDArray[Any]:
    data = read_file(path)
    header = _PGM_HEADER.match(data)
    if header is None:
        raise FileFormatError(
            path, "expected a binary PGM header: P5, width, height, largest value", offset=0
        )
    width, height, largest = (int(field) for field in header.groups())
    if not 255 < largest < 65536:
        raise FileFormatError(path, f"a depth image must have 16 bits, this PGM's largest value is {largest}")
    if 0 in (width, height):
        raise FileFormatError(path, f"a depth image must have pixels, this PGM is {width} x {height}")
    expected = 2 * width * height
    if len(data) - header.end() < expected:
        raise FileFormatError(
            path,
            f"truncated: {expected} bytes of pixels expected, {len(data) - header.end()} found",
            offset=len(data),
        )
    check_padding(path, data, header.end() + expected)
    pixels = np.frombuffer(data, dtype=">u2", count=width * height, offset=header.end())
    return pixels.reshape(height, width).astype(np.uint16)


def _read_npy(path: Path) -> npt.NDArray[Any]:
    data = read_file(path)
    header = read_npy_header(path, data)
    if header.dtype.kind not in "buif" or len(header.shape) not in (2, 3) or min(header.shape) < 1:
        raise FileFormatError(
            path, f"an image must be (H, W) numbers, this is {shown(header.shape)} of {shown(header.dtype)}"
        )
    return read_npy_array(path, data, header)


def _read_exr(path: Path) -> npt.NDArray[Any]:
    try:
        import OpenEXR  # type: ignore[import-not-found, unused-ignore]
    except ImportError as error:
        raise ImportError('EXR images need OpenEXR: pip install "nacre[exr]"', name="OpenEXR") from error
    data = read_file(path)
    check_exr(path, data)
    try:
        with OpenEXR.File(BytesIO(data), separate_channels=True) as image:
            channels = {name: np.array(channel.pixels) for name, channel in image.channels().items()}
    except MemoryError:
        raise
    except Exception as error:
        raise FileFormatError(path, f"the image is damaged or truncated: {error}") from error
    names = [name for name in _EXR_DEPTH_CHANNELS if name in channels] or list(channels)
    if names[0] not in _EXR_DEPTH_CHANNELS and len(channels) > 1:
        raise FileFormatError(path, f"no channel Z, depth, Y or R among {', '.join(channels)}")
    return channels[names[0]]
