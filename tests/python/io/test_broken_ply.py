"""PLY files that break the format are refused, with the place."""

import pytest
from broken_files import check_every_cut_refused, check_refused, check_refused_cheaply, edited, edits
from hypothesis import given, settings
from hypothesis import strategies as st
from ply_files import FLOATS, MIXED, TEXT, XYZ, ascii_ply, mixed_binary, mixed_text, ply

import nacre
from nacre.io.ply import read_range_grid

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
    check_refused(tmp_path / "a.ply", *BROKEN[name])


@pytest.mark.parametrize("count", [10**6, 10**12, 2**62])
@pytest.mark.parametrize("file_format", ["ascii", "binary_little_endian"])
@pytest.mark.parametrize("what", ["vertex", "list"])
def test_promises_cost_no_memory(tmp_path, count, file_format, what):
    faces = f"element vertex 0\n{XYZ}\nelement face {count}\nproperty list uint double i"
    content = ply(b"\xff" * 36, f"element vertex {count}\n{XYZ}" if what == "vertex" else faces, file_format)
    check_refused_cheaply(tmp_path / "a.ply", content)


SEEDS = [
    ply(FLOATS),
    ascii_ply(TEXT),
    ply(mixed_binary("<"), MIXED),
    ply(mixed_binary(">"), MIXED, "binary_big_endian"),
    ascii_ply(mixed_text(), MIXED),
]


@pytest.mark.parametrize("seed", [0, 2, 3])
def test_every_truncation_of_a_binary_file_is_refused(tmp_path, seed):
    check_every_cut_refused(tmp_path / "a.ply", SEEDS[seed])


@settings(max_examples=400, deadline=None, derandomize=True)
@given(
    seed=st.sampled_from(SEEDS),
    edits=edits(400),
)
def test_damaged_files_give_a_cloud_or_a_format_error(tmp_path_factory, seed, edits):
    path = tmp_path_factory.getbasetemp() / "damaged.ply"
    path.write_bytes(edited(seed, edits))
    for reader in (nacre.read_points, read_range_grid):
        try:
            cloud = reader(path)
        except nacre.FileFormatError:
            continue
        assert cloud.shape is None or cloud.ndim == 3


@pytest.mark.data
def test_malformed_set(recordings):
    paths = sorted((recordings / "malformed-ply").glob("*.ply"))
    good = [path.name for path in paths if not _refused(path)]
    assert good == ["nan.ply", "ok.ply"]
    assert len(paths) == 16


def _refused(path):
    try:
        nacre.read_points(path)
    except nacre.FileFormatError:
        return True
    return False
