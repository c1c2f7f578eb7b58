"""PCD files: every form that is legal is read, every other is refused with its place."""

import struct
from pathlib import Path

import numpy as np
import pytest
from broken_files import check_every_cut_refused, check_refused, check_refused_cheaply, edited, edits
from hypothesis import given, settings
from hypothesis import strategies as st

import nacre
from nacre.io import lzf

DATA = Path(__file__).parents[4] / "shared" / "data"
needs_data = pytest.mark.skipif(not DATA.is_dir(), reason="no recordings in ../shared/data")

XYZ = {"VERSION": "0.7", "FIELDS": "x y z", "SIZE": "4 4 4", "TYPE": "F F F", "COUNT": "1 1 1"}
TWO = {"WIDTH": "2", "HEIGHT": "1", "VIEWPOINT": "0 0 0 1 0 0 0", "POINTS": "2"}


def pcd(body, encoding="binary", **changes):
    """A PCD file of two points; a keyword gives a line of the header another text, None leaves it out."""
    lines = {**XYZ, **TWO, "DATA": encoding} | changes
    header = "".join(f"{keyword} {text}\n" for keyword, text in lines.items() if text is not None)
    return b"# .PCD v0.7 - Point Cloud Data file format\n" + header.encode() + body


def read(tmp_path, content):
    path = tmp_path / "a.pcd"
    path.write_bytes(content)
    return nacre.read_points(path)


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


@pytest.mark.parametrize(
    "content",
    [
        pcd(FLOATS),
        pcd(TEXT, "ascii"),
        pcd(compressed(COLUMNS), "binary_compressed"),
        pcd(FLOATS + b"\0" * 100),
        pcd(TEXT.replace(b"\n", b"\r\n") + b"\r\n", "ascii"),
        pcd(FLOATS, VERSION=".5", VIEWPOINT=None),
        pcd(FLOATS, COUNT=None, VERSION=None),
        pcd(FLOATS, POINTS=None),
        pcd(FLOATS, WIDTH=None, HEIGHT=None),
        pcd(FLOATS, HEIGHT=None),
        pcd(FLOATS).replace(b"FIELDS", b"COLUMNS"),
        pcd(FLOATS).replace(b"\n", b"\r\n", 8),
        pcd(FLOATS).replace(b"WIDTH", b"\nWIDTH"),
    ],
)
def test_forms_of_the_same_cloud(tmp_path, content):
    cloud = read(tmp_path, content)
    np.testing.assert_array_equal(cloud.points, POINTS, strict=True)
    assert (cloud.normals, cloud.colors, cloud.attributes, cloud.comments, cloud.shape) == (
        None,
        None,
        {},
        (),
        None,
    )


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


@pytest.mark.parametrize(
    "content",
    [
        pcd(b"".join(b"".join(row) for row in zip(*field_columns(), strict=True)), **FIELDS),
        pcd(compressed(b"".join(map(b"".join, field_columns()))), "binary_compressed", **FIELDS),
        pcd(
            compressed(b"".join(b"".join(c) for i, c in enumerate(field_columns()) if i not in (0, 5))),
            "binary_compressed",
            **FIELDS,
        ),
        pcd(fields_text(), "ascii", **(FIELDS | {"TYPE": "U I F F F F U F U"})),
    ],
    ids=["binary", "compressed", "compressed without padding", "ascii"],
)
def test_fields_of_every_kind(tmp_path, content):
    cloud = read(tmp_path, content)
    np.testing.assert_array_equal(cloud.points, [row[1:4] for row in ROWS], strict=True)
    np.testing.assert_array_equal(
        cloud.colors, np.array([[0x10, 0x20, 0x30], [0xFF, 0xFE, 0xFD]], np.uint8), strict=True
    )
    assert list(cloud.attributes) == ["intensity", "stamp", "histogram"]
    for name, i, dtype in (("intensity", 0, np.int16), ("stamp", 4, np.uint64), ("histogram", 5, np.float32)):
        expected = np.array([row[i] for row in ROWS], dtype=dtype)
        np.testing.assert_array_equal(cloud.attributes[name], expected, strict=True)


def test_colours_with_alpha(tmp_path):
    changes = {"FIELDS": "x y z rgba", "SIZE": "4 4 4 4", "TYPE": "F F F U", "COUNT": "1 1 1 1"}
    body = b"".join(struct.pack("<3fI", *point, 0x80102030 + i) for i, point in enumerate(POINTS))
    cloud = read(tmp_path, pcd(body, **changes))
    assert cloud.colors.tolist() == [[16, 32, 48], [16, 32, 49]]
    assert cloud.attributes["alpha"].tolist() == [128, 128]


def test_organised_cloud(tmp_path):
    cloud = read(tmp_path, pcd(bytes(72), WIDTH="2", HEIGHT="3", POINTS="6", VIEWPOINT="1 2 3 0 1 0 0"))
    assert cloud.shape == (3, 2)
    assert len(cloud) == 6
    assert cloud.comments == ("VIEWPOINT 1 2 3 0 1 0 0",)
    assert "3 rows x 2 columns" in repr(cloud)


def test_what_is_written(tmp_path):
    """The header that the Point Cloud Library expects, byte for byte."""
    nacre.write_points(
        tmp_path / "a.pcd",
        POINTS,
        normals=POINTS,
        colors=[[1, 2, 3], [255, 0, 255]],
        attributes={"curvature": np.zeros(2, np.float32), "label": np.zeros((2, 2), np.uint16)},
        comments=["made by a test"],
    )
    header, _, body = (tmp_path / "a.pcd").read_bytes().partition(b"DATA binary\n")
    assert header.decode().splitlines() == [
        "# .PCD v0.7 - Point Cloud Data file format",
        "# made by a test",
        "VERSION 0.7",
        "FIELDS x y z normal_x normal_y normal_z rgb curvature label",
        "SIZE 4 4 4 4 4 4 4 4 2",
        "TYPE F F F F F F F F U",
        "COUNT 1 1 1 1 1 1 1 1 2",
        "WIDTH 2",
        "HEIGHT 1",
        "VIEWPOINT 0 0 0 1 0 0 0",
        "POINTS 2",
    ]
    assert body[24:28] == bytes([3, 2, 1, 0])
    assert len(body) == 2 * 36


@pytest.mark.parametrize(
    "content", [pcd(b"", WIDTH="0", POINTS="0"), pcd(b"", "ascii", WIDTH="0", POINTS="0")]
)
def test_no_points(tmp_path, content):
    assert read(tmp_path, content).points.shape == (0, 3)


@settings(max_examples=200, deadline=None, derandomize=True)
@given(parts=st.lists(st.tuples(st.binary(max_size=40), st.integers(0, 300))))
def test_decompression(parts):
    data = b"".join(part * (1 + repeat // (1 + len(part))) for part, repeat in parts)
    assert lzf.decompress(compress(data), len(data)) == data


def test_decompression_of_long_and_far_repetitions():
    data = np.random.default_rng(0).integers(0, 3, 40_000, dtype=np.uint8).tobytes() + bytes(5000)
    packed = compress(data)
    assert len(packed) < 0.6 * len(data)
    assert lzf.decompress(packed, len(data)) == data


def packed(*numbers, size=24, claimed=None):
    content = bytes(numbers)
    return pcd(
        struct.pack("<II", len(content) if claimed is None else claimed, size) + content, "binary_compressed"
    )


BROKEN = {
    "empty": (b"", "empty"),
    "blank": (b"\n\n", "line 3: the file ends before DATA"),
    "comment only": (b"# .PCD v0.7 - Point Cloud Data file format", "line 2: the file ends before DATA"),
    "another file": (b"\x89PNG\r\n\x1a\n" + bytes(range(256)), "line 1: unknown keyword"),
    "a PLY file": (b"ply\nformat ascii 1.0\n", "line 1: unknown keyword .*'ply'"),
    "unknown keyword": (pcd(FLOATS).replace(b"DATA", b"COLOUR red\nDATA"), "unknown keyword .*COLOUR"),
    "keyword in small letters": (pcd(FLOATS).replace(b"FIELDS", b"fields"), "line 3: unknown keyword"),
    "a second line": (
        pcd(FLOATS).replace(b"WIDTH 2\n", b"WIDTH 2\nWIDTH 2\n"),
        "line 8: a second line WIDTH",
    ),
    "keyword alone": (pcd(FLOATS).replace(b"WIDTH 2\n", b"WIDTH\n"), "line 7: no value after WIDTH"),
    "no data line": (pcd(FLOATS, DATA=None), "unknown keyword"),
    "no fields": (pcd(FLOATS, FIELDS=None), "no line FIELDS"),
    "no sizes": (pcd(FLOATS, SIZE=None), "no line SIZE"),
    "no types": (pcd(FLOATS, TYPE=None), "no line TYPE"),
    "no number of points": (
        pcd(FLOATS, POINTS=None, WIDTH=None, HEIGHT=None),
        "POINTS must be a whole number",
    ),
    "height alone": (pcd(FLOATS, WIDTH=None), "WIDTH must be a whole number"),
    "unknown version": (pcd(FLOATS, VERSION="8"), "VERSION must be 0.5, 0.6 or 0.7, got '8'"),
    "unknown encoding": (pcd(FLOATS, "binary_zipped"), "line 11: DATA must be one of .*'binary_zipped'"),
    "sizes too few": (pcd(FLOATS, SIZE="4 4"), "SIZE has 2 values for 3 FIELDS"),
    "types too many": (pcd(FLOATS, TYPE="F F F F"), "TYPE has 4 values for 3 FIELDS"),
    "counts too few": (pcd(FLOATS, COUNT="1"), "COUNT has 1 values for 3 FIELDS"),
    "unknown type": (pcd(FLOATS, TYPE="F F Q"), "field 'z' has unknown TYPE Q of SIZE 4"),
    "float of one byte": (pcd(FLOATS, SIZE="4 4 1"), "field 'z' has unknown TYPE F of SIZE 1"),
    "size of three bytes": (
        pcd(FLOATS, SIZE="4 4 3", TYPE="F F I"),
        "field 'z' has unknown TYPE I of SIZE 3",
    ),
    "size of no bytes": (pcd(FLOATS, SIZE="4 4 0"), "unknown TYPE F of SIZE 0"),
    "size negative": (pcd(FLOATS, SIZE="4 4 -4"), "unknown TYPE F of SIZE -4"),
    "count of zero": (pcd(FLOATS, COUNT="1 1 0"), "field 'z' has COUNT 0"),
    "count of two": (pcd(FLOATS, COUNT="1 1 2"), "no field z with COUNT 1"),
    "count negative": (pcd(FLOATS, COUNT="1 1 -1"), "COUNT must be a whole number, got '-1'"),
    "count enormous": (
        pcd(
            FLOATS,
            WIDTH="0",
            POINTS="0",
            FIELDS="x y z w",
            SIZE="4 4 4 4",
            TYPE="F F F F",
            COUNT="1 1 1 999999999",
        ),
        "too large",
    ),
    "no z": (pcd(FLOATS, FIELDS="x y w"), "no field z"),
    "x twice": (
        pcd(FLOATS, FIELDS="x y z x", SIZE="4 4 4 4", TYPE="F F F F", COUNT="1 1 1 1"),
        "named twice",
    ),
    "too many fields": (pcd(FLOATS, FIELDS="x y z " + "_ " * 20_000), "more than 10000 fields"),
    "width negative": (pcd(FLOATS, WIDTH="-2"), "WIDTH must be a whole number, got '-2'"),
    "width not whole": (pcd(FLOATS, WIDTH="2.0"), "WIDTH must be a whole number"),
    "height not a number": (pcd(FLOATS, HEIGHT="one"), "HEIGHT must be a whole number"),
    "points of other digits": (pcd(FLOATS, POINTS="\u00b2"), "POINTS must be a whole number"),
    "points of 5000 digits": (pcd(FLOATS, POINTS="9" * 5000), "POINTS must be a whole number"),
    "points not width times height": (pcd(FLOATS, POINTS="3"), "POINTS 3 is not WIDTH 2 times HEIGHT 1"),
    "one point more": (
        pcd(FLOATS, WIDTH="3", POINTS="3"),
        "byte 164: .*promises 3 points.*24 bytes are left",
    ),
    "points 1e12": (pcd(FLOATS, WIDTH="1000000", HEIGHT="1000000", POINTS=None), "24 bytes are left"),
    "points 2**62": (pcd(FLOATS, WIDTH=str(2**62), POINTS=str(2**62)), "24 bytes are left"),
    "points 2**64": (pcd(FLOATS, WIDTH=str(2**32), HEIGHT=str(2**32), POINTS=None), "24 bytes are left"),
    "one point less": (pcd(FLOATS, WIDTH="1", POINTS="1"), "12 bytes follow"),
    "data cut": (pcd(FLOATS[:-1]), "23 bytes are left"),
    "no data": (pcd(b""), "0 bytes are left"),
    "more data": (pcd(FLOATS + b"\1"), "1 bytes follow"),
    "text: no number": (pcd(b"0 0 0\n0 a 0\n", "ascii"), "line 13: 'a' is not a number"),
    "text: a value short": (pcd(b"0 0\n0 0 0 0\n", "ascii"), "line 12: expected 3 values, found 2"),
    "text: a value more": (pcd(b"0 0 0\n\n0 0 0 0\n", "ascii"), "line 14: expected 3 values, found 4"),
    "text: a row short": (pcd(b"0.000 0.000 0.000\n", "ascii"), "promises 2 points, the file ends after 1"),
    "text: a row more": (pcd(TEXT + b"0 0 0\n", "ascii"), "6 bytes follow"),
    "text: points 1e12": (pcd(TEXT, "ascii", WIDTH="1000000000000", POINTS=None), "are left in the file"),
    "text: binary data": (pcd(FLOATS, "ascii"), "line 12"),
    "text: not whole": (pcd(b"0 0 0.5\n0 0 0\n", "ascii", TYPE="F F I"), "line 12: '0.5' does not fit z"),
    "text: too large": (
        pcd(b"0 0 0\n0 0 256\n", "ascii", SIZE="4 4 1", TYPE="F F U"),
        "line 13: '256' does not fit z",
    ),
    "text: beyond 64 bits": (
        pcd(b"0 0 0\n0 0 18446744073709551616\n", "ascii", SIZE="4 4 8", TYPE="F F U"),
        "does not fit uint64",
    ),
    "text: 64 bits as a power": (
        pcd(b"0 0 0\n0 0 1e15\n", "ascii", SIZE="4 4 8", TYPE="F F U"),
        "does not fit uint64",
    ),
    "packed: no sizes": (pcd(b"\0" * 7, "binary_compressed"), "ends before the compressed data"),
    "packed: nothing": (packed(), "0 bytes of compressed data cannot hold 24 bytes"),
    "packed: cut": (
        packed(2, 1, 2, 3, claimed=5),
        "5 bytes of compressed data are promised, 4 are in the file",
    ),
    "packed: more": (packed(2, 1, 2, 3, claimed=3), "1 bytes follow"),
    "packed: promises 4 GB": (packed(2, 1, 2, 3, size=2**32 - 1), "which is not 2 points"),
    "packed: other size": (
        packed(2, 1, 2, 3, size=23),
        "23 bytes of data are promised, which is not 2 points",
    ),
    "packed: too much to hold": (
        pcd(struct.pack("<II", 3, 12_000) + b"\0" * 3, "binary_compressed", WIDTH="1000", POINTS="1000"),
        "3 bytes of compressed data cannot hold 12000 bytes",
    ),
    "packed: too little": (packed(2, 1, 2, 3), "does not give the 24 bytes"),
    "packed: too much": (packed(0, 1, 0xE0, 200, 0), "does not give the 24 bytes"),
    "packed: literal cut": (packed(31, 1, 2, 3), "in the middle of an instruction"),
    "packed: repetition cut": (packed(0, 1, 0x20), "in the middle of an instruction"),
    "packed: long repetition cut": (packed(0, 1, 0xE0), "in the middle of an instruction"),
    "packed: before the beginning": (packed(0, 1, 0x20, 1), "before its beginning"),
}


@pytest.mark.parametrize("name", BROKEN)
def test_broken_files(tmp_path, name):
    check_refused(tmp_path / "a.pcd", *BROKEN[name])


@pytest.mark.parametrize("encoding", ["ascii", "binary", "binary_compressed"])
def test_promises_cost_no_memory(tmp_path, encoding):
    body = struct.pack("<II", 28, 12 * 10**8) + b"\xff" * 28
    content = pcd(body, encoding, WIDTH=str(10**8), POINTS=str(10**8))
    check_refused_cheaply(tmp_path / "a.pcd", content)


SEEDS = [
    pcd(FLOATS),
    pcd(TEXT, "ascii"),
    pcd(compressed(COLUMNS), "binary_compressed"),
    pcd(compressed(b"".join(map(b"".join, field_columns()))), "binary_compressed", **FIELDS),
    pcd(fields_text(), "ascii", **(FIELDS | {"TYPE": "U I F F F F U F U"})),
]


@pytest.mark.parametrize("seed", [0, 2, 3])
def test_every_truncation_of_a_binary_file_is_refused(tmp_path, seed):
    check_every_cut_refused(tmp_path / "a.pcd", SEEDS[seed])


@settings(max_examples=400, deadline=None, derandomize=True)
@given(
    seed=st.sampled_from(SEEDS),
    edits=edits(400),
)
def test_damaged_files_give_a_cloud_or_a_format_error(tmp_path_factory, seed, edits):
    path = tmp_path_factory.getbasetemp() / "damaged.pcd"
    path.write_bytes(edited(seed, edits))
    try:
        cloud = nacre.read_points(path)
    except nacre.FileFormatError:
        return
    assert cloud.points.ndim == 2


@needs_data
@pytest.mark.data
def test_files_of_the_point_cloud_library():
    sizes = {"bun0": 397, "bun4": 361, "bunny": 397, "milk": 13704, "noisy_slice_displaced": 3782}
    for name, size in sizes.items():
        cloud = nacre.read_points(DATA / "pcl" / f"{name}.pcd")
        assert len(cloud) == size
        assert np.isfinite(cloud.points).all()
    normals = nacre.read_points(DATA / "pcl" / "bun0.pcd").normals
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1, atol=1e-6)
    kinect = nacre.read_points(DATA / "pcl" / "pairwise" / "capture0001.pcd")
    assert kinect.shape == (480, 640)
    image = kinect.points.reshape(480, 640, 3)
    seen = np.isfinite(image[..., 2])
    assert 0.5 < seen.mean() < 1
    column = np.broadcast_to(np.arange(640), (480, 640))[
        seen
    ]  # a pinhole camera: x / z grows by 1 / f a column
    slope = np.polyfit(column, image[seen][:, 0] / image[seen][:, 2], 1)[0]
    assert slope == pytest.approx(1 / 525, rel=1e-3)
