"""Azure Kinect and Orbbec Femto recordings (.mkv), by way of their images: calibration.json and depth/."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre._internal.warned import warn
from nacre.camera import Camera
from nacre.datasets.listing import describe, files
from nacre.datasets.overrides import Overrides
from nacre.datasets.rational_lens import polynomial_of
from nacre.datasets.sequence import FrameSource, Sequence
from nacre.errors import FileFormatError
from nacre.io.cameras import check_lens
from nacre.io.images import DEPTH_SUFFIXES, read_depth
from nacre.io.json_files import parse_json
from nacre.io.raw import read_file

FORMAT = "azure-kinect"
LAYOUT = "calibration.json and the depth images, in depth/ or beside it, as ffmpeg takes them out of the .mkv"
SUFFIXES = (".mkv",)
DEPTH_SCALE = 1000.0

# Size of the depth images: the side of the sensor in their pixels, and where on it they begin.
_MODES = {
    (640, 576): (1024, 192, 180),
    (320, 288): (512, 96, 90),
    (1024, 1024): (1024, 0, 0),
    (512, 512): (512, 0, 0),
}
_LARGEST = 1e30  # parameter, of a lens whose polynomials a float can hold
_MODEL = "CALIBRATION_LensDistortionModelBrownConrady"
_MOST_BYTES = 1 << 20
_PURPOSE = "CALIBRATION_CameraPurposeDepth"


def recognise(path: Path) -> bool:
    """Say whether this is a recording of these cameras, or the folder of its images."""
    if path.is_file():
        return path.suffix.lower() in SUFFIXES
    return (path / "calibration.json").is_file() and bool(_images(path))


def missing(folder: Path) -> str | None:
    """Say what a folder lacks that is almost such a recording."""
    videos = files(folder, SUFFIXES)
    if (folder / "calibration.json").is_file() or videos:
        return (
            f"This is almost an Azure Kinect recording: {_advice(videos[0].name if videos else 'REC.mkv')}."
        )
    return None


def read(path: Path, given: Overrides) -> Sequence:
    """
    Open the folder of a recording's images.

    The intrinsics are those of calibration.json, which every recording carries, for the mode that the images'
    size tells. Colours are those of another camera, and are not read.
    """
    if path.is_file():
        raise FileFormatError(path, f"an .mkv is read by way of its images: {_advice(path.name)}")
    depth = _images(path)
    if not depth:
        raise FileFormatError(
            path, f"no depth images, the folder holds {describe(path)}: {_advice('REC.mkv')}"
        )
    height, width = read_depth(depth[0]).shape
    return Sequence(
        path,
        format=FORMAT,
        camera=given.camera or _camera(path / "calibration.json", width, height),
        depth_scale=given.scale_or(DEPTH_SCALE),
        sources=[FrameSource(i, image) for i, image in enumerate(depth)],
    )


def _images(folder: Path) -> list[Path]:
    return files(folder / "depth", DEPTH_SUFFIXES) or files(folder, DEPTH_SUFFIXES)


def _advice(name: str) -> str:
    return (
        f"mkdir -p images/depth && ffmpeg -dump_attachment:t:0 images/calibration.json -i {name} -map 0:1 "
        "-fps_mode passthrough images/depth/%05d.png, then give images (0:1 is the depth track, 0:0 where "
        "there is no colour; for colours, give the folder that Open3D's azure_kinect_mkv_reader.py writes)"
    )


def _camera(path: Path, width: int, height: int) -> Camera:
    """Return the depth camera in the mode that has images of a size."""
    if (width, height) not in _MODES:
        known = ", ".join(f"{w} x {h}" for w, h in _MODES)
        raise FileFormatError(
            path, f"depth images are {known}, these are {width} x {height}; give the camera"
        )
    side, left, top = _MODES[width, height]
    cx, cy, fx, fy, *lens = _parameters(path)
    (k1, k2, k3), error = polynomial_of(np.array(lens[:6]), np.hypot(width, height) / (2 * side * fx))
    if error * side * fx > 1:
        warn(f"{path}: the lens is known to {error * side * fx:.1f} pixels at the edges of the images")
    # The file measures from the corner of the sensor in its sides; pixel centres are integers.
    try:
        camera = Camera(
            width, height, side * fx, side * fy, side * cx - left - 0.5, side * cy - top - 0.5,
            distortion=[k1, k2, lens[9], lens[8], k3],
        )  # fmt: skip
        return check_lens(path, camera)
    except ValueError as error:
        raise FileFormatError(path, str(error)) from error


def _parameters(path: Path) -> npt.NDArray[np.float64]:
    """Return cx cy fx fy k1 ... k6, the centre of distortion, p2 and p1 of the depth camera."""
    try:
        cameras: Any = parse_json(path, read_file(path, _MOST_BYTES).rstrip(b"\0"))
        cameras = cameras["CalibrationInformation"]["Cameras"]
        (lens,) = (camera["Intrinsics"] for camera in cameras if camera["Purpose"] == _PURPOSE)
        model, values = lens["ModelType"], np.array(lens["ModelParameters"], np.float64)
    except FileFormatError:
        raise
    except (ValueError, KeyError, TypeError, OverflowError, OSError) as error:
        raise FileFormatError(path, f"not the calibration of an Azure Kinect: {error!r}") from error
    is_list = values.ndim == 1 and len(values) >= 14 and (np.abs(values) <= _LARGEST).all()
    if model != _MODEL or not is_list or not (values[2:4] > 0).all():
        got = len(values) if values.ndim == 1 else f"an array {values.shape}"
        raise FileFormatError(
            path, f"14 finite parameters of {_MODEL} were expected, got {got} of {str(model)[:80]}"
        )
    return values[:14]
