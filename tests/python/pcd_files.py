"""PCD files as bytes, for tests of the reader."""

import struct

import numpy as np

XYZ = {"VERSION": "0.7", "FIELDS": "x y z", "SIZE": "4 4 4", "TYPE": "F F F", "COUNT": "1 1 1"}
TWO = {"WIDTH": "2", "HEIGHT": "1", "VIEWPOINT": "0 0 0 1 0 0 0", "POINTS": "2"}


def pcd(body, encoding="binary", **changes):
    """A PCD file of two points; a keyword gives a line of the header another text, None leaves it out."""
    lines = {**XYZ, **TWO, "DATA": encoding} | changes
    header = "".join(f"{keyword} {text}\n" for keyword, text in lines.items() if text is not None)
    return b"# .PCD v0.7 - Point Cloud Data file format\n" + header.encode() + body


def compress(data):
    """LZF, greedy: the longest repetition of the last three bytes, else a literal."""
    out, literals, seen, i = bytearray(), bytearray(), {}, 0

    def flush():
        for start in range(0, len(literals), 32):
            part = literals[start : start + 32]
            out.append(len(part) - 1)
            out.extend(part)
        literals.clear()

    while i < len(data):
        key = data[i : i + 3]
        start = seen.get(key, -1)
        seen[key] = i
        if len(key) < 3 or start < 0 or i - start > 8192:
            literals.append(data[i])
            i += 1
            continue
        length = 3
        while i + length < len(data) and length < 264 and data[start + length] == data[i + length]:
            length += 1
        flush()
        distance, coded = i - start - 1, length - 2
        out.append((min(coded, 7) << 5) | (distance >> 8))
        if coded >= 7:
            out.append(coded - 7)
        out.append(distance & 255)
        i += length
    flush()
    return bytes(out)


def compressed(content, size=None):
    packed = compress(content)
    return struct.pack("<II", len(packed), len(content) if size is None else size) + packed


POINTS = np.array([[0.5, 1.5, -2.25], [3, 4, 5e-3]], dtype=np.float32)
FLOATS = POINTS.tobytes()
COLUMNS = POINTS.T.tobytes()
TEXT = b"0.5 1.5 -2.25\n3 4 5e-3\n"


FIELDS = {
    "FIELDS": "_ intensity x y z _ stamp histogram rgb",
    "SIZE": "1 2 8 8 8 4 8 4 4",
    "TYPE": "U I F F F F U F F",
    "COUNT": "3 1 1 1 1 2 1 5 1",
}
ROWS = [
    (-7, 1e7 + 0.1, 2, 3, 2**63 + 1, [1, 2, 3, 4, 5], 0x102030),
    (8, 4, 5, 6, 17, [6, 7, 8, 9, 10], 0xFFFEFD),
]


def field_columns():
    """Packed columns, in the order of FIELDS."""
    columns = [[] for _ in range(9)]
    for intensity, x, y, z, stamp, histogram, rgb in ROWS:
        row = (
            b"\1\2\3",
            struct.pack("<h", intensity),
            *(struct.pack("<d", value) for value in (x, y, z)),
            b"\7" * 8,
        )
        row += (struct.pack("<Q", stamp), struct.pack("<5f", *histogram), struct.pack("<I", rgb))
        for column, value in zip(columns, row, strict=True):
            column.append(value)
    return columns


def fields_text():
    rows = [
        f"9 9 9 {intensity} {x!r} {y} {z} nan nan {stamp} {' '.join(map(str, histogram))} {rgb}"
        for intensity, x, y, z, stamp, histogram, rgb in ROWS
    ]
    return "\n".join(rows).encode()
