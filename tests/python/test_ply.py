"""PLY files: every form that is legal is read, every other is refused with its place."""

import struct
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import nacre
from nacre.io.ply import read_ply, read_range_grid

DATA = Path(__file__).parents[3] / "shared" / "data"
needs_data = pytest.mark.skipif(not DATA.is_dir(), reason="no recordings in ../shared/data")

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


@pytest.mark.parametrize(
    "content",
    [
        ply(mixed_binary("<"), MIXED),
        ply(mixed_binary(">"), MIXED, "binary_big_endian"),
        ascii_ply(mixed_text(), MIXED),
    ],
)
def test_elements_with_lists_of_every_length(tmp_path, content):
    cloud = read(tmp_path, content)
    np.testing.assert_array_equal(cloud.points, POINTS)
    junk = read_ply(tmp_path / "a.ply").tables["junk"]
    for i, name in enumerate("abcd"):
        expected = [row[i] for row in JUNK]
        if name in "bd":
            assert junk[name].counts.tolist() == [len(values) for values in expected]
            assert junk[name].values.tolist() == [value for values in expected for value in values]
        else:
            assert junk[name].tolist() == expected


NAMES_AND_CODES = [
    ("char int8", "b"),
    ("uchar uint8", "B"),
    ("short int16", "h"),
    ("ushort uint16", "H"),
    ("int int32", "i"),
    ("uint uint32", "I"),
    ("float float32", "f"),
    ("double float64", "d"),
    ("int64", "q"),
    ("uint64", "Q"),
]


@pytest.mark.parametrize(
    ("type_name", "code"), [(name, c) for names, c in NAMES_AND_CODES for name in names.split()]
)
def test_property_types(tmp_path, type_name, code):
    elements = f"element vertex 2\n{XYZ}\nproperty {type_name} extra"
    limits = (0, 1) if code in "fd" else (np.iinfo(code).min, np.iinfo(code).max)
    for order, file_format in (("<", "binary_little_endian"), (">", "binary_big_endian")):
        body = b"".join(
            struct.pack(f"{order}3f{code}", *point, limit)
            for point, limit in zip(POINTS, limits, strict=True)
        )
        cloud = read(tmp_path, ply(body, elements, file_format))
        assert cloud.attributes["extra"].dtype == np.dtype(code)
        assert cloud.attributes["extra"].tolist() == list(limits)
    text = "".join(f"1 2 3 {limit}\n" for limit in limits)
    assert read(tmp_path, ascii_ply(text, elements)).attributes["extra"].tolist() == list(limits)
    if code not in "fd":
        for beyond in (limits[0] - 1, limits[1] + 1, "1.5", "nan", "inf"):
            with pytest.raises(nacre.FileFormatError, match=r"line 9: .*extra"):
                read(tmp_path, ascii_ply(f"1 2 3 {beyond}\n1 2 3 0\n", elements))


def test_properties_in_any_order_and_of_different_types(tmp_path):
    elements = (
        "element vertex 1\nproperty uchar blue\nproperty float nz\nproperty double z\nproperty float x\n"
        "property uchar red\nproperty float y\nproperty float nx\nproperty uchar green\nproperty float ny"
    )
    cloud = read(tmp_path, ply(struct.pack("<BfdfBffBf", 3, 6, 0.1, 1, 10, 2, 4, 20, 5), elements))
    np.testing.assert_array_equal(cloud.points, [[1, 2, 0.1]])
    assert cloud.points.dtype == np.float64
    np.testing.assert_array_equal(cloud.normals, [[4, 5, 6]])
    assert cloud.normals.dtype == np.float32
    np.testing.assert_array_equal(cloud.colors, [[10, 20, 3]])
    assert cloud.attributes == {}


@pytest.mark.parametrize(("type_name", "dtype"), [("short", np.float32), ("int", np.float64)])
def test_integer_coordinates(tmp_path, type_name, dtype):
    cloud = read(
        tmp_path, ascii_ply("1 2 3\n-4 5 6\n", f"element vertex 2\n{XYZ}".replace("float", type_name))
    )
    assert cloud.points.dtype == dtype
    np.testing.assert_array_equal(cloud.points, [[1, 2, 3], [-4, 5, 6]])


def test_what_is_no_normal_and_no_colour_is_an_attribute(tmp_path):
    elements = f"element vertex 1\n{XYZ}\nproperty float nx"
    elements += "\nproperty float red\nproperty float green\nproperty float blue"
    cloud = read(tmp_path, ascii_ply("0 0 0 1 0.5 0.25 0.125\n", elements))
    assert cloud.normals is None
    assert cloud.colors is None
    assert {name: column.tolist() for name, column in cloud.attributes.items()} == {
        "nx": [1],
        "red": [0.5],
        "green": [0.25],
        "blue": [0.125],
    }


def test_normals_as_the_point_cloud_library_names_them(tmp_path):
    elements = (
        f"element vertex 1\n{XYZ}\nproperty float normal_x\nproperty float normal_y\nproperty float normal_z"
    )
    np.testing.assert_array_equal(read(tmp_path, ascii_ply("0 0 0 1 2 3\n", elements)).normals, [[1, 2, 3]])


def test_lists_of_vertices(tmp_path):
    elements = f"element vertex 2\n{XYZ}\nproperty list uchar short near"
    same = read(tmp_path, ascii_ply("0 0 0 2 5 6\n0 0 0 2 7 8\n", elements)).attributes["near"]
    np.testing.assert_array_equal(same, np.array([[5, 6], [7, 8]], dtype=np.int16), strict=True)
    different = read(tmp_path, ascii_ply("0 0 0 1 5\n0 0 0 2 7 8\n", elements)).attributes["near"]
    assert [row.tolist() for row in different] == [[5], [7, 8]]


@pytest.mark.parametrize("newline", ["\n", "\r\n", "\r"])
@pytest.mark.parametrize("first", [0x0A, 0x0D])
def test_line_ends(tmp_path, newline, first):
    elements = f"comment one  two\nobj_info three\ncomment\nelement vertex 2\n{XYZ}\nelement empty 0"
    body = bytes([first]) + FLOATS[1:]  # data that begins like a line end
    cloud = read(tmp_path, ply(body, elements, newline=newline))
    assert cloud.points.tobytes() == body
    cloud = read(tmp_path, ascii_ply(TEXT.replace("\n", newline), elements, newline=newline))
    np.testing.assert_array_equal(cloud.points, POINTS)
    assert cloud.comments == ("one  two", "", "three")


@pytest.mark.parametrize(
    "text", ["\n \n0.5 1.5 -2.25\n\t\n\n 3\t4  5e-3 \n\n", TEXT.rstrip(), "+.5 15e-1 -225E-2 \r\n3. 4 .005"]
)
def test_blanks_in_text(tmp_path, text):
    np.testing.assert_array_equal(read(tmp_path, ascii_ply(text)).points, POINTS)


@pytest.mark.parametrize("word", ["nan", "-nan", "NaN", "inf", "-Infinity", "1e999"])
def test_numbers_that_are_not_finite(tmp_path, word):
    np.testing.assert_array_equal(
        read(tmp_path, ascii_ply(f"{word} 0 0\n0 0 0\n")).points[0, 0], np.float32(word)
    )


@pytest.mark.parametrize("file_format", ["ascii", "binary_little_endian"])
def test_no_vertices(tmp_path, file_format):
    elements = f"element vertex 0\n{XYZ}\nproperty list int int a\nelement nothing 0"
    cloud = read(tmp_path, ply(b"", elements, file_format))
    assert cloud.points.shape == (0, 3)
    assert cloud.attributes["a"].shape == (0, 0)


def test_comments_of_another_encoding(tmp_path):
    cloud = read(tmp_path, ply(FLOATS, f"comment caf\xe9\nelement vertex 2\n{XYZ}"))
    assert cloud.comments == ("caf\xe9",)


def test_long_and_blank_lines(tmp_path):
    text = "\n" * 3_000_000 + "0.5" + " " * 3_000_000 + "1.5 -2.25\n3 4 5e-3\n"
    np.testing.assert_array_equal(read(tmp_path, ascii_ply(text)).points, POINTS)


def test_padding_at_the_end(tmp_path):
    np.testing.assert_array_equal(read(tmp_path, ply(FLOATS + b"\n\0\0 ")).points, POINTS)


BROKEN = {
    "empty": (b"", "empty"),
    "blank": (b"\n\n", "line 1: .*begins with 'ply'"),
    "magic only": (b"ply\n", "line 2: .*ends before end_header"),
    "magic without line end": (b"ply", "line 2: .*ends before end_header"),
    "magic twice": (b"ply\n" + ply(FLOATS), "line 2: unknown keyword"),
    "other magic": (b"plyx" + ply(FLOATS)[3:], "line 1"),
    "another file": (b"\x89PNG\r\n\x1a\n" + bytes(range(256)), "line 1"),
    "no format": (ply(FLOATS).replace(b"format binary_little_endian 1.0\n", b""), "no line 'format'"),
    "format twice": (
        ply(FLOATS, f"format ascii 1.0\nelement vertex 2\n{XYZ}"),
        "line 3: a second line 'format'",
    ),
    "unknown format": (ply(FLOATS, file_format="binary_middle_endian"), "line 2: .*binary_middle_endian"),
    "unknown version": (ply(FLOATS).replace(b"1.0", b"2.0"), "line 2: .*1.0"),
    "format without version": (ply(FLOATS).replace(b" 1.0", b""), "line 2"),
    "format with nothing": (b"ply\nformat\r\r\r", "line 2"),
    "no end": (ply(FLOATS).replace(b"end_header\n", b""), "line 7"),
    "end with more": (ply(FLOATS).replace(b"end_header", b"end_header here"), "line 7: unknown keyword"),
    "unknown keyword": (ply(FLOATS, f"elephant vertex 2\n{XYZ}"), "line 3: unknown keyword .*elephant"),
    "blank line in the header": (ply(FLOATS, f"element vertex 2\n\n{XYZ}"), "line 4"),
    "element without name": (ply(FLOATS, f"element 2\n{XYZ}"), "line 3"),
    "element without count": (ply(FLOATS, f"element vertex\n{XYZ}"), "line 3"),
    "element with more": (ply(FLOATS, f"element vertex 2 3\n{XYZ}"), "line 3"),
    "element twice": (
        ply(FLOATS, f"element vertex 2\n{XYZ}\nelement vertex 2\n{XYZ}"),
        "line 7: a second element",
    ),
    "count negative": (ply(FLOATS, f"element vertex -2\n{XYZ}"), "line 3"),
    "count not whole": (ply(FLOATS, f"element vertex 2.0\n{XYZ}"), "line 3"),
    "count not a number": (ply(FLOATS, f"element vertex two\n{XYZ}"), "line 3"),
    "count of other digits": (ply(FLOATS, f"element vertex \xb2\n{XYZ}"), "line 3"),
    "count of 5000 digits": (ply(FLOATS, f"element vertex {'9' * 5000}\n{XYZ}"), "line 3"),
    "count a little large": (ply(FLOATS, f"element vertex 3\n{XYZ}"), "line 3: .*3 rows .*24 bytes are left"),
    "count 1e12": (ply(FLOATS, f"element vertex 1000000000000\n{XYZ}"), "24 bytes are left"),
    "count 2**62": (ply(FLOATS, f"element vertex {2**62}\n{XYZ}"), "24 bytes are left"),
    "count 2**32": (ply(FLOATS, f"element vertex {2**32}\n{XYZ}"), "24 bytes are left"),
    "count too small": (ply(FLOATS, f"element vertex 1\n{XYZ}"), "byte 127: 12 bytes follow"),
    "count 0": (ply(FLOATS, f"element vertex 0\n{XYZ}"), "byte 115: 24 bytes follow"),
    "no vertices": (ply(b"", f"element point 0\n{XYZ}"), "no element vertex"),
    "no elements": (ply(b"", "comment nothing"), "no element vertex"),
    "no properties": (ply(FLOATS, "element vertex 2"), "rows but no properties"),
    "no z": (
        ply(FLOATS[:16], "element vertex 2\nproperty float x\nproperty float y"),
        "line 3: .*no single value z",
    ),
    "z is a list": (
        ply(bytes(18), f"element vertex 2\n{XYZ}".replace("float z", "list uchar float z")),
        "value z",
    ),
    "x twice": (ply(FLOATS, f"element vertex 2\n{XYZ}\nproperty float x"), "line 7: a second property 'x'"),
    "property first": (ply(FLOATS, f"property float w\nelement vertex 2\n{XYZ}"), "line 3: .*before"),
    "property of no type": (ply(FLOATS, f"element vertex 2\n{XYZ}\nproperty w"), "line 7"),
    "property of unknown type": (
        ply(FLOATS, f"element vertex 2\n{XYZ}\nproperty quux w"),
        "line 7: .*'quux'",
    ),
    "list of unknown type": (ply(FLOATS, f"element vertex 2\n{XYZ}\nproperty list uchar quux w"), "line 7"),
    "list of float length": (
        ply(FLOATS, f"element vertex 2\n{XYZ}\nproperty list float int w"),
        "line 7: the length",
    ),
    "list without length": (ply(FLOATS, f"element vertex 2\n{XYZ}\nproperty list int w"), "line 7"),
    "too many elements": (
        ply(b"", "\n".join(f"element e{i} 0" for i in range(20_000))),
        "more than 1000 elements",
    ),
    "data cut": (ply(FLOATS[:-1]), "23 bytes are left"),
    "no data": (ply(b""), "0 bytes are left"),
    "more data": (ply(FLOATS + b"\x01"), "byte 139: 1 bytes follow"),
    "list cut": (ply(mixed_binary("<")[:-1], MIXED), "element face does not end within the file"),
    "equal lists cut": (
        ply(FLOATS + bytes([3] + 12 * [0] + [3] + 11 * [0]), MIXED[MIXED.index("element vertex") :]),
        "element face does not end within the file",
    ),
    "list length negative": (
        ply(
            FLOATS + b"\xff" + bytes(20), f"element vertex 2\n{XYZ}\nelement face 1\nproperty list char int i"
        ),
        "negative length",
    ),
    "later list length negative": (
        ply(
            FLOATS + b"\x00\xff" + bytes(20),
            f"element vertex 2\n{XYZ}\nelement face 2\nproperty list char int i",
        ),
        "negative length",
    ),
    "list length huge": (
        ply(FLOATS + b"\xff" * 8, f"element vertex 2\n{XYZ}\nelement face 1\nproperty list uint int i"),
        "does not end within the file",
    ),
    "list length 2**64 - 1": (
        ply(FLOATS + b"\xff" * 16, f"element vertex 2\n{XYZ}\nelement face 1\nproperty list uint64 int i"),
        "does not end within the file",
    ),
    "faces missing": (
        ply(FLOATS, MIXED[MIXED.index("element vertex") :]),
        "line 7: .*2 rows of element face",
    ),
    "text: no number": (ascii_ply("0 0 0\n0 a 0\n"), "line 9: 'a' is not a number"),
    "text: a number with a tail": (ascii_ply("0 0 0\n0 1.5f 0\n"), "line 9: '1.5f' is not a number"),
    "text: a number with underscores": (ascii_ply("0 0 0\n\n0 1_0 0\n"), "line 10: '1_0' is not a number"),
    "text: a hexadecimal number": (ascii_ply("0 0x1 0\n0 0 0\n"), "line 8: '0x1' is not a number"),
    "text: commas": (ascii_ply("0,0,0\n0,0,0\n"), "line 8: expected 3 values, found 1"),
    "text: a row short": (ascii_ply("0 0 0\n"), "6 bytes are left"),
    "text: a long row short": (ascii_ply("0.00000 0.00000 0.00000\n"), "promises 2 rows .* ends after 1"),
    "text: a value short": (ascii_ply("0 0\n0 0 0 0\n"), "line 8: expected 3 values, found 2"),
    "text: a value more": (ascii_ply("0 0 0\n0 0 0 0\n"), "line 9: expected 3 values, found 4"),
    "text: a row more": (ascii_ply("0 0 0\n0 0 0\n0 0 0\n"), "byte 112: 6 bytes follow"),
    "text: binary data": (ascii_ply(b"\x01\x02\x03\n" * 10), "line 8"),
    "text: count 1e12": (ascii_ply(TEXT, f"element vertex 1000000000000\n{XYZ}"), "are left in the file"),
    "text: list cut": (ascii_ply(mixed_text().replace("4 1 0 1 0", "4 1 0 1"), MIXED), "line 21: .*4 values"),
    "text: list longer": (
        ascii_ply(mixed_text().replace("4 1 0 1 0", "3 1 0 1 0"), MIXED),
        "line 21: .*more values",
    ),
    "text: list length negative": (
        ascii_ply(TEXT + "-1 0\n", f"element vertex 2\n{XYZ}\nelement face 1\nproperty list char int i"),
        "line 12: .*-1 values",
    ),
    "text: list length not whole": (
        ascii_ply(TEXT + "1.5 0\n", f"element vertex 2\n{XYZ}\nelement face 1\nproperty list char int i"),
        "line 12: '1.5' does not fit the length of i",
    ),
    "text: no list": (
        ascii_ply(
            TEXT + "100\n",
            f"element vertex 2\n{XYZ}\nelement face 1\nproperty uchar k\nproperty list char int i",
        ),
        "line 13: the line ends before i",
    ),
}


@pytest.mark.parametrize("name", BROKEN)
def test_broken_files(tmp_path, name):
    content, message = BROKEN[name]
    with pytest.raises(nacre.FileFormatError, match=message) as caught:
        read(tmp_path, content)
    assert str(tmp_path / "a.ply") in str(caught.value)
    assert caught.value.line is not None or caught.value.offset is not None or not content


@pytest.mark.parametrize("count", [10**6, 10**12, 2**62])
@pytest.mark.parametrize("file_format", ["ascii", "binary_little_endian"])
@pytest.mark.parametrize("what", ["vertex", "list"])
def test_promises_cost_no_memory(tmp_path, count, file_format, what):
    faces = f"element vertex 0\n{XYZ}\nelement face {count}\nproperty list uint double i"
    content = ply(b"\xff" * 36, f"element vertex {count}\n{XYZ}" if what == "vertex" else faces, file_format)
    (tmp_path / "a.ply").write_bytes(content)
    tracemalloc.start()
    try:
        with pytest.raises(nacre.FileFormatError):
            nacre.read_points(tmp_path / "a.ply")
        assert tracemalloc.get_traced_memory()[1] < 1 << 20
    finally:
        tracemalloc.stop()


SEEDS = [
    ply(FLOATS),
    ascii_ply(TEXT),
    ply(mixed_binary("<"), MIXED),
    ply(mixed_binary(">"), MIXED, "binary_big_endian"),
    ascii_ply(mixed_text(), MIXED),
]


@pytest.mark.parametrize("seed", [0, 2, 3])
def test_every_truncation_of_a_binary_file_is_refused(tmp_path, seed):
    for size in range(len(SEEDS[seed])):
        with pytest.raises(nacre.FileFormatError):
            read(tmp_path, SEEDS[seed][:size])


@settings(max_examples=400, deadline=None, derandomize=True)
@given(
    seed=st.sampled_from(SEEDS),
    edits=st.lists(
        st.tuples(st.integers(0, 400), st.integers(0, 3), st.binary(max_size=4)), min_size=1, max_size=4
    ),
)
def test_damaged_files_give_a_cloud_or_a_format_error(tmp_path_factory, seed, edits):
    content = seed
    for position, removed, inserted in edits:
        position %= len(content) + 1
        content = content[:position] + inserted + content[position + removed :]
    path = tmp_path_factory.getbasetemp() / "damaged.ply"
    path.write_bytes(content)
    for reader in (nacre.read_points, read_range_grid):
        try:
            cloud = reader(path)
        except nacre.FileFormatError:
            continue
        assert cloud.shape is None or cloud.ndim == 3


GRID = (
    "obj_info num_cols 3\nobj_info num_rows 2\nobj_info echo_lgincr 0.5\n"
    f"element vertex 2\n{XYZ}\nelement range_grid 6\nproperty list uchar int vertex_indices"
)
CELLS = "0\n1 1\n0\n1 0\n0\n0\n"


def test_range_grid(tmp_path):
    expected = np.full((2, 3, 3), np.nan, dtype=np.float32)
    expected[0, 1], expected[1, 0] = POINTS[1], POINTS[0]
    cells = b"\x00\x01\x01\x00\x00\x00\x00\x01\x00\x00\x00\x00\x00\x00"
    for content in (ascii_ply(TEXT + CELLS, GRID), ply(FLOATS + cells, GRID)):
        (tmp_path / "scan.ply").write_bytes(content)
        np.testing.assert_array_equal(read_range_grid(tmp_path / "scan.ply"), expected, strict=True)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (ascii_ply(TEXT), "not a range scan: no element range_grid"),
        (ascii_ply(TEXT + CELLS, GRID.replace("obj_info num_cols 3\n", "")), "no line 'obj_info num_cols'"),
        (
            ascii_ply(TEXT + CELLS, GRID.replace("num_cols 3", "num_cols three")),
            "no line 'obj_info num_cols'",
        ),
        (ascii_ply(TEXT + CELLS, GRID.replace("num_rows 2", "num_rows \xb2")), "no line 'obj_info num_rows'"),
        (
            ascii_ply(TEXT + CELLS, GRID.replace("num_cols 3", "num_cols 4")),
            "num_rows 2 times num_cols 4 is not 6",
        ),
        (ascii_ply(TEXT + CELLS.replace("1 1", "1 2"), GRID), "a vertex outside 0 to 1"),
        (ascii_ply(TEXT + CELLS.replace("1 1", "1 -1"), GRID), "a vertex outside 0 to 1"),
        (ascii_ply(TEXT + CELLS.replace("1 1", "2 0 1"), GRID), "more than one vertex"),
        (
            ascii_ply(TEXT + CELLS, GRID.replace("int vertex_indices", "float vertex_indices")),
            "not a range scan",
        ),
    ],
)
def test_broken_range_grid(tmp_path, content, message):
    (tmp_path / "scan.ply").write_bytes(content)
    with pytest.raises(nacre.FileFormatError, match=message):
        read_range_grid(tmp_path / "scan.ply")


@needs_data
@pytest.mark.data
def test_malformed_set():
    paths = sorted((DATA / "malformed-ply").glob("*.ply"))
    good = [path.name for path in paths if not _refused(path)]
    assert good == ["nan.ply", "ok.ply"]
    assert len(paths) == 16


def _refused(path):
    try:
        nacre.read_points(path)
    except nacre.FileFormatError:
        return True
    return False


@needs_data
@pytest.mark.data
def test_real_range_scan():
    path = DATA / "stanford-bunny" / "data" / "bun000.ply"
    image = read_range_grid(path)
    assert image.shape == (400, 512, 3)
    seen = np.isfinite(image).all(axis=2)
    assert seen.sum() == len(nacre.read_points(path)) == 40256
    columns = np.nonzero(seen)[1]  # orthographic in x, half a millimetre a column
    slope = np.polyfit(columns, image[seen][:, 0].astype(float), 1)[0]
    assert slope == pytest.approx(0.0005, rel=1e-3)
