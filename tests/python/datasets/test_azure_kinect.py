"""Azure Kinect and Femto recordings: the images that ffmpeg takes out of an .mkv, with its calibration."""

from __future__ import annotations

import json
import shutil
import struct
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import nacre

pytest.importorskip("PIL")
from nacre.io.images import write_depth_png

# The depth camera of a device, whose SDK tells cx 332.064, cy 325.881, fx 503.928, fy 503.979 in this mode.
PARAMETERS = [
    0.5122697949409485, 0.49451231956481934, 0.4921168386936188, 0.4921667277812958, 3.1305770874023438,
    2.324939012527466, 0.1304156482219696, 3.458651542663574, 3.350114583969116, 0.6629416346549988, 0, 0,
    -0.0000511557373101823, 0.00008132171933539212,
]  # fmt: skip


def calibration(parameters: list[float] = PARAMETERS, model: str = "BrownConrady") -> str:
    def camera(purpose: str, values: list[float]) -> dict[str, Any]:
        return {
            "Purpose": f"CALIBRATION_CameraPurpose{purpose}",
            "SensorWidth": 1024,
            "SensorHeight": 1024,
            "Intrinsics": {
                "ModelParameterCount": len(values),
                "ModelParameters": values,
                "ModelType": f"CALIBRATION_LensDistortionModel{model}",
            },
        }

    cameras = [camera("Depth", parameters), camera("PhotoVideo", [0.5] * 14)]
    return json.dumps({"CalibrationInformation": {"Cameras": cameras, "InertialSensors": []}})


def write(folder: Path, width: int = 640, height: int = 576, inside: str = "depth", count: int = 2) -> Path:
    (folder / inside).mkdir(parents=True)
    for i in range(count):
        image = np.full((height, width), 900 + i, np.uint16)
        image[0] = 0
        write_depth_png(folder / inside / f"depth{i + 1:04d}.png", image, fast=True)
    (folder / "calibration.json").write_text(calibration())
    return folder


@pytest.mark.parametrize("inside", ["depth", "."])
def test_it_is_recognised_and_read(inside: str, tmp_path: Path) -> None:
    sequence = nacre.open_sequence(write(tmp_path / "r", inside=inside))
    assert (sequence.format, len(sequence), sequence.depth_scale) == ("azure-kinect", 2, 1000)
    assert np.isnan(sequence[1].depth[0]).all()
    assert sequence[1].depth[5, 5] == pytest.approx(0.901)


def test_the_camera_is_the_sdks(tmp_path: Path) -> None:
    camera = nacre.open_sequence(write(tmp_path / "r")).camera
    assert (camera.fx, camera.fy) == pytest.approx((503.927643, 503.978729), abs=1e-4)
    assert (camera.cx, camera.cy) == pytest.approx((332.064270, 325.880615), abs=1e-4)


@pytest.mark.filterwarnings("ignore:.*the lens is known to:UserWarning")
@pytest.mark.parametrize(
    ("size", "center"), [((320, 288), 165.782), ((512, 512), 261.782), ((1024, 1024), 524.064)]
)
def test_other_modes(size: tuple[int, int], center: float, tmp_path: Path) -> None:
    camera = nacre.open_sequence(write(tmp_path / "r", *size)).camera
    assert camera.fx == pytest.approx(503.927643 * (0.5 if size[0] < 640 else 1), abs=1e-4)
    assert camera.cx == pytest.approx(center, abs=1e-3)


def test_the_lens_is_the_sdks_within_a_pixel(tmp_path: Path) -> None:
    camera = nacre.open_sequence(write(tmp_path / "r")).camera
    k1, k2, k3, k4, k5, k6 = PARAMETERS[4:10]
    p2, p1 = PARAMETERS[12:14]
    for x, y in [(0.0, 0.0), (0.3, -0.2), (-0.5, 0.4), (0.6, 0.55), (-0.7, -0.6)]:
        r = x * x + y * y
        d = (1 + k1 * r + k2 * r**2 + k3 * r**3) / (1 + k4 * r + k5 * r**2 + k6 * r**3)
        u = camera.fx * (x * d + 2 * p1 * x * y + p2 * (r + 2 * x * x)) + camera.cx
        v = camera.fy * (y * d + 2 * p2 * x * y + p1 * (r + 2 * y * y)) + camera.cy
        a, b, c, d1, e = camera.distortion
        s = 1 + a * r + b * r**2 + e * r**3
        fitted = (
            camera.fx * (x * s + 2 * c * x * y + d1 * (r + 2 * x * x)) + camera.cx,
            camera.fy * (y * s + 2 * d1 * x * y + c * (r + 2 * y * y)) + camera.cy,
        )
        assert fitted == pytest.approx((u, v), abs=0.9)


def test_a_wide_view_says_how_well_the_lens_is_known(tmp_path: Path) -> None:
    with pytest.warns(UserWarning, match=r"the lens is known to \d+\.\d pixels at the edges") as told:
        nacre.open_sequence(write(tmp_path / "r", 1024, 1024, count=1))
    assert len(told) == 1


@pytest.mark.skipif(shutil.which("ffmpeg") is None, reason="no ffmpeg")
def test_the_commands_that_an_mkv_is_answered_with(tmp_path: Path) -> None:
    made = write(tmp_path / "made", count=3)
    subprocess.run(
        ["ffmpeg", "-loglevel", "error", "-framerate", "30", "-i", "made/depth/depth%04d.png",
         "-c:v", "rawvideo", "-pix_fmt", "gray16be", "-allow_raw_vfw", "1",
         "-attach", "made/calibration.json", "-metadata:s:t", "mimetype=application/octet-stream", "rec.mkv"],
        check=True, cwd=tmp_path,
    )  # fmt: skip
    # The camera's recorder names the pixels b16g in the track's BITMAPINFOHEADER, where ffmpeg has no name.
    kinds = [
        struct.pack("<IiiHH4s", 40, 640, y, 1, 16, name) for y, name in ((-576, bytes(4)), (576, b"b16g"))
    ]
    data = (tmp_path / "rec.mkv").read_bytes()
    assert data.count(kinds[0]) == 1
    (tmp_path / "rec.mkv").write_bytes(data.replace(*kinds))
    with pytest.raises(nacre.FileFormatError) as caught:
        nacre.open_sequence(tmp_path / "rec.mkv")
    command = caught.value.reason.partition("by way of its images: ")[2].partition(", then give images")[0]
    assert "rec.mkv" in command
    subprocess.run(command.replace("0:1", "0:0"), shell=True, check=True, cwd=tmp_path, capture_output=True)
    sequence = nacre.open_sequence(tmp_path / "images")
    assert (sequence.format, len(sequence)) == ("azure-kinect", 3)
    assert sequence.camera == nacre.open_sequence(made).camera
    np.testing.assert_array_equal(sequence[2].depth, nacre.open_sequence(made)[2].depth)


def test_the_folder_that_open3d_writes(tmp_path: Path) -> None:
    from nacre.io.images import write_color_png

    folder = write(tmp_path / "r", 64, 48)
    (folder / "calibration.json").unlink()
    (folder / "color").mkdir()
    for path in (folder / "depth").iterdir():
        write_color_png(folder / "color" / path.name, np.zeros((48, 64, 3), np.uint8))
    matrix = [60.0, 0, 0, 0, 61.0, 0, 31.5, 23.5, 1]
    (folder / "intrinsic.json").write_text(
        json.dumps({"width": 64, "height": 48, "intrinsic_matrix": matrix})
    )
    sequence = nacre.open_sequence(folder)
    assert (sequence.format, sequence.camera) == ("redwood", nacre.Camera(64, 48, 60, 61, 31.5, 23.5))
    assert sequence[1].color is not None


class TestBroken:
    @pytest.mark.parametrize(
        ("text", "message"),
        [
            ("[]", "not the calibration of an Azure Kinect: TypeError"),
            ("{}", "not the calibration of an Azure Kinect: KeyError"),
            (calibration(PARAMETERS[:5]), "14 finite parameters of .*BrownConrady were expected, got 5"),
            (calibration([0.5, 0.5, 0, 0] + [0.0] * 10), "14 finite parameters"),
            (calibration(model="Rational6KT"), ".* got 14 of CALIBRATION_LensDistortionModelRational6KT"),
        ],
    )
    def test_calibration(self, text: str, message: str, tmp_path: Path) -> None:
        folder = write(tmp_path / "r")
        (folder / "calibration.json").write_text(text)
        with pytest.raises(nacre.FileFormatError, match=rf"calibration\.json: {message}"):
            nacre.open_sequence(folder)

    def test_another_size(self, tmp_path: Path) -> None:
        with pytest.raises(nacre.FileFormatError, match=r"depth images are 640 x 576, .*, these are 64 x 48"):
            nacre.open_sequence(write(tmp_path / "r", 64, 48))

    def test_a_folder_that_is_almost_one(self, tmp_path: Path) -> None:
        (tmp_path / "take.mkv").write_bytes(b"")
        with pytest.raises(nacre.FileFormatError, match=r"almost an Azure Kinect .* -i take\.mkv -map 0:1"):
            nacre.open_sequence(tmp_path)
