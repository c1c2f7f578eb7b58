"""LZF decompression, as binary_compressed PCD files need it (format of Marc Lehmann's liblzf)."""

from __future__ import annotations

MAX_RATIO = 88
"""Three bytes stand for at most 264."""


def decompress(data: bytes, size: int) -> bytearray:
    """
    Return the ``size`` bytes that ``data`` was compressed from.

    Raises
    ------
    ValueError
        When ``data`` is broken or holds more or fewer bytes.
    """
    out = bytearray()
    position, end = 0, len(data)
    try:
        while position < end:
            control = data[position]
            position += 1
            if control < 32:  # that many bytes plus one, as they are
                stop = position + control + 1
                out += data[position:stop]
                position = stop
                continue
            length = control >> 5
            if length == 7:
                length += data[position]
                position += 1
            length += 2
            distance = ((control & 31) << 8) + data[position] + 1
            position += 1
            start = len(out) - distance
            if start < 0:
                raise ValueError("the compressed data refers to bytes before its beginning")
            if distance >= length:
                out += out[start : start + length]
            else:  # the copy overlaps itself: a repeated pattern
                out += (out[start:] * (length // distance + 1))[:length]
            if len(out) > size:
                break
    except IndexError:
        position = end + 1
    if position > end:
        raise ValueError("the compressed data ends in the middle of an instruction")
    if len(out) != size:
        raise ValueError(f"the compressed data does not give the {size} bytes that the file promises")
    return out
