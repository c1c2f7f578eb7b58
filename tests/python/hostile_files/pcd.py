"""Hostile PCD files."""

import struct

import numpy as np

from hostile_files.case import single

TWO = struct.pack("<6f", 0, 1, 2, 3, 4, 5)
_LINES = {
    "VERSION": "0.7", "FIELDS": "x y z", "SIZE": "4 4 4", "TYPE": "F F F", "COUNT": "1 1 1", "WIDTH": "2",
    "HEIGHT": "1", "VIEWPOINT": "0 0 0 1 0 0 0", "POINTS": "2",
}  # fmt: skip


def pcd(body: bytes, data: str = "binary", **changes: object) -> bytes:
    """Return a PCD file with some lines of its header changed, or left out where they are None."""
    lines = {**_LINES, **changes, "DATA": data}
    header = "".join(f"{key} {value}\n" for key, value in lines.items() if value is not None)
    return header.encode("latin-1") + body


def packed(*codes: int, size: int = 24, told: int | None = None) -> bytes:
    """Return a compressed PCD file of these bytes of LZF."""
    body = bytes(codes)
    return pcd(struct.pack("<II", len(body) if told is None else told, size) + body, "binary_compressed")


_random = np.random.default_rng(2)
POINTS = {
    "empty": (b"", "the file is empty"),
    "garbage": (_random.bytes(512), "line 1"),
    "nul bytes": (bytes(512), "line 1: unknown keyword"),
    "utf-16": (pcd(TWO).decode("latin-1").encode("utf-16"), "line 1: unknown keyword"),
    "utf-8 with a mark": (b"\xef\xbb\xbf" + pcd(TWO), "line 1: unknown keyword"),
    "header without DATA": (pcd(TWO).split(b"DATA")[0], "ends before DATA"),
    "header without DATA before the data": (pcd(TWO).replace(b"DATA binary\n", b""), "unknown keyword"),
    "header of blank lines": (b"\n\n", "line 3: the file ends before DATA"),
    "header of a comment": (
        b"# .PCD v0.7 - Point Cloud Data file format",
        "line 2: the file ends before DATA",
    ),
    "header of a PNG": (b"\x89PNG\r\n\x1a\n" + bytes(range(256)), "line 1: unknown keyword"),
    "header of a PLY": (b"ply\nformat ascii 1.0\n", "line 1: unknown keyword .*'ply'"),
    "header in small letters": (pcd(TWO).replace(b"FIELDS", b"fields"), "line 2: unknown keyword"),
    "header of one endless line": (b"x" * 200_000, "line 1: unknown keyword"),
    "header of comments": (b"#\n" * 60_000, "line 10001: more than 10000 comments"),
    "header of comments and a viewpoint": (
        b"# a\n" * 10_000 + pcd(TWO, VIEWPOINT="1 0 0 1 0 0 0"),
        "line 10010: more than 10000 comments, .*VIEWPOINT",
    ),
    "DATA of another kind": (pcd(TWO, "zstd"), "line 10: DATA must be one of"),
    "VERSION 9": (pcd(TWO, VERSION="9"), "VERSION must be"),
    **{
        f"{key} missing": (pcd(TWO, **{key: None}), said)
        for key, said in (
            ("FIELDS", "no line FIELDS"),
            ("SIZE", "no line SIZE"),
            ("TYPE", "no line TYPE"),
            ("WIDTH", "WIDTH must be a whole number"),
        )
    },
    "FIELDS without z": (pcd(TWO, FIELDS="x y w"), "no field z"),
    "FIELDS twice x": (pcd(TWO, FIELDS="x x z"), "named twice"),
    "FIELDS of 20000 names": (pcd(b"", FIELDS="x y z " + "a " * 20_000), "more than 10000 fields"),
    "SIZE 3": (pcd(TWO, SIZE="4 4 3"), "unknown TYPE F of SIZE 3"),
    "SIZE 1 of a float": (pcd(TWO, SIZE="4 4 1"), "field 'z' has unknown TYPE F of SIZE 1"),
    "SIZE 3 of an integer": (pcd(TWO, SIZE="4 4 3", TYPE="F F I"), "field 'z' has unknown TYPE I of SIZE 3"),
    "SIZE 0": (pcd(TWO, SIZE="4 4 0"), "unknown TYPE F of SIZE 0"),
    "SIZE negative": (pcd(TWO, SIZE="4 4 -4"), "unknown TYPE F of SIZE -4"),
    "SIZE of two fields": (pcd(TWO, SIZE="4 4"), "SIZE has 2 values for 3 FIELDS"),
    "TYPE of four fields": (pcd(TWO, TYPE="F F F F"), "TYPE has 4 values for 3 FIELDS"),
    "COUNT of one field": (pcd(TWO, COUNT="1"), "COUNT has 1 values for 3 FIELDS"),
    "COUNT 2 of z": (pcd(TWO, COUNT="1 1 2"), "no field z with COUNT 1"),
    "TYPE of letters": (pcd(TWO, TYPE="F F Q"), "unknown TYPE Q"),
    "COUNT 0": (pcd(TWO, COUNT="1 1 0"), "COUNT 0"),
    "COUNT negative": (pcd(TWO, COUNT="1 1 -1"), "COUNT must be a whole number"),
    **{
        f"COUNT huge of {points} points": (
            pcd(
                TWO,
                FIELDS="x y z w",
                SIZE="4 4 4 4",
                TYPE="F F F F",
                COUNT=f"1 1 1 {count}",
                WIDTH=points,
                POINTS=points,
            ),
            "too large",
        )
        for points, count in ((2, 2**40), (0, 999_999_999))
    },
    "WIDTH times HEIGHT wraps to 2": (
        pcd(TWO, WIDTH=2**63 + 1, HEIGHT=2, POINTS=None),
        "promises 18446744073709551618 points",
    ),
    "WIDTH times HEIGHT 2 to the 64": (pcd(TWO, WIDTH=2**32, HEIGHT=2**32, POINTS=None), "byte .*promises"),
    "WIDTH negative": (pcd(TWO, WIDTH=-2), "WIDTH must be a whole number"),
    "WIDTH fraction": (pcd(TWO, WIDTH=2.0), "WIDTH must be a whole number"),
    "WIDTH of 100000 digits": (pcd(TWO, WIDTH="9" * 100_000), "WIDTH must be a whole number"),
    "POINTS of 5000 digits": (pcd(TWO, POINTS="9" * 5000), "POINTS must be a whole number"),
    "POINTS superscript": (pcd(TWO, POINTS="\xb2"), "POINTS must be a whole number"),
    **{
        f"POINTS {count} {form}": (
            pcd(struct.pack("<II", 28, 12 * 10**8) + b"\xff" * 28, form, WIDTH=count, POINTS=count),
            said,
        )
        for count in (10**8, 10**12, 2**62)
        for form, said in (
            ("ascii", "byte .*promises"),
            ("binary", "byte .*promises"),
            ("binary_compressed", "byte .*cannot hold|byte .*which is not"),
        )
    },
    "HEIGHT word": (pcd(TWO, HEIGHT="one"), "HEIGHT must be a whole number"),
    "POINTS huge": (pcd(TWO, WIDTH=10**12, POINTS=10**12), "byte .*promises 1000000000000 points"),
    "POINTS not WIDTH times HEIGHT": (pcd(TWO, POINTS=4), "POINTS 4 is not WIDTH 2 times HEIGHT 1"),
    "POINTS too big by one": (pcd(TWO, WIDTH=3, POINTS=3), "byte .*24 bytes are left"),
    "POINTS too small by one": (pcd(TWO, WIDTH=1, POINTS=1), "byte .*12 bytes follow"),
    "POINTS missing": (pcd(TWO, WIDTH=None, HEIGHT=None, POINTS=None), "POINTS must be a whole number"),
    "line twice": (pcd(TWO, VERSION="0.7\nWIDTH 2"), "a second line WIDTH"),
    "line without value": (pcd(TWO, WIDTH=""), "no value after WIDTH"),
    "line unknown": (pcd(TWO, VERSION="0.7\nSHAPE 2"), "line 2: unknown keyword"),
    "truncated in the middle": (pcd(TWO[:13]), "byte .*13 bytes are left"),
    "truncated by one byte": (pcd(TWO[:-1]), "byte .*23 bytes are left"),
    "truncated before the data": (pcd(b""), "byte .*0 bytes are left"),
    "more after the end": (pcd(TWO + b"\1"), "byte .*1 bytes follow"),
    "text word": (pcd(b"0 1 two\n3 4 5\n", "ascii"), "line 11: 'two' is not a number"),
    "text short row": (pcd(b"0.5 1\n3 4 5\n", "ascii"), "line 11: expected 3 values, found 2"),
    "text long row": (pcd(b"0 1 2\n3 4 5 6\n", "ascii"), "line 12: expected 3 values, found 4"),
    "text long row after a blank line": (
        pcd(b"0 0 0\n\n0 0 0 0\n", "ascii"),
        "line 13: expected 3 values, found 4",
    ),
    "text row missing": (pcd(b"0.5 1.5 2.5\n", "ascii"), "ends after 1"),
    "text row too many": (pcd(b"0 1 2\n3 4 5\n6 7 8\n", "ascii"), "6 bytes follow"),
    "text of bytes": (pcd(b"\xff\xfe\xfd\xfc" * 6, "ascii"), "line 11"),
    "text 1e400 in a whole field": (
        pcd(b"0 1 1e400\n3 4 5\n", "ascii", TYPE="F F I"),
        "line 11: '1e400' does not fit z",
    ),
    "text 300 in a byte": (
        pcd(b"0 1 300\n3 4 5\n", "ascii", TYPE="F F U", SIZE="4 4 1"),
        "line 11: '300' does not fit z",
    ),
    "text half in a whole field": (
        pcd(b"0 0 0.5\n0 0 0\n", "ascii", TYPE="F F I"),
        "line 11: '0.5' does not fit z",
    ),
    **{
        f"text {number} in 64 bits": (
            pcd(f"0 0 0\n0 0 {number}\n".encode(), "ascii", SIZE="4 4 8", TYPE="F F U"),
            "does not fit uint64",
        )
        for number in (2**64, "1e15")
    },
    "lzf without sizes": (pcd(b"\0" * 7, "binary_compressed"), "byte .*before the compressed data"),
    "lzf longer than the file": (packed(2, 1, 2, 3, told=500), "byte .*500 bytes of compressed data"),
    "lzf shorter than the file": (packed(2, 1, 2, 3, told=3), "byte .*1 bytes follow"),
    "lzf bomb": (
        pcd(struct.pack("<II", 4, 12 * 10**8) + bytes(4), "binary_compressed", WIDTH=10**8, POINTS=10**8),
        "byte .*cannot hold 1200000000 bytes",
    ),
    "lzf of nothing": (packed(), "byte .*0 bytes of compressed data cannot hold 24 bytes"),
    "lzf of 4 GB": (packed(2, 1, 2, 3, size=2**32 - 1), "byte .*which is not 2 points"),
    "lzf of other size": (packed(2, 1, 2, 3, size=4), "byte .*is not 2 points"),
    "lzf points outside": (packed(0, 1, 0x20, 40), "byte .*before its beginning"),
    "lzf points outside by one": (packed(0, 1, 0x20, 1), "byte .*before its beginning"),
    "lzf cut in a short copy": (packed(0, 1, 0x20), "byte .*in the middle of an instruction"),
    "lzf points outside at once": (packed(0xE0, 255, 255), "byte .*before its beginning"),
    "lzf cut in a literal": (packed(31, 1, 2, 3), "byte .*in the middle of an instruction"),
    "lzf cut in a copy": (packed(0, 1, 0xE0), "byte .*in the middle of an instruction"),
    "lzf gives too much": (packed(0, 1, 0xE0, 255, 0), "byte .*does not give the 24 bytes"),
    "lzf gives too little": (packed(3, 1, 2, 3, 4), "byte .*does not give the 24 bytes"),
}
PCD = single("pcd", "points", ".pcd", POINTS)
