"""What an image says of its size, believed only as far as its file can hold it, before it is decoded."""

from __future__ import annotations

import os
import struct
import zlib

from nacre.errors import FileFormatError

MAX_PIXELS = 1 << 26
"""More than any depth camera has; 8192 x 8192."""

_PNG_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_PNG_LEFT_OUT = (b"zTXt", b"iTXt", b"iCCP")
_PNG_CHANNELS = {0: 1, 2: 3, 3: 1, 4: 2, 6: 4}
# At most: bitmaps, runs of 255 in two bytes, blocks of 64 in half a bit, rows of a fax in one bit.
_PIXELS_PER_BYTE: dict[str | None, int] = {"PPM": 8, "BMP": 256, "JPEG": 1024, "TIFF": 1 << 14}
_DEFLATE_RATIO = 1032  # 258 bytes of two bits
_LZFSE_HEADER = 772  # of a block of version 1
_LZFSE_MATCH, _LZVN_RATIO = 2359, 136  # bytes of a match; 271 of an opcode of two bytes
_MOST_EXR_CHANNELS = 4096
_EXR_PIXEL = {0: 4, 1: 2, 2: 4}  # bytes
# By the number of the compression: none, runs of 128 in two bytes, deflate twice, 256 words of 16 bits in 9
# bits, deflate of three bytes of four, blocks of 4 x 4 in three bytes; else 64 pixels in a deflated word.
_EXR_RATIO = {
    0: 1,
    1: 64,
    2: _DEFLATE_RATIO,
    3: _DEFLATE_RATIO,
    4: 512,
    5: 4 * _DEFLATE_RATIO // 3,
    6: 11,
    7: 11,
}
_EXR_RATIO_ELSE = 64 * _DEFLATE_RATIO
_EXR_MAGIC = b"\x76\x2f\x31\x01"


def check_pixels(
    path: str | os.PathLike[str], width: int, height: int, *, file_size: int = 0, format: str | None = None
) -> None:
    """Refuse an image of more pixels than a camera has, or than its file can hold."""
    if width * height > MAX_PIXELS:
        reason = f"refused: {width} x {height} pixels are more than {MAX_PIXELS}"
        raise FileFormatError(path, reason)
    if width * height > _PIXELS_PER_BYTE.get(format, MAX_PIXELS) * file_size > 0:
        reason = f"refused: {width} x {height} pixels in {file_size} bytes, which cannot hold them"
        raise FileFormatError(path, reason)


def checked_png(path: str | os.PathLike[str], data: bytes) -> bytes:
    """
    Check what a PNG file is made of, its check sums included, and that it can hold its pixels.

    Returns the file without compressed texts and profiles, which could be of any size and have no use here.

    Decoders pass over damaged parts that they have no use for, and give zeros for what is missing. What is no
    PNG at all is left to them.
    """
    if not data.startswith(_PNG_SIGNATURE):
        return data
    position, name, num_packed = len(_PNG_SIGNATURE), b"", 0
    left_out: list[slice] = []
    view = memoryview(data)
    while name != b"IEND":
        if position + 12 > len(data):
            raise _damaged(path, "it ends before IEND", len(data))
        size, name = struct.unpack_from(">I4s", data, position)
        end = position + 12 + size
        if end > len(data):
            raise _damaged(path, f"a part of {size} bytes goes on after the end of the file", position)
        if zlib.crc32(view[position + 4 : end - 4]) != int.from_bytes(view[end - 4 : end], "big"):
            raise _damaged(path, "the check sum of a part is wrong", position)
        if (name == b"IHDR") != (position == len(_PNG_SIGNATURE)) or (name == b"IHDR" and size != 13):
            raise _damaged(path, "it must have one header, at its beginning", position)
        num_packed += size if name == b"IDAT" else 0
        if name in _PNG_LEFT_OUT:
            left_out.append(slice(position, end))
        position = end
    width, height, bits, color = struct.unpack_from(">IIBB", data, 16)
    check_pixels(path, width, height)
    num_bytes = width * height * bits * _PNG_CHANNELS.get(color, 1) // 8
    if num_bytes > _DEFLATE_RATIO * num_packed:
        reason = f"refused: {width} x {height} pixels in {num_packed} bytes, which cannot hold them"
        raise FileFormatError(path, reason, offset=16)
    starts = [0, *(part.stop for part in left_out)]
    ends = [*(part.start for part in left_out), len(data)]
    return b"".join(view[a:b] for a, b in zip(starts, ends, strict=True)) if left_out else data


def check_exr(path: str | os.PathLike[str], data: bytes) -> None:
    """Check that an EXR file can hold the pixels that its header promises; other files are refused."""
    if not data.startswith(_EXR_MAGIC):
        raise _damaged(path, "not an EXR image", 0)
    position, width, height, ratio, depth = 8, 0, 0, _EXR_RATIO_ELSE, 0.0
    while position < len(data) and data[position]:
        try:
            name, position = _word(data, position)
            kind, position = _word(data, position)
            (size,) = struct.unpack_from("<I", data, position)
            position += 4
            if name == b"channels" and size > _MOST_EXR_CHANNELS:
                raise FileFormatError(path, f"refused: {size} bytes of names of channels", offset=position)
            if name == b"dataWindow" and kind == b"box2i":
                left, top, right, bottom = struct.unpack_from("<4i", data, position)
                if right < left or bottom < top:
                    raise _damaged(path, "its data window has no pixels", position)
                width, height = right - left + 1, bottom - top + 1
                check_pixels(path, width, height)
            elif name == b"channels":
                depth = _bytes_per_pixel(data[position : position + size])
            elif name == b"compression":
                ratio = _EXR_RATIO.get(data[position], _EXR_RATIO_ELSE)
            position += size
        except FileFormatError:
            raise
        except (ValueError, struct.error, IndexError, ZeroDivisionError):
            raise _damaged(path, "not an EXR image with a whole header", position) from None
    num_packed = len(data) - position
    if width * height * depth > ratio * num_packed:
        reason = f"refused: {width} x {height} pixels in {num_packed} bytes, which cannot hold them"
        raise FileFormatError(path, reason, offset=position)


def _bytes_per_pixel(channels: bytes) -> float:
    position, total = 0, 0.0
    while channels[position]:
        _, position = _word(channels, position)
        kind, _, x_sampling, y_sampling = struct.unpack_from("<4i", channels, position)
        total += _EXR_PIXEL.get(kind, 2) / (x_sampling * y_sampling)
        position += 16
    return total


def check_lzfse(path: str | os.PathLike[str], data: bytes, most: int) -> None:
    """Check how many bytes the blocks of LZFSE data say that they hold, and can hold."""
    position, total, possible = 0, 0, 0
    try:
        while (kind := data[position : position + 4]) != b"bvx$":
            (num_raw,) = struct.unpack_from("<I", data, position + 4)
            total += num_raw
            if kind == b"bvx-":
                possible += num_raw
                position += 8 + num_raw
            elif kind == b"bvxn":
                (num_packed,) = struct.unpack_from("<I", data, position + 8)
                possible += _LZVN_RATIO * num_packed
                position += 12 + num_packed
            elif kind == b"bvx2":
                first, second, third = struct.unpack_from("<3Q", data, position + 8)
                possible += (first & 0xFFFFF) + _LZFSE_MATCH * (first >> 40 & 0xFFFFF)
                position += (third & 0xFFFFFFFF) + (first >> 20 & 0xFFFFF) + (second >> 40 & 0xFFFFF)
            elif kind == b"bvx1":
                num_literals, num_matches, literals, commands = struct.unpack_from("<4I", data, position + 12)
                possible += num_literals + _LZFSE_MATCH * num_matches
                position += _LZFSE_HEADER + literals + commands
            else:
                raise ValueError
            if position > len(data):
                raise ValueError
            if total > most:
                raise FileFormatError(path, f"refused: its LZFSE data holds {total} bytes, more than {most}")
            if total > possible:
                reason = f"refused: its LZFSE data holds {total} bytes, and cannot hold more than {possible}"
                raise FileFormatError(path, reason, offset=position)
    except FileFormatError:
        raise
    except (ValueError, struct.error):
        raise FileFormatError(
            path, "the LZFSE data is damaged: a block is cut short", offset=position
        ) from None


def _word(data: bytes, position: int) -> tuple[bytes, int]:
    end = data.index(b"\0", position)
    return data[position:end], end + 1


def _damaged(path: str | os.PathLike[str], reason: str, offset: int) -> FileFormatError:
    return FileFormatError(path, f"the image is damaged or truncated: {reason}", offset=offset)
