"""Points into files of another format, a piece at a time."""

import tracemalloc

import numpy as np
import pytest

import nacre
from nacre.io import point_conversion
from nacre.io.point_conversion import convert_points

RNG = np.random.default_rng(7)
POINTS = RNG.normal(size=(1000, 3)).round(4)
FIELDS = {
    "normals": POINTS / np.linalg.norm(POINTS, axis=1, keepdims=True),
    "colors": RNG.integers(0, 256, (1000, 3)).astype(np.uint8),
}
SUFFIXES = [".ply", ".pcd", ".las", ".laz", ".copc.laz"]


@pytest.fixture
def in_small_pieces(monkeypatch):
    monkeypatch.setattr(point_conversion, "_ROWS_AT_ONCE", 100)


@pytest.mark.parametrize("to", [*SUFFIXES, ".xyz", ".npz"])
@pytest.mark.parametrize("given", SUFFIXES[:-1])
@pytest.mark.usefixtures("in_small_pieces")
def test_pieces_make_the_file_that_the_whole_makes(tmp_path, given, to):
    source, made, expected = tmp_path / f"a{given}", tmp_path / f"b{to}", tmp_path / f"c{to}"
    attributes = {"intensity": RNG.integers(0, 1000, 1000).astype(np.uint16)}
    nacre.write_points(source, POINTS, **FIELDS, attributes=attributes, comments=["mine"])
    done = convert_points(source, made)
    whole = nacre.read_points(source)
    nacre.write_points(expected, whole, comments=whole.comments)
    assert made.read_bytes() == expected.read_bytes()
    assert done.num_points == 1000
    assert done.fields == ["normals", "colors", "intensity"]


@pytest.mark.parametrize("to", SUFFIXES)
@pytest.mark.usefixtures("in_small_pieces")
def test_points_that_are_not_finite_are_left_out_where_there_is_no_place_for_them(tmp_path, to):
    points = POINTS.copy()
    points[[5, 150, 151]] = np.nan, np.inf, -np.inf
    nacre.write_points(tmp_path / "a.ply", points)
    done = convert_points(tmp_path / "a.ply", tmp_path / f"b{to}")
    left_out = 3 if to.endswith(("las", "laz")) else 0
    assert (done.num_points, done.not_finite_left_out) == (1000 - left_out, left_out)
    assert len(nacre.read_points(tmp_path / f"b{to}")) == 1000 - left_out


@pytest.mark.parametrize(
    ("to", "attributes"),
    [
        (".las", {"intensity": np.where(np.arange(1000) < 500, 0.5, 7.0)}),  # real ones up to 1 are spread
        (".ply", {"number": np.where(np.arange(1000) < 500, 1, 3_000_000_000)}),  # signed, or unsigned
    ],
)
@pytest.mark.usefixtures("in_small_pieces")
def test_what_all_values_decide_is_not_decided_by_a_piece(tmp_path, to, attributes):
    nacre.write_points(tmp_path / "a.pcd", POINTS, attributes=attributes)
    if to == ".las":
        with pytest.raises(ValueError, match="whole numbers from 0 to 65535"):
            convert_points(tmp_path / "a.pcd", tmp_path / "b.las")
        assert not (tmp_path / "b.las").exists()
        return
    convert_points(tmp_path / "a.pcd", tmp_path / "b.ply")
    read = nacre.read_points(tmp_path / "b.ply").attributes["number"]
    np.testing.assert_array_equal(read, attributes["number"])


@pytest.mark.parametrize("given", [".ply", ".pcd", ".las"])
@pytest.mark.parametrize("to", SUFFIXES)
def test_no_points(tmp_path, given, to):
    nacre.write_points(tmp_path / f"a{given}", np.zeros((0, 3)))
    assert convert_points(tmp_path / f"a{given}", tmp_path / f"b{to}").num_points == 0
    assert len(nacre.read_points(tmp_path / f"b{to}")) == 0


@pytest.mark.parametrize("to", [".ply", ".pcd", ".las"])
def test_memory_does_not_grow_with_the_file(tmp_path, monkeypatch, to):
    monkeypatch.setattr(point_conversion, "_ROWS_AT_ONCE", 1 << 14)
    peaks = []
    for count in (250_000, 500_000):
        points = np.random.default_rng(1).random((count, 3), np.float32)
        points[:, 2] = 0.1 * np.sin(9 * points[:, 0])
        nacre.write_points(tmp_path / "a.ply", points)
        del points
        tracemalloc.start()
        convert_points(tmp_path / "a.ply", tmp_path / f"b{to}")
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[1] < 1.4 * peaks[0]


def test_a_las_file_claims_no_extremes_of_extra_dimensions(tmp_path):
    laspy = pytest.importorskip("laspy")
    nacre.write_points(tmp_path / "a.las", POINTS, **FIELDS)
    with laspy.open(tmp_path / "a.las") as reader:
        (record,) = reader.header.vlrs.get("ExtraBytesVlr")
    assert not any(d.min_is_relevant() or d.max_is_relevant() for d in record.extra_bytes_structs)
