"""Hostile PLY files."""

import struct

import numpy as np
from ply_files import MIXED, mixed_binary, mixed_text

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


def without(line: str) -> bytes:
    """Return a PLY file whose header misses a line."""
    return ply(TWO).replace(line.encode() + b"\n", b"")


def vertices(count: object) -> str:
    """Return an element of as many vertices."""
    return f"element vertex {count}\n{XYZ}"


_random = np.random.default_rng(1)

POINTS = {
    "empty": (b"", "the file is empty"),
    "blank": (b"\n\n", "line 1: a PLY file begins with 'ply'"),
    "magic only": (b"ply\n", "line 2: .*before end_header"),
    "magic without line end": (b"ply", "line 2: .*before end_header"),
    "magic and nothing else": (b"ply\nply\nply\n", "line 4: .*before end_header"),
    "magic with a letter more": (b"plyx" + ply(TWO)[3:], "line 1: a PLY file begins with 'ply'"),
    "magic of a PNG": (b"\x89PNG\r\n\x1a\n" + bytes(range(256)), "line 1: a PLY file begins with 'ply'"),
    "magic of another format": (b"# .PCD v0.7\n", "line 1: a PLY file begins with 'ply'"),
    "garbage": (_random.bytes(1024), "line 1: a PLY file begins"),
    "nul bytes": (bytes(512), "line 1: a PLY file begins"),
    "gzip": (b"\x1f\x8b\x08\x00" + _random.bytes(64), "line 1: a PLY file begins"),
    "utf-16": (ply(TWO).decode("latin-1").encode("utf-16"), "line 1: a PLY file begins"),
    "utf-8 with a mark": (b"\xef\xbb\xbf" + ply(TWO), "line 1: a PLY file begins"),
    "header without end": (ply(TWO).split(b"end_header")[0], "before end_header"),
    "header without the line end_header": (without("end_header"), "line 7"),
    "header whose end has more": (ply(TWO, f"{vertices(2)}\nend_header here"), "line 7: unknown keyword"),
    "header of an unknown line": (ply(TWO, f"elephant\n{vertices(2)}"), "line 3: unknown keyword .*elephant"),
    "header with a word almost right": (ply(TWO, f"Element face 1\n{vertices(2)}"), "did you mean 'element'"),
    "header with a stray line and a count too big": (
        ply(TWO, f"by hand\n{vertices(3)}"),
        "at least 36 bytes",
    ),
    "header with a line that is no text": (ply(TWO, f"by \1\n{vertices(2)}"), "line 3: unknown keyword"),
    "header of one endless line": (b"ply\n" + b"x" * 200_000, "line 3: .*before end_header"),
    "header of blank lines": (b"ply\n" + b"\n" * 100_000, "line 10002: more than 10000 comments"),
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
    "no format": (without("format binary_little_endian 1.0"), "no line 'format'"),
    "format twice": (ply(TWO, f"format ascii 1.0\n{vertices(2)}"), "line 3: a second line 'format'"),
    "format unknown": (ply(TWO, form="binary_middle_endian"), "line 2: expected 'format'"),
    "format of version 2": (ply(TWO).replace(b"1.0", b"2.0"), "line 2: expected 'format'"),
    "format without version": (ply(TWO).replace(b" 1.0", b""), "line 2: expected 'format'"),
    "format with nothing": (b"ply\nformat\r\r\r", "line 2: expected 'format'"),
    "format without a space": (b"ply\nformatascii 1.0", "line 2: unknown keyword"),
    "count huge": (ply(TWO, vertices(10**12)), "line 3: .*promises 1000000000000 rows"),
    "count 2 to the 63": (ply(TWO, vertices(2**63)), "line 3: .*promises 9223372036854775808 rows"),
    "count wraps to 2": (ply(TWO, vertices(2**64 // 12 + 2)), "line 3: .*promises"),
    **{
        f"count {what}": (ply(TWO, vertices(count)), "line 3: expected 'element'")
        for what, count in (
            ("negative", -2),
            ("fraction", 2.5),
            ("with a point", 2.0),
            ("of letters", "two"),
            ("hexadecimal", "0x2"),
            ("superscript", "\xb2"),
            ("arabic digit", "\u0662".encode().decode("latin-1")),
            ("of 5000 digits", "9" * 5000),
            ("of 100000 digits", "9" * 100_000),
            ("missing", ""),
            ("and another", "2 3"),
        )
    },
    **{
        f"promised {what} {form} {count}": (
            ply(b"\xff" * 36, element.replace("COUNT", str(count)), form),
            "line [37]: .*promises|byte .*does not end within|line 9",
        )
        for count in (10**6, 2**32, 10**12, 2**62)
        for form in ("ascii", "binary_little_endian")
        for what, element in (
            ("vertices", vertices("COUNT")),
            ("lists", f"{vertices(0)}\nelement face COUNT\nproperty list uint double i"),
        )
    },
    "count 0": (ply(TWO, vertices(0)), "byte 115: 24 bytes follow"),
    "count too big by one": (ply(TWO, vertices(3)), "line 3: .*at least 36 bytes, but 24 bytes are left"),
    "count too small by one": (ply(TWO, vertices(1)), "byte 127: 12 bytes follow"),
    "element without a name": (ply(TWO, f"element 2\n{XYZ}"), "line 3: expected 'element'"),
    "element after end": (ply(TWO) + b"element face 1\n", "15 bytes follow the data"),
    "element of another name": (ply(TWO, f"element vertices 2\n{XYZ}"), "no element vertex"),
    "element of another name, and no rows": (ply(b"", f"element point 0\n{XYZ}"), "no element vertex"),
    "no elements": (ply(b"", "comment nothing"), "no element vertex"),
    "vertex twice": (ply(TWO, f"{vertices(1)}\n{vertices(1)}"), "line 7: a second element"),
    "no properties": (ply(TWO, "element vertex 2"), "rows but no properties"),
    "property before an element": (ply(TWO, f"property float q\n{vertices(2)}"), "line 3: a property before"),
    "property twice": (ply(TWO, f"{vertices(2)}\nproperty float x"), "line 7: a second property 'x'"),
    "property of type bool": (ply(TWO, f"{vertices(2)}\nproperty bool q"), "line 7: unknown type 'bool'"),
    **{
        f"property {kind}": (ply(TWO, f"{vertices(2)}\nproperty {kind}"), "line 7" + said)
        for kind, said in (
            ("w", ""),
            ("list uchar quux w", ".*'quux'"),
            ("list int w", ""),
            ("list float int w", ": the length of a list"),
        )
    },
    "z missing": (
        ply(TWO[:16], vertices(2).replace("\nproperty float z", "")),
        "line 3: .*no single value z",
    ),
    "x as a list": (
        ply(TWO, vertices(2).replace("float x", "list uchar float x")),
        "line 3: .*no single value x",
    ),
    "x in capitals": (ply(TWO, vertices(2).replace("float x", "float X")), "no single value x"),
    "truncated in the middle": (ply(TWO[:13]), "line 3: .*13 bytes are left"),
    "truncated by one byte": (ply(TWO[:-1]), "line 3: .*23 bytes are left"),
    "truncated before the data": (ply(b""), "line 3: .*0 bytes are left"),
    "goes on": (ply(TWO + b"\1"), "byte 139: 1 bytes follow"),
    "truncated by ftp": (ply(b"\r\n" * 4 + TWO), "8 bytes follow"),
    "binary called ascii": (text(struct.pack("<6f", *[1 / 3] * 6)), "line 8"),
    "ascii called binary": (ply("0.25 1.5 2\n3 4 5\n"), "line 3: .*17 bytes are left|"),
    "list length -1": (with_list("char", b"\xff" + bytes(12)), "byte .*negative length"),
    "list length -2147483648": (with_list("int", b"\0\0\0\x80" + bytes(12)), "byte .*negative length"),
    "list length 2 to the 64": (with_list("uint64", b"\xff" * 20), "byte .*does not end within"),
    "list length huge": (with_list("uint", b"\xff\xff\xff\x7f" + bytes(12)), "byte .*does not end within"),
    "list length 2 to the 32 - 1": (with_list("uint", b"\xff" * 8), "byte .*does not end within"),
    "list length -1 of the second": (
        with_list("char", b"\0\xff" + bytes(20)).replace(b"face 1", b"face 2"),
        "byte .*negative length",
    ),
    "list length a fraction": (with_list("float", bytes(16)), "line 8: the length of a list cannot"),
    "list cut": (with_list("uchar", b"\x03" + bytes(11)), "byte .*does not end within"),
    "list cut after others": (
        ply(mixed_binary("<")[:-1], MIXED),
        "element face does not end within the file",
    ),
    "list cut of equal ones": (
        ply(TWO + bytes([3] + 12 * [0] + [3] + 11 * [0]), MIXED[MIXED.index("element vertex") :]),
        "element face does not end within the file",
    ),
    "lists missing": (ply(TWO, MIXED[MIXED.index("element vertex") :]), "line 7: .*2 rows of element face"),
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
    "ascii number with a tail": (text("0 0 0\n0 1.5f 0\n"), "line 9: '1.5f' is not a number"),
    "ascii word after a blank line": (text("0 0 0\n\n0 a 0\n"), "line 10: 'a' is not a number"),
    "ascii comma": (text("0,1,2\n3,4,5\n"), "line 8: expected 3 values, found 1"),
    "ascii decimal comma": (text("0,5 1 2\n3 4 5\n"), "line 8: '0,5' is not a number"),
    "ascii underscore": (text("0 1_0 2\n3 4 5\n"), "line 8: '1_0' is not a number"),
    "ascii hexadecimal": (text("0x10 1 2\n3 4 5\n"), "line 8: '0x10' is not a number"),
    "ascii nul": (text("0 1\0 2\n3 4 5\n"), "line 8: .* is not a number"),
    "ascii short row": (text("0.5 1\n3 4 5\n"), "line 8: expected 3 values, found 2"),
    "ascii long row": (text("0 1 2 9\n3 4 5\n"), "line 8: expected 3 values, found 4"),
    "ascii row missing": (text("0.5 1.5 2.5\n"), "promises 2 rows .* ends after 1|ends after 1"),
    "ascii row missing and short": (text("0 0 0\n"), "6 bytes are left"),
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
    "ascii list length 1.5": (
        text(TEXT + "1.5 0\n", f"{vertices(2)}\n{FACES.replace('uchar', 'char')}"),
        "line 12: '1.5' does not fit the length of vertex_indices",
    ),
    "ascii list cut": (text(mixed_text().replace("4 1 0 1 0", "4 1 0 1"), MIXED), "line 21: .*4 values"),
    "ascii list longer": (
        text(mixed_text().replace("4 1 0 1 0", "3 1 0 1 0"), MIXED),
        "line 21: .*more values",
    ),
    "ascii list missing": (
        text(TEXT + "100\n", f"{vertices(2)}\nelement face 1\nproperty uchar k\nproperty list char int i"),
        "line 13: the line ends before i",
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
