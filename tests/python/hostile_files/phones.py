"""Hostile recordings of phones: Record3D's archives, Stray Scanner's folders."""

import bz2
import json
import struct
import zipfile
import zlib
from io import BytesIO

from hostile_files.case import Case
from hostile_files.depth_images import pgm

SIZE = 4 * 3 * 4
TOLD = {
    "w": 8,
    "h": 6,
    "dw": 4,
    "dh": 3,
    "fps": 30,
    "K": [8, 0, 0, 0, 8, 0, 4, 3, 1],
    "poses": [[0, 0, 0, 1, 0, 0, 0]],
}
PLANE = b"bvx-" + struct.pack("<I", SIZE) + struct.pack("<f", 1.5) * 12 + b"bvx$"  # LZFSE, as it is


def lying_lzfse(told: int) -> bytes:
    """Return a block of LZVN that says how long it is, and is longer."""
    payload = b"\xe1\x00" + b"\x38\x01" + b"\xf0\xff" * 1000 + b"\x06" + bytes(7)
    return b"bvxn" + struct.pack("<II", told, len(payload)) + payload + b"bvx$"


def short_lzfse(told: int) -> bytes:
    """Return a block of LZVN, as long as PLANE, that says that it holds more than it can."""
    size = len(PLANE) - 16
    return b"bvxn" + struct.pack("<II", told, size) + bytes(size) + b"bvx$"


def archive(files: dict[str, bytes], compression: int = zipfile.ZIP_STORED) -> bytes:
    """Return a .r3d archive."""
    stream = BytesIO()
    with zipfile.ZipFile(stream, "w", compression) as packed:
        for name, data in files.items():
            packed.writestr(zipfile.ZipInfo(name), data, compression)
    return stream.getvalue()


def r3d(told: object = None, **more: bytes) -> bytes:
    """Return a .r3d archive of one frame; other files by their names, / and . written __ and _."""
    text = json.dumps(TOLD if told is None else told).encode()
    return archive({"metadata": text, "rgbd/0.depth": PLANE, **more})


def with_told(**changes: object) -> bytes:
    """Return a .r3d archive whose metadata say something else."""
    return r3d({**TOLD, **changes})


def raw(text: bytes) -> bytes:
    """Return a .r3d archive whose metadata are this text."""
    return archive({"metadata": text, "rgbd/0.depth": PLANE})


def depth(data: bytes, compression: int = zipfile.ZIP_STORED) -> bytes:
    """Return a .r3d archive whose depth image is this."""
    return archive({"metadata": json.dumps(TOLD).encode(), "rgbd/0.depth": data}, compression)


def _nameless(data: bytes) -> bytes:
    """Return an archive whose last file has a name of no letters in the archive's list."""
    at = data.rfind(b"PK\x01\x02")
    return data[: at + 28] + bytes(2) + data[at + 30 :]


_good = r3d()
_bz2_bomb = archive({"metadata": bytes(1 << 22), "rgbd/0.depth": PLANE}, zipfile.ZIP_BZIP2)
_lies = bytearray(archive({"metadata": json.dumps(TOLD).encode() + b" " * (1 << 22)}, zipfile.ZIP_DEFLATED))
for _at in (_lies.find(b"PK\x03\x04") + 22, _lies.find(b"PK\x01\x02") + 24):
    _lies[_at : _at + 4] = struct.pack("<I", 20)
R3D = {
    "empty": (b"", "not a whole .r3d archive"),
    "garbage": (b"PK\x03\x04" + bytes(range(256)) * 4, "not a whole .r3d archive"),
    "cut in the middle": (_good[: len(_good) // 2], "not a whole .r3d archive"),
    "of no files": (archive({}), "metadata"),
    "of version 9.7": (
        _good.replace(b"PK\x01\x02\x14\x03\x14", b"PK\x01\x02\x14\x03\x61"),
        "not a whole .r3d",
    ),
    "of a nameless file": (_nameless(_good), "not a whole .r3d archive|damaged in the archive|missing"),
    "name leads up": (
        archive({"../rgbd/0.depth": PLANE, "metadata": b"{}"}),
        "refused: the name .*leads out",
    ),
    "name absolute": (archive({"/rgbd/0.depth": PLANE, "metadata": b"{}"}), "refused: the name .*leads out"),
    "name of another drive": (
        archive({"C:/0.depth": PLANE, "metadata": b"{}"}),
        "refused: the name .*leads out",
    ),
    "name leads up by backslashes": (archive({"..\\0.depth": PLANE, "metadata": b"{}"}), "refused: the name"),
    "bomb of metadata": (
        archive({"metadata": b"[" + b"0," * (1 << 24) + b"0]", "rgbd/0.depth": PLANE}, zipfile.ZIP_DEFLATED),
        "metadata: larger than",
    ),
    "bomb of metadata in bzip2": (_bz2_bomb, "refused: .*compress"),
    "bomb of a depth image": (depth(bytes(1 << 24), zipfile.ZIP_DEFLATED), "0.depth: larger than"),
    "size lies": (bytes(_lies), "damaged in the archive|metadata"),
    "crc wrong": (_good.replace(struct.pack("<f", 1.5), struct.pack("<f", 2.5), 1), "damaged in the archive"),
    "encrypted": (
        _good.replace(b"PK\x01\x02\x14\x03\x14\x00\x00", b"PK\x01\x02\x14\x03\x14\x00\x01"),
        "damaged|enc",
    ),
    "metadata no json": (raw(b"{"), "metadata, line 1: not a JSON file"),
    "metadata deep": (raw(b"[" * 100_000), "metadata.*nested"),
    "metadata a list": (raw(b"[]"), "metadata: .*object"),
    "metadata key twice": (raw(b'{"w": 1, "w": 2}'), "metadata: .*twice"),
    "metadata utf-16": (raw("{}".encode("utf-16")), "metadata, byte 0: not text"),
    "width 2 to the 31": (with_told(w=2**31), "w must be a number of pixels"),
    "width of depth 2 to the 31": (with_told(dw=2**31), "dw must be a number of pixels"),
    "width of depth a text": (with_told(dw="4"), "dw must be a number of pixels"),
    "width negative": (with_told(w=-8), "w must be a number of pixels"),
    "K of words": (with_told(K=["a"] * 9), "K must be a table of numbers"),
    "K of eight": (with_told(K=[1] * 8), "K must be nine numbers"),
    "K of zeros": (with_told(K=[0] * 9), "metadata: .*fx"),
    "K an object": (with_told(K={"a": 1}), "K must be"),
    "poses of zero length": (with_told(poses=[[0] * 7]), r"poses\[0\]: quaternions"),
    "poses at 1e300": (
        with_told(poses=[[0, 0, 0, 1, 0, 0, 1e300]]),
        r"poses\[0\] is more than 1e.30 m",
    ),
    "poses of six": (with_told(poses=[[0] * 6]), "poses must have 7 finite numbers"),
    "poses of many lengths": (with_told(poses=[[0] * 7, [0]]), "poses must be a table of numbers"),
    "poses a text": (with_told(poses="0001000"), "poses must"),
    "times infinite": (
        raw(json.dumps({**TOLD, "frameTimestamps": [float("inf")]}).encode()),
        "frameTimestamps",
    ),
    "fps a list": (with_told(fps=[30]), "fps must be"),
    "fps nan": (raw(json.dumps({**TOLD, "fps": float("nan")}).encode()), "fps must be"),
    "depth no lzfse": (depth(b"not lzfse at all"), "0.depth, byte .*: the LZFSE data is damaged"),
    "depth empty": (depth(b""), "0.depth, byte .*: the LZFSE data is damaged"),
    "depth cut": (depth(PLANE[:-20]), "0.depth, byte .*: the LZFSE data is damaged"),
    "depth of other size": (
        depth(PLANE.replace(struct.pack("<I", SIZE), struct.pack("<I", 40))),
        "0.depth, byte 48: the LZFSE data is damaged",
    ),
    "depth bomb of lzvn": (depth(lying_lzfse(SIZE)), "0.depth: "),
    "depth promises 4 GB": (depth(lying_lzfse(2**32 - 1)), "0.depth: refused: .*4294967295"),
    "depth larger than lzvn can hold": (
        r3d({**TOLD, "dw": 4000, "dh": 4000}, **{"rgbd/0.depth": short_lzfse(4 * 4000 * 4000)}),
        "0.depth.*: refused: .*64000000 bytes, and cannot hold more than",
    ),
    "depth of zlib": (depth(zlib.compress(bytes(48))), "0.depth, byte .*: the LZFSE data is damaged"),
    "depth of bzip2": (depth(bz2.compress(bytes(48))), "0.depth, byte .*: the LZFSE data is damaged"),
    "colour damaged": (
        archive(
            {"metadata": json.dumps(TOLD).encode(), "rgbd/0.depth": PLANE, "rgbd/0.jpg": b"\xff\xd8\xff"}
        ),
        None,
    ),
}
HEAD = "timestamp, frame, x, y, z, qx, qy, qz, qw\n"
MATRIX = "500,0,320\n0,500,240\n0,0,1\n"


def stray(odometry: str = HEAD, matrix: str | bytes = MATRIX) -> dict[str, bytes]:
    """Return a recording of Stray Scanner."""
    camera = matrix.encode() if isinstance(matrix, str) else matrix
    image = pgm(body=bytes((3, 232)) * 12)
    return {"camera_matrix.csv": camera, "odometry.csv": odometry.encode(), "depth/000000.pgm": image}


STRAY = {
    "odometry without names": (
        stray("0,0,0,0,0,0,0,0,1\n"),
        r"odometry\.csv, line 1: the first line must name",
    ),
    "odometry of words": (stray(HEAD + "0,zero,0,0,0,0,0,0,1\n"), r"odometry\.csv, line 2: nine numbers"),
    "odometry short": (stray(HEAD + "0,0,0,0,0,0,0\n"), r"odometry\.csv, line 2: nine numbers"),
    "odometry of zero length": (stray(HEAD + "0,0,0,0,0,0,0,0,0\n"), r"odometry\.csv, line 2"),
    "odometry time nan": (stray(HEAD + "nan,0,0,0,0,0,0,0,1\n"), r"odometry\.csv, line 2"),
    "odometry frame nan": (stray(HEAD + "0,nan,0,0,0,0,0,0,1\n"), r"odometry\.csv, line 2"),
    "odometry frame infinite": (stray(HEAD + "0,inf,0,0,0,0,0,0,1\n"), r"odometry\.csv, line 2"),
    "odometry place infinite": (stray(HEAD + "0,0,inf,0,0,0,0,0,1\n"), r"odometry\.csv, line 2"),
    "odometry place 1e300": (stray(HEAD + "0,0,1e300,0,0,0,0,0,1\n"), r"odometry\.csv, line 2"),
    "odometry goes back in time": (
        stray(HEAD + "1,0,0,0,0,0,0,0,1\n0,1,0,0,0,0,0,0,1\n"),
        r"odometry\.csv, line 3: .*does not come",
    ),
    "matrix empty": (stray(matrix=""), r"camera_matrix\.csv"),
    "matrix of words": (stray(matrix="a,b,c\n" * 3), r"camera_matrix\.csv: three lines"),
    "matrix of two lines": (stray(matrix="1,0,0\n0,1,0\n"), r"camera_matrix\.csv"),
    "matrix of zeros": (stray(matrix="0,0,0\n" * 3), r"camera_matrix\.csv: a camera matrix with positive"),
    "matrix nan": (stray(matrix=MATRIX.replace("320", "nan")), r"camera_matrix\.csv: a camera matrix"),
    "matrix 1e308": (stray(matrix=MATRIX.replace("500", "1e308")), r"camera_matrix\.csv"),
    "matrix utf-16": (stray(matrix=MATRIX.encode("utf-16")), r"camera_matrix\.csv"),
}
PHONES = [
    *(
        Case(f"record3d/{n.replace(' ', '_')}", "recording", {"a.r3d": data}, said, "a.r3d", needs="liblzfse")
        for n, (data, said) in R3D.items()
        if said is not None
    ),
    *(Case(f"stray/{n.replace(' ', '_')}", "recording", files, said) for n, (files, said) in STRAY.items()),
]
