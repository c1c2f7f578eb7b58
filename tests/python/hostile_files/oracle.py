"""Readers written a second time, value by value and slowly: what nacre reads must be what these read."""

import json
import re
import struct
import zlib

import numpy as np
from scipy.spatial.transform import Rotation

KINDS = {
    "char": "b",
    "int8": "b",
    "uchar": "B",
    "uint8": "B",
    "short": "h",
    "int16": "h",
    "ushort": "H",
    "uint16": "H",
    "int": "i",
    "int32": "i",
    "uint": "I",
    "uint32": "I",
    "float": "f",
    "float32": "f",
    "double": "d",
    "float64": "d",
    "int64": "q",
    "uint64": "Q",
}
BLANK = " \t\r\n\v\f\0"


def ply(data: bytes) -> dict[str, list]:
    """Return the columns of the vertices of a PLY file."""
    end = re.search(rb"\n[ \t\v\f]*end_header[ \t\v\f\r]*\n", data)
    lines = data[: end.start()].decode("latin-1").split("\n")[1:]
    body, form, elements = data[end.end() :], None, []
    for words in (line.split() for line in lines if line.split()):
        if words[0] == "format":
            form = words[1]
        elif words[0] == "element":
            elements.append((words[1], int(words[2]), []))
        elif words[0] == "property":
            elements[-1][2].append(words[1:])
    next_value = _words(body) if form == "ascii" else _values(body, "<" if "little" in form else ">")
    tables = {}
    for name, count, properties in elements:
        rows = {words[-1]: [] for words in properties}
        for _ in range(count):
            for words in properties:
                if words[0] == "list":
                    values = [next_value(KINDS[words[2]]) for _ in range(int(next_value(KINDS[words[1]])))]
                    rows[words[-1]].append(values)
                else:
                    rows[words[-1]].append(next_value(KINDS[words[0]]))
        tables[name] = rows
    return tables["vertex"]


def pcd(data: bytes) -> dict[str, list]:
    """Return the columns of a PCD file that is not compressed."""
    end = re.search(rb"(?:^|\n)[ \t]*DATA[ \t]+(\w+)[^\n]*\n", data)
    lines = [line.split() for line in data[: end.start()].decode("latin-1").split("\n")]
    header = {"FIELDS" if words[0] == "COLUMNS" else words[0]: words[1:] for words in lines if words}
    count = (
        int(header["WIDTH"][0]) * int(header.get("HEIGHT", "1")[0])
        if "WIDTH" in header
        else int(header["POINTS"][0])
    )
    kinds = [
        {
            "F4": "f",
            "F8": "d",
            "I1": "b",
            "I2": "h",
            "I4": "i",
            "I8": "q",
            "U1": "B",
            "U2": "H",
            "U4": "I",
            "U8": "Q",
        }[t + s]
        for t, s in zip(header["TYPE"], header["SIZE"], strict=True)
    ]
    body = data[end.end() :]
    next_value = _words(body) if end[1] == b"ascii" else _values(body, "<")
    columns = {name: [] for name in header["FIELDS"]}
    for _ in range(count):
        for name, kind in zip(header["FIELDS"], kinds, strict=True):
            columns[name].append(next_value(kind))
    return columns


def _values(body: bytes, order: str):
    position = 0

    def value(kind: str):
        nonlocal position
        size = struct.calcsize(order + kind)
        (found,) = struct.unpack_from(order + kind, body, position)
        position += size
        return found

    return value


def _words(body: bytes):
    words = iter(body.split())

    def value(kind: str):
        number = float(next(words))
        return (
            struct.unpack("f", struct.pack("f", number))[0] if kind == "f" and abs(number) < 3e38 else number
        )

    return value


def png(data: bytes) -> np.ndarray:
    """Return the pixels of a PNG file of 16 bits."""
    chunks, position = [], 8
    while not chunks or chunks[-1][0] != b"IEND":
        (size,) = struct.unpack_from(">I", data, position)
        chunks.append((data[position + 4 : position + 8], data[position + 8 : position + 8 + size]))
        position += size + 12
    width, height, bits, color, _, _, interlace = struct.unpack(">IIBBBBB", chunks[0][1])
    assert (bits, color, interlace) == (16, 0, 0)
    raw = zlib.decompressobj().decompress(b"".join(data for name, data in chunks if name == b"IDAT"))
    above, rows = bytes(2 * width), []
    for y in range(height):
        kind, line = (
            raw[y * (2 * width + 1)],
            bytearray(raw[y * (2 * width + 1) + 1 : (y + 1) * (2 * width + 1)]),
        )
        for i in range(2 * width):
            a, b, c = (line[i - 2] if i > 1 else 0), above[i], (above[i - 2] if i > 1 else 0)
            nearest = min((a, b, c), key=lambda value, p=a + b - c: abs(p - value))
            line[i] = (line[i] + (0, a, b, (a + b) // 2, nearest)[kind]) & 255
        rows.append(bytes(line))
        above = rows[-1]
    return np.frombuffer(b"".join(rows), ">u2").reshape(height, width)


def pgm(data: bytes) -> np.ndarray:
    """Return the pixels of a PGM file."""
    words, position = [], 0
    while len(words) < 4:
        found = re.compile(rb"\s*(?:#[^\n]*\n\s*)*(\w+)").match(data, position)
        words.append(found[1])
        position = found.end()
    assert words[0] == b"P5"
    width, height = int(words[1]), int(words[2])
    values = struct.unpack_from(f">{width * height}H", data, position + 1)
    return np.array(values).reshape(height, width)


def trajectory(data: bytes) -> tuple[list[float], np.ndarray]:
    """Return times and poses of a TUM trajectory, a Redwood log, or a matrix."""
    lines = [line.split(b"#")[0].split() for line in data.split(b"\n")]
    rows = [[float(word) for word in words] for words in lines if words]
    if len(rows[0]) == 8:
        poses = np.tile(np.eye(4), (len(rows), 1, 1))
        for pose, row in zip(poses, rows, strict=True):
            pose[:3, :3], pose[:3, 3] = Rotation.from_quat(row[4:]).as_matrix(), row[1:4]
        return [row[0] for row in rows], poses
    if len(rows[0]) == 4:
        rows = [[0.0, 0.0, 0.0], *rows]
    blocks = [rows[i : i + 5] for i in range(0, len(rows), 5)]
    return [block[0][0] for block in blocks], np.array([block[1:] for block in blocks])


def camera(data: bytes) -> list[float]:
    """Return what a camera file says of a pinhole camera."""
    told = json.loads(data)
    if "intrinsic_matrix" in told:
        matrix = told["intrinsic_matrix"]
        return [told["width"], told["height"], matrix[0], matrix[4], matrix[6], matrix[7]]
    return [told[key] for key in ("width", "height", "fx", "fy", "cx", "cy")]
