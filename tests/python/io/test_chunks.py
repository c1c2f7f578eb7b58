"""Point files in pieces, as files larger than memory are read and written."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hills import hills

import nacre
from nacre.io.las import default_of
from nacre.io.points import is_streamed, read_chunks, write_chunks

STREAMED = [".ply", ".pcd", ".las", ".laz"]


def same(a: nacre.Cloud, b: nacre.Cloud) -> None:
    np.testing.assert_array_equal(a.points, b.points, strict=True)
    np.testing.assert_array_equal(a.colors, b.colors, strict=True)
    for name, values in a.attributes.items():
        np.testing.assert_array_equal(values, b.attributes[name], strict=True)


def joined(chunks: list[nacre.Cloud]) -> nacre.Cloud:
    names = chunks[0].attributes
    attributes = {name: np.concatenate([c.attributes[name] for c in chunks]) for name in names}
    colors = np.concatenate([c.colors for c in chunks if c.colors is not None])
    return nacre.Cloud(np.concatenate([c.points for c in chunks]), None, colors, attributes)


@pytest.mark.parametrize("suffix", [*STREAMED, ".xyz", ".npz"])
def test_pieces_are_the_whole(suffix: str, tmp_path: Path) -> None:
    if suffix in (".las", ".laz"):
        pytest.importorskip("laspy")
    path = tmp_path / f"a{suffix}"
    nacre.write_points(path, hills(1000))
    chunks = list(read_chunks(path, 300))
    assert [len(chunk) for chunk in chunks] == [300, 300, 300, 100]
    same(nacre.read_points(path), joined(chunks))
    silent = set(chunks[0].attributes) - set(nacre.read_points(path).attributes)
    assert all((c.attributes[name] == default_of(name)).all() for c in chunks for name in silent)
    assert is_streamed(path) == (suffix in STREAMED)


@pytest.mark.parametrize("suffix", STREAMED)
def test_pieces_are_written_as_the_whole(suffix: str, tmp_path: Path) -> None:
    if suffix in (".las", ".laz"):
        pytest.importorskip("laspy")
    cloud = hills(1000)
    nacre.write_points(tmp_path / f"a{suffix}", cloud)
    pieces = [cloud[:0], cloud[:300], cloud[300:]]
    write_chunks(tmp_path / f"b{suffix}", pieces, 1000, cloud.points)
    same(nacre.read_points(tmp_path / f"a{suffix}"), nacre.read_points(tmp_path / f"b{suffix}"))
    if suffix != ".laz":  # whose pieces are compressed on their own
        assert (tmp_path / f"a{suffix}").read_bytes() == (tmp_path / f"b{suffix}").read_bytes()


def test_big_endian_vertices_after_another_element(tmp_path: Path) -> None:
    header = b"ply\nformat binary_big_endian 1.0\nelement camera 2\nproperty float f\nelement vertex 3\n"
    header += b"property double x\nproperty double y\nproperty double z\nproperty uchar class\nend_header\n"
    rows = np.array([(1, 2, 3, 4), (5, 6, 7, 8), (9, 10, 11, 12)], ">f8,>f8,>f8,u1")
    (tmp_path / "a.ply").write_bytes(header + np.ones(2, ">f4").tobytes() + rows.tobytes())
    first, second = read_chunks(tmp_path / "a.ply", 2)
    np.testing.assert_array_equal(first.points, [[1, 2, 3], [5, 6, 7]])
    assert second.attributes["class"] == [12]


@pytest.mark.parametrize("suffix", [".ply", ".pcd"])
def test_bytes_after_the_last_point(suffix: str, tmp_path: Path) -> None:
    path = tmp_path / f"a{suffix}"
    nacre.write_points(path, hills(10))
    whole = path.read_bytes()
    path.write_bytes(whole + b"\0\n")
    assert len(list(read_chunks(path, 4))) == 3
    path.write_bytes(whole + b"more")
    with pytest.raises(nacre.FileFormatError, match="bytes follow the data that the header promises"):
        list(read_chunks(path, 4))


def test_files_that_have_to_be_read_whole(tmp_path: Path) -> None:
    cloud = hills(10)
    for name in ("a.ply", "a.pcd"):
        nacre.write_points(tmp_path / name, cloud, binary=False)
        assert not is_streamed(tmp_path / name)
        same(nacre.read_points(tmp_path / name), joined(list(read_chunks(tmp_path / name, 4))))
