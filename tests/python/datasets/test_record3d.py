"""Record3D recordings, packed here as the app packs them: .r3d, unpacked, EXR + JPG; and broken ones."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import nacre

Image = pytest.importorskip("PIL.Image")
liblzfse = pytest.importorskip("liblzfse")
from record3d_files import FRAMES, HEIGHT, WIDTH, contents, depth_image, jpeg, packed, unpacked  # noqa: E402


@pytest.mark.parametrize("write", [packed, unpacked])
def test_it_is_recognised_and_read(write: Any, tmp_path: Path) -> None:
    sequence = nacre.open_sequence(write(tmp_path / "a.r3d", contents()))
    assert (sequence.format, len(sequence), sequence.depth_scale) == ("record3d", FRAMES, 1)
    for i, frame in enumerate(sequence):
        assert np.isnan(frame.depth[:2]).all()
        np.testing.assert_array_equal(frame.depth[2:], depth_image(i)[2:])
        assert frame.timestamp == pytest.approx(5 + i / 30)
        assert frame.color is not None
        assert frame.color.shape == (HEIGHT, WIDTH, 3)
        np.testing.assert_allclose(frame.color[100, [20, 170]], [(200, 0, 0), (0, 40 * i, 0)], atol=6)
        assert frame.truth is None


def test_the_cameras_pixels_are_wider_than_the_colours(tmp_path: Path) -> None:
    camera = nacre.open_sequence(packed(tmp_path / "a.r3d", contents())).camera
    assert (camera.width, camera.height) == (WIDTH, HEIGHT)
    assert (camera.fx, camera.fy) == pytest.approx((700 * 192 / 720, 701 * 256 / 960))
    assert (camera.cx, camera.cy) == pytest.approx((95.5, 127.5))  # the middle stays the middle


def test_cameras_of_single_frames_give_their_median(tmp_path: Path) -> None:
    every = [[700, 700, 359.5, 479.5], [720, 720, 363.5, 479.5], [1400, 1400, 359.5, 479.5]]
    camera = nacre.open_sequence(packed(tmp_path / "a.r3d", contents(perFrameIntrinsicCoeffs=every))).camera
    assert camera.fx == pytest.approx(720 * 192 / 720)


def test_pixels_of_the_lowest_confidence_are_masked(tmp_path: Path) -> None:
    mask = nacre.open_sequence(packed(tmp_path / "a.r3d", contents()))[0].mask
    assert mask is not None
    assert not mask[:, :10].any()
    assert mask[:, 10:].all()


def test_the_phones_poses_are_an_estimate(tmp_path: Path) -> None:
    turned = np.sqrt(0.5)  # a quarter about y, which points up
    poses = [[0, turned, 0, turned, 1, 2, 3]] * FRAMES
    estimate = nacre.open_sequence(packed(tmp_path / "a.r3d", contents(poses=poses))).estimate
    assert estimate is not None
    np.testing.assert_allclose(estimate.poses[0][:3, 3], [1, 2, 3])
    # The camera looks along its -z in ARKit, along its z here: both towards -x of the world.
    np.testing.assert_allclose(estimate.poses[0][:3, 2], [-1, 0, 0], atol=1e-12)
    np.testing.assert_allclose(estimate.poses[0][:3, 1], [0, -1, 0], atol=1e-12)


def test_the_export_exr_and_jpg(tmp_path: Path) -> None:
    openexr = pytest.importorskip("OpenEXR")
    folder = tmp_path / "EXR_RGBD"
    files = {"metadata.json": contents()["metadata"]} | {f"rgb/{i}.jpg": jpeg(i) for i in range(FRAMES)}
    unpacked(folder, files)
    (folder / "depth").mkdir()
    for i in range(FRAMES):
        header = {"compression": openexr.ZIP_COMPRESSION, "type": openexr.scanlineimage}
        openexr.File(header, {"R": depth_image(i)}).write(str(folder / "depth" / f"{i}.exr"))
    sequence = nacre.open_sequence(folder)
    assert (sequence.format, len(sequence)) == ("record3d", FRAMES)
    np.testing.assert_array_equal(sequence[2].depth[2:], depth_image(2)[2:])
    assert sequence[2].color is not None
    assert sequence.camera.fx == pytest.approx(700 * 192 / 720)


def test_early_versions_do_not_tell_sizes_and_times(tmp_path: Path) -> None:
    files = contents(dw=None, dh=None, frameTimestamps=None, poses=None, fps=60)
    files = {name: data for name, data in files.items() if not name.endswith(".conf")}
    sequence = nacre.open_sequence(packed(tmp_path / "a.r3d", files))
    assert (sequence.camera.width, sequence.camera.height) == (WIDTH, HEIGHT)
    assert sequence[2].timestamp == pytest.approx(2 / 60)
    assert sequence[2].mask is None
    assert sequence.estimate is None


class TestBroken:
    @pytest.mark.parametrize("name", ["../rgbd/9.depth", "/etc/9.depth", "rgbd/../../9.depth", "C:/9.depth"])
    def test_names_that_lead_out_are_refused(self, name: str, tmp_path: Path) -> None:
        path = packed(tmp_path / "a.r3d", contents() | {name: b"x"})
        with pytest.raises(
            nacre.FileFormatError, match=r"a\.r3d: refused: the name .* leads out of the archive"
        ):
            nacre.open_sequence(path)

    @pytest.mark.parametrize("part", [0.0, 0.5, 0.99])
    def test_an_archive_that_is_cut_short(self, part: float, tmp_path: Path) -> None:
        path = packed(tmp_path / "a.r3d", contents())
        path.write_bytes(path.read_bytes()[: int(part * path.stat().st_size)])
        with pytest.raises(nacre.FileFormatError, match=r"a\.r3d: not a whole \.r3d archive"):
            nacre.open_sequence(path)

    @pytest.mark.parametrize(
        ("name", "data", "message"),
        [
            ("metadata", b"{", "metadata, line 1: not a JSON file"),
            ("metadata", b"[]", "metadata: an object was expected, not a list"),
            ("metadata", b'{"dw": 192, "dh": 256}', "metadata: w must be a number of pixels, got None"),
            ("metadata", b'{"dw": 0, "dh": 256}', "metadata: dw must be a number of pixels, got 0"),
            ("metadata", b'{"dw": 192, "dh": 256, "w": 720, "h": 960}', "K must be nine numbers"),
        ],
    )
    def test_metadata(self, name: str, data: bytes, message: str, tmp_path: Path) -> None:
        with pytest.raises(nacre.FileFormatError, match=message):
            nacre.open_sequence(packed(tmp_path / "a.r3d", contents() | {name: data}))

    @pytest.mark.parametrize(
        ("changed", "message"),
        [
            ({"K": [0.0] * 9}, "metadata: .*fx"),
            ({"poses": [[1, 2]] * 3}, "metadata: poses must have 7 finite numbers"),
            ({"poses": [[0, 0, 0, 0, 1, 2, 3]] * 3}, r"metadata: poses\[0\]: "),
            ({"frameTimestamps": ["now"]}, "metadata: frameTimestamps must be a table of numbers"),
        ],
    )
    def test_values(self, changed: Any, message: str, tmp_path: Path) -> None:
        with pytest.raises(nacre.FileFormatError, match=message):
            nacre.open_sequence(packed(tmp_path / "a.r3d", contents(**changed)))

    @pytest.mark.parametrize(
        ("data", "message"),
        [
            (b"not lzfse", "LZFSE data is damaged|0 bytes found"),
            (liblzfse.compress(bytes(100)), "192 x 256 pixels of 4 bytes expected, 100 bytes found"),
            (bytes(1_000_000), "larger than what it can hold: 1000000 bytes"),
        ],
    )
    def test_an_image(self, data: bytes, message: str, tmp_path: Path) -> None:
        path = packed(tmp_path / "a.r3d", contents() | {"rgbd/1.depth": data})
        sequence = nacre.open_sequence(path)
        assert sequence[0].depth.shape == (HEIGHT, WIDTH)
        with pytest.raises(nacre.FileFormatError, match=rf"rgbd/1\.depth.*: .*({message})"):
            sequence[1]

    def test_a_photograph(self, tmp_path: Path) -> None:
        sequence = nacre.open_sequence(packed(tmp_path / "a.r3d", contents() | {"rgbd/1.jpg": b"no"}))
        with pytest.raises(nacre.FileFormatError, match=r"rgbd/1\.jpg: the image is damaged"):
            sequence[1]

    def test_without_metadata(self, tmp_path: Path) -> None:
        files = contents()
        del files["metadata"]
        with pytest.raises(nacre.FileFormatError, match="the file 'metadata' is missing"):
            nacre.open_sequence(packed(tmp_path / "a.r3d", files))
        with pytest.raises(nacre.FileFormatError, match="almost a Record3D recording: the file metadata"):
            nacre.open_sequence(unpacked(tmp_path / "folder", files))

    def test_without_the_library(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        path = packed(tmp_path / "a.r3d", contents())
        monkeypatch.setitem(sys.modules, "liblzfse", None)
        with pytest.raises(ImportError, match=r'pip install "nacre\[record3d\]"'):
            nacre.open_sequence(path)

    @pytest.mark.filterwarnings("ignore:colour is left out:UserWarning")
    def test_flipped_bytes_give_nothing_but_nacres_own_error(self, tmp_path: Path) -> None:
        files = {n: d for n, d in contents().items() if n == "metadata" or "/0." in n}
        whole = packed(tmp_path / "a.r3d", files).read_bytes()
        generator = np.random.default_rng(0)
        num_broken = 0
        for _ in range(40):
            data = np.frombuffer(whole, np.uint8).copy()
            data[generator.integers(len(data), size=20)] = generator.integers(256, size=20)
            (tmp_path / "a.r3d").write_bytes(data.tobytes())
            try:
                list(nacre.open_sequence(tmp_path / "a.r3d"))
            except nacre.FileFormatError:
                num_broken += 1
        assert num_broken > 5
