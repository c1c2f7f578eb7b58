"""Pictures with few colours: small PNG files."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from nacre.report.png import encode_indexed_png

Bytes = npt.NDArray[np.uint8]


def encode_small_png(image: Bytes, max_bytes: int = 1 << 62) -> bytes:
    """
    Return an image as a PNG file with a palette of at most 256 colours.

    Parameters
    ----------
    image : numpy.ndarray of uint8, shape (H, W, 3) or (H, W, 4)
        RGB or RGBA.
    max_bytes : int, optional
        The file gets 128 colours, and then fewer pixels, until it is no larger.

    Returns
    -------
    bytes
    """
    pixels = np.asarray(image)
    while True:
        palette, indices = quantize(pixels)
        data = encode_indexed_png(indices, palette)
        if len(data) > max_bytes and len(palette) > 128:
            palette, rows = _reduced(palette.astype(np.float64), np.bincount(indices.ravel()), 128)
            data = encode_indexed_png(rows[indices], palette)
        if len(data) <= max_bytes or min(pixels.shape[:2]) < 16:
            return data
        pixels = _halved(pixels)


def quantize(image: Bytes, num_colors: int = 256) -> tuple[Bytes, Bytes]:
    """
    Choose the colours that stand for those of an image: median cut (Heckbert 1982) of the largest variance.

    Returns
    -------
    palette : (C, 3 or 4) uint8
        From dark to light.
    indices : (H, W) uint8
    """
    height, width, channels = image.shape
    wide = np.zeros((height * width, 4), dtype=np.uint8)
    wide[:, :channels] = image.reshape(-1, channels)
    if channels == 4:
        wide[wide[:, 3] == 0] = 0  # what is not seen has no colour
    packed = wide.view(np.uint32).ravel()
    if len(np.unique(packed[::7])) > num_colors:  # surely too many: count similar ones together
        packed = packed & np.uint32(0xFCFCFCFC)
    _, inverse, counts = np.unique(packed, return_inverse=True, return_counts=True)
    sums = [np.bincount(inverse, weights=wide[:, c]) for c in range(channels)]
    palette, rows = _reduced(np.stack(sums, axis=1) / counts[:, None], counts, num_colors)
    return palette, rows[inverse].reshape(height, width)


def _reduced(
    colors: npt.NDArray[np.float64], counts: npt.NDArray[np.int64], num_colors: int
) -> tuple[Bytes, Bytes]:
    """Return a palette for colours that occur so often, and the row that each of them gets."""
    member = np.arange(len(colors))
    if len(colors) > num_colors:
        member = _median_cut(colors, counts.astype(np.float64), num_colors)
    weight = np.bincount(member, weights=counts)
    sums = [np.bincount(member, weights=counts * channel) for channel in colors.T]
    palette = np.stack(sums, axis=1) / weight[:, None]
    order = np.argsort(palette @ np.array([0.3, 0.6, 0.1, 1.0])[: colors.shape[1]], kind="stable")
    rank = np.empty(len(order), dtype=np.uint8)
    rank[order] = np.arange(len(order))
    return palette[order].round().astype(np.uint8), rank[member]


def _median_cut(
    colors: npt.NDArray[np.float64], counts: npt.NDArray[np.float64], num_colors: int
) -> npt.NDArray[np.int64]:
    """Return to which of ``num_colors`` boxes each colour belongs."""
    boxes = [np.arange(len(colors))]
    spreads = np.zeros((num_colors, colors.shape[1]))
    spreads[0] = _spread(colors, counts)
    while len(boxes) < num_colors:
        largest, axis = divmod(int(spreads.argmax()), colors.shape[1])
        if spreads[largest, axis] <= 0:
            break
        box = boxes[largest]
        box = box[np.argsort(colors[box, axis], kind="stable")]
        heavy = np.cumsum(counts[box])
        cut = int(np.clip(np.searchsorted(heavy, heavy[-1] / 2), 1, len(box) - 1))
        for place, part in ((largest, box[:cut]), (len(boxes), box[cut:])):
            boxes[place : place + 1] = [part]
            spreads[place] = _spread(colors[part], counts[part])
    member = np.empty(len(colors), dtype=np.int64)
    for i, box in enumerate(boxes):
        member[box] = i
    return member


def _spread(colors: npt.NDArray[np.float64], counts: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Return the weighted sum of squares about the mean, by channel; 0 for a single colour."""
    if len(colors) < 2:
        return np.zeros(colors.shape[1])
    mean = counts @ colors / counts.sum()
    return np.asarray(counts @ (colors - mean) ** 2)


def _halved(image: Bytes) -> Bytes:
    """Return an image of half the size, each pixel the mean of four."""
    height, width = (side // 2 * 2 for side in image.shape[:2])
    cells = image[:height, :width].reshape(height // 2, 2, width // 2, 2, -1).astype(np.float64)
    return np.asarray(cells.mean(axis=(1, 3)).round(), dtype=np.uint8)
