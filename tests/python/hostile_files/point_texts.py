"""Hostile XYZ texts and NPZ archives."""

import io
import struct
import zipfile
import zlib

from hostile_files.case import single


def npz(**members: bytes) -> bytes:
    """Return an archive of members."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in members.items():
            archive.writestr(zipfile.ZipInfo(f"{name}.npy"), data)
    return stream.getvalue()


def npy(shape: str, descr: str = "'<f8'", body: bytes = bytes(48)) -> bytes:
    """Return an array whose header says this."""
    header = f"{{'descr': {descr}, 'fortran_order': False, 'shape': {shape}}}".ljust(117).encode() + b"\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header + body


TWO = npy("(2, 3)")
_XYZ = {
    "xyz empty": ("", "line 1: there is no point"),
    "xyz of comments": ("# a\n" * 20_000, "line 10001: more than 10000 comments"),
    "xyz nul bytes": (bytes(3000), "line 1: expected x y z"),
    "xyz of one endless line": ("1 " * 100_000, "line 1: expected x y z"),
    "xyz of endless names": ("# " + "x y z " * 30_000 + "\n1 2 3 4 5\n", "line 2: expected x y z"),
    "xyz word": ("1 2 3\n4 five 6\n", "line 2: 'five' is not a number"),
    "xyz underscore": ("1 2 3\n4 5_5 6\n", "line 2: '5_5' is not a number"),
    "xyz short": ("1 2 3\n4 5\n", "line 2: expected 3 values, found 2"),
    "xyz of five": ("1 2 3 4 5\n", "line 1: expected x y z"),
    "xyz short of its names": ("# x y z q\n1 2 3\n", "line 2: expected 4 values, found 3"),
}
_NPZ = {
    "npz empty": (b"", "not a readable .npz"),
    "npz of another program": (b"PK\x03\x04" + bytes(100), "not a readable .npz"),
    "npz cut": (npz(points=TWO)[:-30], "not a readable .npz"),
    "npz of nothing": (npz(), "no array points in it, but nothing"),
    "npz without points": (npz(p=TWO), "no array points in it, but p"),
    "npz of pairs": (npz(points=npy("(3, 2)")), r"points must have shape \(N, 3\)"),
    "npz shape huge": (npz(points=npy("(1000000000000, 3)")), "promises 24000000000000 bytes, 48 are there"),
    "npz shape negative": (npz(points=npy("(-2, -3)")), "points must be an array of numbers"),
    "npz of objects": (npz(points=npy("(2, 3)", "'|O'")), "points must be an array of numbers"),
    "npz of records": (npz(points=npy("(2, 3)", "[('x', '<f8')]")), "points must be an array of numbers"),
    "npz header garbage": (npz(points=b"\x93NUMPY\x01\x00\x04\x00oops"), "not a readable .npy"),
    "npz header a call": (npz(points=npy("exit()")), "not a readable .npy"),
    "npz goes on": (npz(points=TWO + b"more"), "4 bytes follow"),
    "npz normals of another length": (npz(points=TWO, normals=npy("(1, 3)", body=bytes(24))), "normals must"),
    "npz wrong check sum": (
        npz(points=TWO).replace(struct.pack("<I", zlib.crc32(TWO)), b"\0\0\0\0"),
        "not a readable .npz",
    ),
}
POINT_TEXTS = single("points", "points", ".xyz", _XYZ) + single("points", "points", ".npz", _NPZ)
