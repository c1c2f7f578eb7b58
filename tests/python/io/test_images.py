"""Depth and colour images: what is stored comes back; test_hostile_files has what is damaged."""

import os
import sys
import tracemalloc
import zlib

import numpy as np
import pytest
from PIL import Image

from nacre import FileFormatError
from nacre.io.images import read_color, read_depth, write_color_png, write_depth_png


@pytest.fixture
def depth():
    image = np.random.default_rng(1).integers(0, 65536, (24, 31), dtype=np.uint16)
    image[0, :3] = 0, 1, 65535
    return image


def pgm(depth, header=None):
    height, width = depth.shape
    return (header or f"P5\n{width} {height}\n65535\n".encode()) + depth.astype(">u2").tobytes()


def test_depth_png_comes_back(tmp_path, depth):
    write_depth_png(tmp_path / "a.png", depth)
    with Image.open(tmp_path / "a.png") as image:
        assert image.mode == "I;16"
    again = read_depth(tmp_path / "a.png")
    assert again.dtype == np.uint16
    np.testing.assert_array_equal(again, depth)


def test_depth_png_takes_any_layout(tmp_path, depth):
    write_depth_png(tmp_path / "a.png", depth.T[::-1])
    np.testing.assert_array_equal(read_depth(tmp_path / "a.png"), depth.T[::-1])


@pytest.mark.parametrize(
    "header",
    [b"P5\n31 24\n65535\n", b"P5 31 24 9823\n", b"P5\n# a comment 1 2 3\n31 24\n# another\n65535\n"],
)
def test_depth_pgm_is_not_scaled(tmp_path, depth, header):
    (tmp_path / "a.pgm").write_bytes(pgm(depth, header))
    again = read_depth(tmp_path / "a.pgm")
    assert again.dtype == np.uint16
    np.testing.assert_array_equal(again, depth)


def test_pgm_pixels_may_look_like_white_space(tmp_path):
    depth = np.full((2, 2), 0x0A20, dtype=np.uint16)
    (tmp_path / "a.pgm").write_bytes(pgm(depth))
    np.testing.assert_array_equal(read_depth(tmp_path / "a.pgm"), depth)


@pytest.mark.parametrize("dtype", [np.uint16, np.float32, np.float64, np.float16])
def test_depth_npy_keeps_its_type(tmp_path, depth, dtype):
    stored = (depth / 7).astype(dtype)
    np.save(tmp_path / "a.npy", stored)
    again = read_depth(tmp_path / "a.npy")
    assert again.dtype == dtype
    np.testing.assert_array_equal(again, stored)


@pytest.mark.parametrize("channel", ["Z", "Y", "anything"])
def test_depth_exr(tmp_path, channel):
    exr = pytest.importorskip("OpenEXR")
    depth = np.linspace(0.5, 3, 12, dtype=np.float32).reshape(3, 4)
    with exr.File({"type": exr.scanlineimage}, {channel: depth}) as image:
        image.write(str(tmp_path / "a.exr"))
    np.testing.assert_array_equal(read_depth(tmp_path / "a.exr"), depth)
    (tmp_path / "b.exr").write_bytes((tmp_path / "a.exr").read_bytes()[:100])
    with pytest.raises(FileFormatError, match=r"b\.exr"):
        read_depth(tmp_path / "b.exr")


def test_an_exr_image_may_lie_in_a_folder_whose_name_is_no_text(tmp_path):
    exr = pytest.importorskip("OpenEXR")
    folder = tmp_path / os.fsdecode(b"r\xff")
    try:
        folder.mkdir()
    except OSError:
        pytest.skip("file names here are text")
    depth = np.linspace(0.5, 3, 12, dtype=np.float32).reshape(3, 4)
    exr.File({}, {"Z": depth}).write(str(tmp_path / "a.exr"))
    (tmp_path / "a.exr").rename(folder / "a.exr")
    np.testing.assert_array_equal(read_depth(folder / "a.exr"), depth)


def test_color_comes_back(tmp_path):
    color = np.random.default_rng(2).integers(0, 256, (9, 7, 3), dtype=np.uint8)
    write_color_png(tmp_path / "c.png", color)
    again = read_color(tmp_path / "c.png")
    assert again.dtype == np.uint8
    assert again.flags.writeable
    np.testing.assert_array_equal(again, color)


@pytest.mark.parametrize("mode", ["L", "RGBA", "P"])
def test_color_of_other_modes_becomes_rgb(tmp_path, mode):
    Image.new("RGB", (4, 3), (204, 204, 204)).convert(mode).save(tmp_path / "c.png")
    np.testing.assert_array_equal(read_color(tmp_path / "c.png"), np.full((3, 4, 3), 204, np.uint8))


@pytest.mark.parametrize("mode", ["L", "RGB", "RGBA", "P", "1"])
def test_eight_bit_image_is_not_depth(tmp_path, mode):
    Image.new(mode, (4, 3)).save(tmp_path / "d.png")
    with pytest.raises(FileFormatError, match=r"d\.png.*16 bits"):
        read_depth(tmp_path / "d.png")


@pytest.mark.parametrize("read", [read_depth, read_color])
@pytest.mark.parametrize("keep", [0, 4, 20, 60, 0.5, 0.9])
def test_truncated_png_is_named(tmp_path, depth, read, keep):
    path = tmp_path / "cut.png"
    if read is read_depth:
        write_depth_png(path, depth)
    else:
        write_color_png(path, np.repeat(depth[:, :, None] % 256, 3, axis=2).astype(np.uint8))
    data = path.read_bytes()
    path.write_bytes(data[: keep if isinstance(keep, int) else int(keep * len(data))])
    with pytest.raises(FileFormatError, match=r"cut\.png.*damaged or truncated"):
        read(path)


@pytest.mark.parametrize("part", [b"zTXt", b"iCCP", b"iTXt"])
def test_bombs_beside_the_pixels_are_not_unpacked(tmp_path, part):
    def chunk(name, data):
        return len(data).to_bytes(4, "big") + name + data + zlib.crc32(name + data).to_bytes(4, "big")

    stored = np.arange(12, dtype=np.uint16).reshape(3, 4)
    write_depth_png(tmp_path / "d.png", stored)
    data = (tmp_path / "d.png").read_bytes()
    bomb = chunk(part, b"a\0\0" + zlib.compress(bytes(1 << 25), 9))
    (tmp_path / "d.png").write_bytes(data[:33] + bomb + data[33:])
    tracemalloc.start()
    np.testing.assert_array_equal(read_depth(tmp_path / "d.png"), stored)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 1 << 19


@pytest.mark.parametrize("name", ["x.png", "x.pgm", "x.npy"])
def test_missing_file_is_missing(tmp_path, name):
    with pytest.raises(FileNotFoundError):
        read_depth(tmp_path / name)


@pytest.mark.parametrize(
    "bad", [np.zeros((3, 4), np.int32), np.zeros((3, 4)), np.zeros((3, 4, 1), np.uint16)]
)
def test_written_depth_must_be_uint16(tmp_path, bad):
    with pytest.raises(ValueError, match="uint16"):
        write_depth_png(tmp_path / "a.png", bad)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "bad", [np.zeros((3, 4), np.uint8), np.zeros((3, 4, 3)), np.zeros((3, 4, 4), np.uint8)]
)
def test_written_color_must_be_uint8_rgb(tmp_path, bad):
    with pytest.raises(ValueError, match="uint8"):
        write_color_png(tmp_path / "a.png", bad)


def test_without_pillow_the_error_says_what_to_install(tmp_path, depth, monkeypatch):
    write_depth_png(tmp_path / "a.png", depth)
    monkeypatch.setitem(sys.modules, "PIL.Image", None)
    with pytest.raises(ImportError, match=r'pip install "nacre\[images\]"'):
        read_depth(tmp_path / "a.png")
    (tmp_path / "a.pgm").write_bytes(pgm(depth))
    np.testing.assert_array_equal(read_depth(tmp_path / "a.pgm"), depth)


def test_without_openexr_the_error_says_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "OpenEXR", None)
    (tmp_path / "a.exr").write_bytes(b"")
    with pytest.raises(ImportError, match=r'pip install "nacre\[exr\]"'):
        read_depth(tmp_path / "a.exr")
