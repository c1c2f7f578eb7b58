"""PCD files: every form that is legal is read; test_hostile_files has the others."""

import struct
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pcd_files import (
    COLUMNS,
    FIELDS,
    FLOATS,
    POINTS,
    ROWS,
    TEXT,
    compress,
    compressed,
    field_columns,
    fields_text,
    pcd,
)

import nacre
from nacre.io import lzf

DATA = Path(__file__).parents[4] / "shared" / "data"
needs_data = pytest.mark.skipif(not DATA.is_dir(), reason="no recordings in ../shared/data")


def read(tmp_path, content):
    path = tmp_path / "a.pcd"
    path.write_bytes(content)
    return nacre.read_points(path)


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
