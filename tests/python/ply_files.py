"""PLY files as bytes, for tests of the reader."""

import struct

import numpy as np

import nacre

XYZ = "property float x\nproperty float y\nproperty float z"


def ply(body, elements=f"element vertex 2\n{XYZ}", file_format="binary_little_endian", newline="\n"):
    header = f"ply\nformat {file_format} 1.0\n{elements}\nend_header\n".replace("\n", newline)
    return header.encode("latin-1") + (body.encode() if isinstance(body, str) else body)


def ascii_ply(body, elements=f"element vertex 2\n{XYZ}", newline="\n"):
    return ply(body, elements, "ascii", newline)


def read(tmp_path, content):
    path = tmp_path / "a.ply"
    path.write_bytes(content)
    return nacre.read_points(path)


POINTS = np.array([[0.5, 1.5, -2.25], [3, 4, 5e-3]], dtype=np.float32)
FLOATS = POINTS.tobytes()
TEXT = "0.5 1.5 -2.25\n3 4 5e-3\n"

# Each row: a scalar, a list, a scalar of another type, a list; lists differ in length.
MIXED = (
    "element junk 3\nproperty ushort a\nproperty list uchar short b\n"
    "property double c\nproperty list int uchar d\n"
    f"element vertex 2\n{XYZ}\nelement face 2\nproperty list uchar int vertex_indices"
)
JUNK = [(1, [-1, 2], 0.25, [7]), (2, [], -4.0, [8, 9, 10]), (65535, [5], 1e300, [])]
FACES = [[0, 1, 0], [1, 0, 1, 0]]


def mixed_binary(order):
    out = b""
    for a, b, c, d in JUNK:
        out += struct.pack(f"{order}HB{len(b)}hdi{len(d)}B", a, len(b), *b, c, len(d), *d)
    out += struct.pack(f"{order}6f", *POINTS.ravel())
    for face in FACES:
        out += struct.pack(f"{order}B{len(face)}i", len(face), *face)
    return out


def mixed_text():
    rows = [
        f"{a} {len(b)} {' '.join(map(str, b))} {c} {len(d)} {' '.join(map(str, d))}" for a, b, c, d in JUNK
    ]
    return "\n".join(rows) + "\n" + TEXT + "3 0 1 0\n4 1 0 1 0\n"
