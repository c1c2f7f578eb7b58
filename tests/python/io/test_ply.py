"""PLY files: every form that is legal is read."""

import struct

import numpy as np
import pytest
from ply_files import FLOATS, JUNK, MIXED, POINTS, TEXT, XYZ, ascii_ply, mixed_binary, mixed_text, ply, read

import nacre
from nacre.io.ply import read_ply


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


@pytest.mark.parametrize("form", ["ascii", "binary_little_endian"])
def test_stray_lines_of_a_header(tmp_path, form):
    """As some scans of Stanford's have: notes without 'comment', blank lines, words of another program."""
    body = TEXT if form == "ascii" else FLOATS
    elements = f"zipper generated by hand\n\nobj_info num_cols 512\nelement vertex 2\ntexture a.jpg\n{XYZ}\n"
    with pytest.warns(UserWarning, match="none of PLY's: 3, 4, 7, 11$") as told:
        cloud = read(tmp_path, ply(body, elements, form))
    np.testing.assert_array_equal(cloud.points, POINTS)
    assert cloud.comments == ("zipper generated by hand", "texture a.jpg", "num_cols 512")
    assert len(told) == 1


def test_an_orderly_header_gives_no_warning(tmp_path):
    read(tmp_path, ply(FLOATS, f"comment a\nobj_info b\nelement vertex 2\n{XYZ}"))
