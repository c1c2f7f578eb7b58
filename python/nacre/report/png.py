"""PNG files from arrays, with the standard library alone."""

from __future__ import annotations

import struct
import zlib

import numpy as np
import numpy.typing as npt

_COLOR_TYPES = {1: 0, 3: 2, 4: 6}  # grey, RGB, RGBA


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
    """
    pixels = np.asarray(image)
    if pixels.dtype != np.uint8:
        raise TypeError(f"image must be uint8, got {pixels.dtype}")
    pixels = pixels[:, :, None] if pixels.ndim == 2 else pixels
    if pixels.ndim != 3 or pixels.shape[2] not in _COLOR_TYPES or not pixels.size:
        raise ValueError(f"image must have shape (H, W), (H, W, 3) or (H, W, 4), got {np.shape(image)}")
    height, width, channels = pixels.shape
    filtered = _filter_rows(pixels.reshape(height, width * channels), channels)
    header = struct.pack(">IIBBBBB", width, height, 8, _COLOR_TYPES[channels], 0, 0, 0)
    return _file((b"IHDR", header), (b"IDAT", zlib.compress(filtered, 6)), (b"IEND", b""))


def encode_indexed_png(indices: npt.NDArray[np.uint8], palette: npt.NDArray[np.uint8]) -> bytes:
    """
    Return an image of palette colours as the bytes of a PNG file.

    Parameters
    ----------
    indices : numpy.ndarray of uint8, shape (H, W)
        Rows of the palette.
    palette : numpy.ndarray of uint8, shape (C, 3) or (C, 4)
        RGB or RGBA, C at most 256.

    Returns
    -------
    bytes
    """
    height, width = indices.shape
    plain = np.concatenate([np.zeros((height, 1), np.uint8), indices], axis=1).tobytes()
    chunks = [
        (b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 3, 0, 0, 0)),
        (b"PLTE", palette[:, :3].tobytes()),
        (b"IDAT", zlib.compress(plain, 7)),
        (b"IEND", b""),
    ]
    if palette.shape[1] == 4:
        chunks.insert(2, (b"tRNS", palette[:, 3].tobytes()))
    return _file(*chunks)


def _file(*chunks: tuple[bytes, bytes]) -> bytes:
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
        for kind, data in chunks
    )


def _filter_rows(rows: npt.NDArray[np.uint8], channels: int) -> bytes:
    """Predict rows from the left or from above, whichever leaves least (PNG specification, 9.2, 12.7)."""
    left, up = rows.copy(), rows.copy()
    left[:, channels:] -= rows[:, :-channels]
    up[1:] -= rows[:-1]
    candidates = np.stack([rows, left, up])
    cost = np.abs(candidates.view(np.int8).astype(np.int16)).sum(axis=2)
    best = cost.argmin(axis=0)
    chosen = candidates[best, np.arange(len(rows))]
    return np.concatenate([best[:, None].astype(np.uint8), chosen], axis=1).tobytes()
