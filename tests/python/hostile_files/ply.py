"""Hostile PLY files."""

import struct

import numpy as np

from hostile_files.case import single

XYZ = "property float x\nproperty float y\nproperty float z"
TWO = struct.pack("<6f", 0, 1, 2, 3, 4, 5)
TEXT = "0 1 2\n3 4 5\n"
FACES = "element face 1\nproperty list uchar int vertex_indices"
GRID = f"obj_info num_cols 2\nobj_info num_rows 1\nelement vertex 2\n{XYZ}\nelement range_grid 2\n"
GRID += "property list uchar int vertex_indices"


def ply(
    body: bytes | str, elements: str = f"element vertex 2\n{XYZ}", form: str = "binary_little_endian"
) -> bytes:
    """Return a PLY file."""
    tail = body.encode("latin-1") if isinstance(body, str) else body
    return f"ply\nformat {form} 1.0\n{elements}\nend_header\n".encode("latin-1") + tail


def text(body: bytes | str, elements: str = f"element vertex 2\n{XYZ}") -> bytes:
    """Return a PLY file in ASCII."""
    return ply(body, elements, "ascii")


def with_list(kind: str, body: bytes) -> bytes:
    """Return a PLY file whose one face is ``body``."""
    return ply(
        TWO + body, f"element vertex 2\n{XYZ}\nelement face 1\nproperty list {kind} int vertex_indices"
    )


def vertices(count: object) -> str:
    """Return an element of as many vertices."""
    return f"element vertex {count}\n{XYZ}"


_random = np.random.default_rng(1)

POINTS = {
    "empty": (b"", "the file is empty"),
    "magic only": (b"ply\n", "line 2: .*before end_header"),
    "magic of another format": (b"# .PCD v0.7\n", "line 1: a PLY file begins with 'ply'"),
    "garbage": (_random.bytes(1024), "line 1: a PLY file begins"),
    "nul bytes": (bytes(512), "line 1: a PLY file begins"),
    "gzip": (b"\x1f\x8b\x08\x00" + _random.bytes(64), "line 1: a PLY file begins"),
    "utf-16": (ply(TWO).decode("latin-1").encode("utf-16"), "line 1: a PLY file begins"),
    "utf-8 with a mark": (b"\xef\xbb\xbf" + ply(TWO), "line 1: a PLY file begins"),
    "header without end": (ply(TWO).split(b"end_header")[0], "before end_header"),
    "header of one endless line": (b"ply\n" + b"x" * 200_000, "line 2: unknown keyword"),
    "header of blank lines": (b"ply\n" + b"\n" * 100_000, "line 2: unknown keyword"),
    "header of comments": (b"ply\n" + b"comment\n" * 60_000, "line 10002: more than 10000 comments"),
    "header of many elements": (
        ply(b"", "\n".join(f"element e{i} 0" for i in range(12_000))),
        "line 1003: more than 1000 elements",
    ),
    "header of many properties": (
        ply(b"", "element vertex 1\n" + "\n".join(f"property float p{i}" for i in range(12_000))),
        "line 5002: more than 5000 lines",
    ),
    "nul in a name": (ply(TWO, vertices(2).replace("float x", "float x\0")), "no single value x"),
    "no format": (ply(TWO).replace(b"format binary_little_endian 1.0\n", b""), "no line 'format'"),
    "format twice": (ply(TWO, f"format ascii 1.0\n{vertices(2)}"), "line 3: a second line 'format'"),
    "format unknown": (ply(TWO, form="binary_middle_endian"), "line 2: expected 'format'"),
    "format of version 2": (ply(TWO).replace(b"1.0", b"2.0"), "line 2: expected 'format'"),
    "format without a space": (b"ply\nformatascii 1.0", "line 2: unknown keyword"),
    "count huge": (ply(TWO, vertices(10**12)), "line 3: .*promises 1000000000000 rows"),
    "count 2 to the 63": (ply(TWO, vertices(2**63)), "line 3: .*promises 9223372036854775808 rows"),
    "count wraps to 2": (ply(TWO, vertices(2**64 // 12 + 2)), "line 3: .*promises"),
    "count negative": (ply(TWO, vertices(-2)), "line 3: expected 'element'"),
    "count fraction": (ply(TWO, vertices(2.5)), "line 3: expected 'element'"),
    "count hexadecimal": (ply(TWO, vertices("0x2")), "line 3: expected 'element'"),
    "count arabic digit": (ply(TWO, vertices("\u0662").encode().decode("latin-1")), "line 3: expected"),
    "count of 100000 digits": (ply(TWO, vertices("9" * 100_000)), "line 3: expected 'element'"),
    "count too big by one": (ply(TWO, vertices(3)), "line 3: .*at least 36 bytes, but 24 bytes are left"),
    "count too small by one": (ply(TWO, vertices(1)), "byte 127: 12 bytes follow"),
    "element after end": (ply(TWO) + b"element face 1\n", "15 bytes follow the data"),
    "element of another name": (ply(TWO, f"element vertices 2\n{XYZ}"), "no element vertex"),
    "vertex twice": (ply(TWO, f"{vertices(1)}\n{vertices(1)}"), "line 7: a second element"),
    "no properties": (ply(TWO, "element vertex 2"), "rows but no properties"),
    "property before an element": (ply(TWO, f"property float q\n{vertices(2)}"), "line 3: a property before"),
    "property twice": (ply(TWO, f"{vertices(2)}\nproperty float x"), "line 7: a second property 'x'"),
    "property of type bool": (ply(TWO, f"{vertices(2)}\nproperty bool q"), "line 7: unknown type 'bool'"),
    "z missing": (ply(TWO[:16], vertices(2).replace("\nproperty float z", "")), "no single value z"),
    "x as a list": (
        ply(TWO, vertices(2).replace("float x", "list uchar float x")),
        "line 3: .*no single value x",
    ),
    "x in capitals": (ply(TWO, vertices(2).replace("float x", "float X")), "no single value x"),
    "truncated in the middle": (ply(TWO[:13]), "line 3: .*13 bytes are left"),
    "truncated by one byte": (ply(TWO[:-1]), "line 3: .*23 bytes are left"),
    "truncated by ftp": (ply(b"\r\n" * 4 + TWO), "8 bytes follow"),
    "binary called ascii": (text(struct.pack("<6f", *[1 / 3] * 6)), "line 8"),
    "ascii called binary": (ply("0.25 1.5 2\n3 4 5\n"), "line 3: .*17 bytes are left|"),
    "list length -1": (with_list("char", b"\xff" + bytes(12)), "byte .*negative length"),
    "list length -2147483648": (with_list("int", b"\0\0\0\x80" + bytes(12)), "byte .*negative length"),
    "list length 2 to the 64": (with_list("uint64", b"\xff" * 20), "byte .*does not end within"),
    "list length huge": (with_list("uint", b"\xff\xff\xff\x7f" + bytes(12)), "byte .*does not end within"),
    "list length a fraction": (with_list("float", bytes(16)), "line 8: the length of a list cannot"),
    "list cut": (with_list("uchar", b"\x03" + bytes(11)), "byte .*does not end within"),
    "list of lists": (
        ply(TWO, f"{vertices(2)}\nproperty list uchar list uchar int q"),
        "line 7: expected 'property",
    ),
    "rows of nothing": (
        ply(TWO, f"{vertices(2)}\nelement face {10**9}\nproperty list uchar int i"),
        "line 7: .*rows of element",
    ),
    "rows of no bytes": (ply(TWO, f"{vertices(2)}\nelement ghost {10**15}"), "ghost has rows but no prop"),
    "ascii word": (text("0 1 two\n3 4 5\n"), "line 8: 'two' is not a number"),
    "ascii comma": (text("0,1,2\n3,4,5\n"), "line 8: expected 3 values, found 1"),
    "ascii decimal comma": (text("0,5 1 2\n3 4 5\n"), "line 8: '0,5' is not a number"),
    "ascii underscore": (text("0 1_0 2\n3 4 5\n"), "line 8: '1_0' is not a number"),
    "ascii hexadecimal": (text("0x10 1 2\n3 4 5\n"), "line 8: '0x10' is not a number"),
    "ascii nul": (text("0 1\0 2\n3 4 5\n"), "line 8: .* is not a number"),
    "ascii short row": (text("0.5 1\n3 4 5\n"), "line 8: expected 3 values, found 2"),
    "ascii long row": (text("0 1 2 9\n3 4 5\n"), "line 8: expected 3 values, found 4"),
    "ascii row missing": (text("0.5 1.5 2.5\n"), "promises 2 rows .* ends after 1|ends after 1"),
    "ascii row too many": (text(TEXT + "6 7 8\n"), "byte .*6 bytes follow"),
    "ascii rows on one line": (text("0 1 2 3 4 5\n"), "line 8: expected 3 values, found 6"),
    "ascii cut in a number": (text("0.5 1 2\n3 4"), "line 9: expected 3 values, found 2"),
    "ascii 1e400 as a whole number": (
        text("0 1 2 1e400\n3 4 5 1\n", f"{vertices(2)}\nproperty int q"),
        "line 9: '1e400' does not fit q",
    ),
    "ascii 256 as uchar": (
        text("0 1 2 256\n3 4 5 1\n", f"{vertices(2)}\nproperty uchar q"),
        "line 9: '256' does not fit q",
    ),
    "ascii -1 as uint": (
        text("0 1 2 1\n3 4 5 -1\n", f"{vertices(2)}\nproperty uint q"),
        "line 10: '-1' does not fit q",
    ),
    "ascii nan as int": (
        text("0 1 2 nan\n3 4 5 1\n", f"{vertices(2)}\nproperty int q"),
        "line 9: 'nan' does not fit q",
    ),
    "ascii list length -1": (
        text(TEXT + "-1\n", f"{vertices(2)}\n{FACES.replace('uchar', 'char')}"),
        "line 12",
    ),
    "ascii list length 1e9": (
        text(TEXT + "1e9 0 1 0\n", f"{vertices(2)}\n{FACES.replace('uchar', 'uint')}"),
        "line 12: .*1000000000",
    ),
    "ascii crlf header alone": (
        ply(TWO).replace(b"\n", b"\r\n").replace(TWO, TWO[:12]),
        "bytes are left in the file",
    ),
}
GRIDS = {
    "range grid not there": (text(TEXT), "no element range_grid"),
    "range grid beyond the vertices": (text(TEXT + "1 0\n1 7\n", GRID), "a vertex outside 0 to 1"),
    "range grid of negative vertex": (text(TEXT + "1 0\n1 -1\n", GRID), "a vertex outside 0 to 1"),
    "range grid with two in a pixel": (text(TEXT + "2 0 1\n0\n", GRID), "more than one vertex"),
    "range grid of other size": (text(TEXT + "1 0\n0\n", GRID.replace("cols 2", "cols 999999")), "is not 2"),
    "range grid without size": (
        text(TEXT + "1 0\n0\n", GRID.replace("obj_info num_cols 2\n", "")),
        "num_cols",
    ),
}
PLY = single("ply", "points", ".ply", POINTS) + single("ply", "range grid", ".ply", GRIDS)
