"""Hostile images: PNG, PGM, EXR, npy; depth, colour and others."""

import struct
import zlib
from io import BytesIO

import numpy as np

from hostile_files.case import Case, single

SIGNATURE = b"\x89PNG\r\n\x1a\n"
_random = np.random.default_rng(3)


def chunk(name: bytes, data: bytes, crc: int = 0) -> bytes:
    """Return a chunk of a PNG file; ``crc`` damages its check sum."""
    return len(data).to_bytes(4, "big") + name + data + (zlib.crc32(name + data) ^ crc).to_bytes(4, "big")


def png(
    width: int = 4,
    height: int = 3,
    bits: int = 16,
    color: int = 0,
    data: bytes | None = None,
    extra: bytes = b"",
    interlace: int = 0,
    crc: int = 0,
) -> bytes:
    """Return a PNG file, of zeros if it is not said of what."""
    header = struct.pack(">IIBBBBB", width, height, bits, color, 0, 0, interlace)
    body = zlib.compress(bytes(3 * 9)) if data is None else data
    return SIGNATURE + chunk(b"IHDR", header) + extra + chunk(b"IDAT", body, crc) + chunk(b"IEND", b"")


def pgm(largest: object = 65535, body: bytes = bytes(24), size: str = "4 3") -> bytes:
    """Return a PGM file."""
    return f"P5\n{size}\n{largest}\n".encode() + body


def npy(array: object) -> bytes:
    """Return an npy file."""
    stream = BytesIO()
    np.save(stream, array, allow_pickle=True)
    return stream.getvalue()


def npy_header(text: str, body: bytes = bytes(48)) -> bytes:
    """Return an npy file with a header of any text."""
    padded = text.encode() + b" " * (-(len(text) + 11) % 64) + b"\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(padded)) + padded + body


def exr(
    window: tuple[int, int, int, int] = (0, 0, 3, 2),
    channels: tuple[str, ...] = ("Z",),
    compression: int = 0,
    kind: int = 2,
    body: bytes | None = None,
    sampling: int = 1,
) -> bytes:
    """Return an EXR file of 4 x 3 zeros, or what its header says."""
    named = (
        b"".join(c.encode() + b"\0" + struct.pack("<iiii", kind, 0, sampling, sampling) for c in channels)
        + b"\0"
    )
    attributes = (
        ("channels", "chlist", named),
        ("compression", "compression", bytes([compression])),
        ("dataWindow", "box2i", struct.pack("<4i", *window)),
        ("displayWindow", "box2i", struct.pack("<4i", *window)),
        ("lineOrder", "lineOrder", b"\0"),
        ("pixelAspectRatio", "float", struct.pack("<f", 1)),
        ("screenWindowCenter", "v2f", struct.pack("<2f", 0, 0)),
        ("screenWindowWidth", "float", struct.pack("<f", 1)),
    )
    head = struct.pack("<II", 20000630, 2)
    for name, type_name, value in attributes:
        head += name.encode() + b"\0" + type_name.encode() + b"\0" + struct.pack("<I", len(value)) + value
    head += b"\0"
    if body is None:
        row = struct.pack("<f", 1.5) * 4 * len(channels)
        start = len(head) + 3 * 8
        body = b"".join(struct.pack("<Q", start + i * (8 + len(row))) for i in range(3))
        body += b"".join(struct.pack("<ii", i, len(row)) + row for i in range(3))
    return head + body


BOMB = zlib.compress(bytes(1 << 24), 9)
_lying = {"descr": "'<u2'", "fortran_order": "False", "shape": "(100000, 100000)"}
PNG = {
    "png empty": (b"", "damaged or truncated"),
    "png nul bytes": (bytes(200), "damaged or truncated: not an image|not a PNG"),
    "png garbage": (SIGNATURE + _random.bytes(300), "damaged or truncated"),
    "png signature alone": (SIGNATURE, "damaged or truncated"),
    "png changed by ftp": (png().replace(b"\r\n", b"\n"), "damaged or truncated"),
    "png of 2 to the 31 squared": (png(2**31 - 1, 2**31 - 1), r"refused: .*2147483647 x 2147483647"),
    "png of 60000 squared": (png(60_000, 60_000), "refused: .*60000 x 60000"),
    "png of 12000 squared": (png(12_000, 12_000), "refused: .*12000 x 12000"),
    "png larger than it can hold": (png(4000, 4000), "refused: .*4000 x 4000 .* cannot hold"),
    "png of no width": (png(0, 3), "damaged or truncated|refused"),
    "png of width 2 to the 32 - 1": (png(2**32 - 1, 1), "refused|damaged"),
    "png of bad crc": (png(crc=1), "damaged or truncated"),
    "png of bad zlib": (png(data=b"\x78\x9c" + _random.bytes(40)), "damaged or truncated"),
    "png of bad adler": (png(data=zlib.compress(bytes(27))[:-4] + b"\1\2\3\4"), "damaged or truncated"),
    "png of too few pixels": (png(data=zlib.compress(bytes(26))), "damaged or truncated"),
    "png without pixels": (png(data=b""), "refused: 4 x 3 pixels in 0 bytes"),
    "png of unknown filter": (png(data=zlib.compress(b"\x09" * 27)), "damaged or truncated"),
    "png cut in the middle": (png()[:50], "damaged or truncated"),
    "png cut before its end": (png()[:-12], "damaged or truncated"),
    "png chunk length huge": (png()[:33] + b"\xff\xff\xff\xffIDAT" + bytes(30), "damaged or truncated"),
    "png chunk length negative": (png()[:33] + b"\x80\0\0\0IDAT" + bytes(30), "damaged or truncated"),
    "png without header": (SIGNATURE + chunk(b"IDAT", zlib.compress(bytes(27))), "damaged or truncated"),
    "png header twice": (png(extra=png(9, 9)[8:33]), "damaged or truncated"),
    "png header short": (SIGNATURE + chunk(b"IHDR", bytes(5)), "damaged or truncated"),
    "png of 8 bits": (png(bits=8, data=zlib.compress(bytes(15))), "must have 16 bits"),
    "png of 16-bit palette": (png(color=3), "damaged or truncated|must have 16 bits"),
    "png of 7 bits": (png(bits=7), "damaged or truncated|must have 16 bits"),
    "png of 16-bit colour": (
        png(color=2, data=zlib.compress(bytes(75))),
        "must have 16 bits and one channel",
    ),
    "png of 16-bit grey with alpha": (
        png(color=4, data=zlib.compress(bytes(51))),
        "must have 16 bits and one",
    ),
    "png of unknown colour": (png(color=5), "damaged or truncated|must have 16 bits"),
    "png that is a jpeg": (b"\xff\xd8\xff\xe0" + bytes(100), "damaged or truncated|not a PNG"),
    "png that is a tiff": (b"II*\0\x08\0\0\0" + bytes(100), "damaged or truncated|not a PNG"),
    "png that is postscript": (
        b"%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 4 3\n(x) run\n",
        "damaged or truncated|not a PNG",
    ),
}
PGM = {
    "pgm empty": (b"", "byte 0: expected a binary PGM header"),
    "pgm of text": (b"P2 2 2 65535 1 2 3 4", "byte 0: expected"),
    "pgm cut in the header": (b"P5 2 2", "byte 0: expected"),
    "pgm maxval 70000": (pgm(70000), "largest value is 70000"),
    "pgm of size 99999999 squared": (pgm(size="99999999 99999999"), "truncated"),
    "pgm of colour": (b"P6 2 2 65535\n" + bytes(24), "byte 0: expected"),
    "pgm maxval 0": (pgm(0), "largest value is 0"),
    "pgm maxval 255": (pgm(255), "largest value is 255"),
    "pgm maxval 65536": (pgm(65536), "largest value is 65536"),
    "pgm maxval negative": (pgm(-1), "byte 0: expected"),
    "pgm maxval of 5000 digits": (pgm("9" * 5000), "byte 0: expected|whole number"),
    "pgm of no width": (pgm(size="0 3"), "must have pixels, this PGM is 0 x 3"),
    "pgm of no height wider than an array": (pgm(size=f"{2**63 + 6} 0"), "must have pixels"),
    "pgm of no height with more bytes than an array": (pgm(size=f"{2**62} 0"), "must have pixels"),
    "pgm of size 2 to the 32 squared": (
        pgm(size=f"{2**32} {2**32}"),
        "truncated: 36893488147419103232 bytes",
    ),
    "pgm of size that wraps": (pgm(size=f"{2**63 + 6} 2"), "truncated"),
    "pgm of negative size": (pgm(size="-4 -3"), "byte 0: expected"),
    "pgm of size of 5000 digits": (pgm(size="9" * 5000 + " 3"), "byte 0: expected|whole number"),
    "pgm cut": (pgm(body=bytes(23)), "byte 36: truncated: 24 bytes of pixels expected, 23 found"),
    "pgm goes on": (pgm(body=bytes(24) + b"x"), "byte 37: 1 bytes follow"),
    "pgm of two images": (pgm() + pgm(), "byte 37: .* follow"),
    "pgm with an endless comment": (b"P5\n" + b"# x\n" * 100_000, "byte 0: expected"),
    "pgm of blanks": (b"P5" + b" " * 200_000 + b"x", "byte 0: expected"),
}
NPY = {
    "npy empty": (b"", "not a readable .npy array"),
    "npy pickle": (npy(np.array([[print, {"a": 1}]], dtype=object)), "must be .H, W. numbers"),
    "npy shape huge": (
        npy_header("{'descr': '<u2', 'fortran_order': False, 'shape': (1000000, 1000000), }"),
        "not a readable",
    ),
    "npy shape wraps": (
        npy_header(f"{{'descr': '<u2', 'fortran_order': False, 'shape': ({2**33}, {2**31}), }}"),
        "not a readable",
    ),
    "npy shape negative": (
        npy_header("{'descr': '<u2', 'fortran_order': False, 'shape': (-4, -3), }"),
        "not a readable|must be",
    ),
    "npy header is code": (npy_header("__import__('os').abort()"), "not a readable"),
    "npy header deep": (npy_header("(" * 9000), "not a readable"),
    "npy cut in the header": (b"\x93NUMPY\x01\x00", "not a readable"),
    "npy of text": (b"not an array at all", "not a readable"),
    "npy of one row": (npy(np.zeros(5)), "must be .H, W. numbers"),
    "npy header short": (b"\x93NUMPY\x01\x00\xff\xff{", "not a readable"),
    "npy version 9": (b"\x93NUMPY\x09\x00" + npy(np.zeros((3, 4)))[8:], "not a readable"),
    "npy cut": (npy(np.zeros((3, 4)))[:-1], "not a readable"),
    "npy goes on": (npy(np.zeros((3, 4))) + b"x", "1 bytes follow|follow"),
    "npy of strings": (npy(np.array([["a"]])), "must be .H, W. numbers"),
    "npy of dates": (npy(np.zeros((2, 2), "M8[s]")), "must be .H, W. numbers"),
    "npy of records": (npy(np.zeros((2, 2), [("a", "f4")])), "must be .H, W. numbers"),
    "npy of complex numbers": (npy(np.zeros((2, 2), complex)), "must be .H, W. numbers"),
    "npy of no bytes each": (
        npy_header("{'descr': '|V0', 'fortran_order': False, 'shape': (999999999, 999999999), }"),
        "not a readable|must be",
    ),
    "npy of a cube": (npy(np.zeros((2, 2, 2))), "must be .H, W. numbers"),
    "npy of no pixels": (npy(np.zeros((0, 4))), "must be .H, W. numbers"),
}
EXR = {
    "exr empty": (b"", "damaged or truncated|not an EXR"),
    "exr garbage": (struct.pack("<II", 20000630, 2) + _random.bytes(300), "damaged or truncated|not an EXR"),
    "exr huge data window": (
        exr((0, 0, 2**30, 2**30), body=bytes(100)),
        "refused: .*1073741825 x 1073741825",
    ),
    "exr data window of 60000": (exr((0, 0, 59_999, 59_999), body=bytes(100)), "refused: .*60000 x 60000"),
    "exr data window negative": (exr((5, 5, 0, 0), body=bytes(100)), "damaged or truncated|refused"),
    "exr data window wraps": (
        exr((-(2**31), -(2**31), 2**31 - 1, 2**31 - 1), body=bytes(100)),
        "refused: .*4294967296 x 4294967296",
    ),
    "exr larger than it can hold": (
        exr((0, 0, 3999, 3999), body=bytes(100)),
        "refused: .*4000 x 4000 .*cannot hold",
    ),
    "exr larger than runs can hold": (
        exr((0, 0, 1999, 1999), compression=1, body=bytes(200_000)),
        "refused: .*cannot hold",
    ),
    "exr larger than deflate can hold": (
        exr((0, 0, 7999, 7999), compression=3, body=bytes(200_000)),
        "refused: .*cannot hold",
    ),
    "exr larger than wavelets can hold": (
        exr((0, 0, 7999, 7999), compression=9, body=bytes(2000)),
        "refused: .*cannot hold",
    ),
    "exr cut in the header": (exr()[:80], "damaged or truncated|refused|not an EXR"),
    "exr cut in the pixels": (exr()[:-10], "damaged or truncated"),
    "exr without pixels": (exr(body=b""), "refused: 4 x 3 pixels .*cannot hold"),
    "exr offsets outside": (exr(body=b"\xff" * 24 + bytes(72)), "damaged or truncated"),
    "exr of unknown compression": (exr(compression=77), "damaged or truncated|refused"),
    "exr of colours": (exr(channels=("x", "y")), "no channel Z"),
    "exr of thousand channels": (
        exr(channels=tuple(f"c{i:04}" for i in range(1000)), body=b""),
        "refused: .*channels",
    ),
    "exr of sampling 0": (exr(sampling=0), "damaged or truncated|refused"),
}
COLOR = {
    "color empty": (b"", "damaged or truncated"),
    "color png of 16 bits": (png(), "8 bits per channel"),
    "color png of 30000 squared": (png(30_000, 30_000, 8, 2), "refused: .*30000 x 30000"),
    "color png larger than it can hold": (png(4000, 4000, 8, 2), "refused: .*4000 x 4000 .* cannot hold"),
    "color svg": (b"<svg xmlns='http://www.w3.org/2000/svg'/>", "damaged or truncated"),
    "color html": (b"<!DOCTYPE html><script>alert(1)</script>", "damaged or truncated"),
    "color gif that is eps": (b"%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 4 3\n", "damaged or truncated"),
}
BMP = {
    "color bmp larger than it can hold": (
        b"BM"
        + struct.pack("<IHHI", 70, 0, 0, 54)
        + struct.pack("<IiiHHIIiiII", 40, 9000, 7000, 1, 24, 0, 0, 0, 0, 0, 0)
        + bytes(16),
        "damaged or truncated|refused",
    ),
    "color bmp of negative size": (
        b"BM"
        + struct.pack("<IHHI", 70, 0, 0, 54)
        + struct.pack("<IiiHHIIiiII", 40, -4, -3, 1, 24, 0, 0, 0, 0, 0, 0)
        + bytes(16),
        "damaged or truncated|refused",
    ),
}
DEPTH_TIFF = {"depth tiff": (b"II*\0", "a depth image must be")}
TIFF = {
    "attribute tiff of 2 to the 31 squared": (
        b"II*\0\x08\0\0\0\x03\0"
        + b"".join(
            struct.pack("<HHII", tag, 4, 1, value) for tag, value in ((256, 2**31), (257, 2**31), (273, 8))
        )
        + bytes(4),
        "refused|damaged or truncated",
    ),
    "attribute tiff whose directories go round": (
        b"II*\0\x08\0\0\0\x01\0" + struct.pack("<HHII", 256, 4, 1, 4) + struct.pack("<I", 8),
        "damaged or truncated",
    ),
}
DEPTH_IMAGES: list[Case] = (
    single("image", "depth", ".png", PNG, needs="PIL")
    + single("image", "depth", ".pgm", PGM)
    + single("image", "depth", ".npy", NPY)
    + single("image", "depth", ".exr", EXR, needs="OpenEXR")
    + single("image", "depth", ".tif", DEPTH_TIFF)
    + single("image", "color", ".png", COLOR, needs="PIL")
    + single("image", "color", ".bmp", BMP, needs="PIL")
    + single("image", "attribute", ".tif", TIFF, needs="PIL")
)
