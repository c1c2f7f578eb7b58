"""Pictures as the bytes of image files."""

from __future__ import annotations

from io import BytesIO
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre._internal.pillow import import_pillow

_QUALITIES = (80, 65, 50)


def encode_png(image: npt.NDArray[np.uint8]) -> bytes:
    """
    Return an image as the bytes of a PNG file.

    Parameters
    ----------
    image : numpy.ndarray of uint8, shape (H, W), (H, W, 3) or (H, W, 4)
        Grey, RGB or RGBA.

    Returns
    -------
    bytes

    Raises
    ------
    ImportError
        When pillow is missing, with the command that installs it.
    """
    return _encode(_as_picture(image), "PNG")


def encode_small(image: npt.NDArray[np.uint8], max_bytes: int, *, lossless: bool = False) -> bytes:
    """
    Return an image as the bytes of a WebP file, coarser or of fewer pixels where it would be too large.

    Parameters
    ----------
    image : numpy.ndarray of uint8, shape (H, W), (H, W, 3) or (H, W, 4)
        Grey, RGB or RGBA.
    max_bytes : int
        The file is no larger, as long as it has 16 pixels on a side.
    lossless : bool, optional
        Keep every colour: for pictures of few colours, which stay small.

    Returns
    -------
    bytes
    """
    picture = _as_picture(image)
    while True:
        for quality in _QUALITIES:
            data = _encode(picture, "WEBP", quality=quality, lossless=lossless, method=2)
            if len(data) <= max_bytes or min(picture.size) < 32:
                return data
            if lossless:
                break
        picture = picture.reduce(2)


def as_png(data: bytes) -> bytes:
    """Return an image file of any kind as the bytes of a PNG file."""
    return _encode(import_pillow().open(BytesIO(data)), "PNG")


def _as_picture(image: npt.NDArray[np.uint8]) -> Any:
    pixels = np.asarray(image)
    if pixels.dtype != np.uint8:
        raise TypeError(f"image must be uint8, got {pixels.dtype}")
    if not pixels.size or pixels.ndim not in (2, 3) or (pixels.ndim == 3 and pixels.shape[2] not in (3, 4)):
        raise ValueError(f"image must have shape (H, W), (H, W, 3) or (H, W, 4), got {pixels.shape}")
    return import_pillow().fromarray(np.ascontiguousarray(pixels))


def _encode(picture: Any, format: str, **options: Any) -> bytes:
    stream = BytesIO()
    picture.save(stream, format=format, **options)
    return stream.getvalue()
