"""Record3D recordings (iPhone, iPad): .r3d archives, the same unpacked, and the export EXR + JPG."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre._internal.arrays import FARTHEST
from nacre._internal.quaternions import matrix_from_quaternion
from nacre.camera import Camera
from nacre.datasets.listing import describe
from nacre.datasets.open_file import OpenFile
from nacre.datasets.overrides import Overrides
from nacre.datasets.sequence import FrameSource, Sequence
from nacre.errors import FileFormatError, shown
from nacre.io.cameras import check_lens
from nacre.io.image_limits import check_lzfse
from nacre.io.images import decode_color, read_depth
from nacre.io.json_files import parse_json
from nacre.io.raw import read_file, require_regular
from nacre.trajectory import Trajectory

FORMAT = "record3d"
LAYOUT = (
    "a .r3d, the same unpacked (metadata and rgbd/), or the export EXR + JPG (metadata.json, depth/, rgb/)"
)
SUFFIXES = (".r3d",)

_MOST_METADATA = 1 << 25
_MOST_RATIO = 100  # of what the archive holds to its packed size, beyond the first megabyte
_COMPRESSIONS = (0, 8)  # none and deflate; zipfile unpacks the others in one go, whatever their size
_MISSING = 'Record3D recordings need pyliblzfse: pip install "nacre[record3d]"'
_SIZES = {256 * 192: (192, 256), 640 * 480: (480, 640), 960 * 720: (720, 960)}  # of early versions, upright


def recognise(path: Path) -> bool:
    """Say whether this is a recording of Record3D."""
    if path.is_file():
        return path.suffix.lower() in SUFFIXES
    packed = (path / "metadata").is_file() and (path / "rgbd").is_dir()
    return packed or ((path / "metadata.json").is_file() and any((path / "depth").glob("*.exr")))


def missing(folder: Path) -> str | None:
    """Say what a folder lacks that is almost such a recording."""
    if any((folder / "rgbd").glob("*.depth")):
        return "This is almost a Record3D recording: the file metadata is missing, beside rgbd/."
    if any((folder / "depth").glob("*.exr")) and (folder / "rgb").is_dir():
        return "This is almost a Record3D recording: metadata.json is missing, beside depth/ and rgb/."
    return None


def read(path: Path, given: Overrides) -> Sequence:
    """
    Open a recording of Record3D.

    Pixels of the lowest confidence are not used, others by what it is worth. Colours are brought to the size
    of the depth images. The camera is the median of those of the frames, which differ by the stabilisation of
    the lens; the poses are the phone's estimate, not a truth.
    """
    if not recognise(path):
        holds = f"; the folder holds {describe(path)}" if path.is_dir() else ""
        raise FileFormatError(path, f"a Record3D recording is {LAYOUT}{holds}")
    files: _Files = _Archive(path) if path.is_file() else _Files(path)
    told = _Metadata(files)
    depth = {int(match[1]): name for name in files.names if (match := _DEPTH.fullmatch(name))}
    if not depth:
        raise FileFormatError(path, "no depth images: rgbd/0.depth and so on, or depth/0.exr, were expected")
    first = depth[min(depth)]
    size = None if first.endswith(".exr") else told.depth_size
    height, width = files.depth(first, None).shape if size is None else size[::-1]
    names = set(files.names)
    sources = [
        FrameSource(
            index,
            path / name,
            _there(path, names, f"rgbd/{number}.jpg", f"rgb/{number}.jpg", f"rgb/{number}.png"),
            told.time(number),
            confidence=_there(path, names, f"rgbd/{number}.conf"),
        )
        for index, (number, name) in enumerate(sorted(depth.items()))
    ]
    images = _Images(files, (width, height), given.scale_or(1.0))
    return Sequence(
        path,
        format=FORMAT,
        camera=given.camera or told.camera(width, height),
        depth_scale=images.depth_scale,
        sources=sources,
        estimate=told.trajectory(sorted(depth)),
        load_depth=images.depth,
        load_color=images.color,
        load_confidence=images.confidence,
    )


_DEPTH = re.compile(r"(?:rgbd/(?=\d+\.depth)|depth/(?=\d+\.exr))(\d+)\.(?:depth|exr)")


def _there(path: Path, names: set[str], *wanted: str) -> Path | None:
    return next((path / name for name in wanted if name in names), None)


class _Files:
    """The files of a folder, by their names in it."""

    def __init__(self, path: Path) -> None:
        self.path = path
        inside = [p for folder in ("rgbd", "depth", "rgb") for p in (path / folder).glob("*")]
        self.names = [p.relative_to(path).as_posix() for p in [*path.glob("metadata*"), *inside]]

    def name_of(self, place: Path) -> str:
        return place.relative_to(self.path).as_posix()

    def read(self, name: str, most: int) -> bytes:
        return read_file(self.path / name, most)

    def depth(self, name: str, size: tuple[int, int] | None) -> npt.NDArray[np.float32]:
        """Return a depth image [m], NaN where nothing was measured."""
        if name.endswith(".exr"):
            image = read_depth(self.path / name).astype(np.float32)
        else:
            image = self.plane(name, np.float32, size)
        return np.where((image > 0) & np.isfinite(image), image, np.float32(np.nan))

    def plane(self, name: str, kind: Any, size: tuple[int, int] | None) -> npt.NDArray[Any]:
        """Return an image that is compressed by LZFSE; a size is (width, height)."""
        try:
            import liblzfse
        except ImportError as error:
            raise ImportError(_MISSING) from error
        place, each = self.path / name, np.dtype(kind).itemsize
        pixels = max(_SIZES) if size is None else size[0] * size[1]
        packed = self.read(name, 2 * pixels * each + 4096)
        check_lzfse(place, packed, max(_SIZES) * each if size is None else pixels * each)
        try:
            data = liblzfse.decompress(packed)
        except Exception as error:
            raise FileFormatError(place, f"the LZFSE data is damaged: {error}") from error
        size = size or _SIZES.get(len(data) // each)
        if size is None or len(data) != size[0] * size[1] * each:
            expected = (
                "a known size of image" if size is None else f"{size[0]} x {size[1]} pixels of {each} bytes"
            )
            raise FileFormatError(place, f"{expected} expected, {len(data)} bytes found")
        return np.frombuffer(data, kind).reshape(size[1], size[0])

    def color(self, name: str, size: tuple[int, int]) -> npt.NDArray[np.uint8]:
        """Return a colour image, brought to a size (width, height)."""
        return decode_color(self.read(name, 1 << 26), self.path / name, size)


class _Archive(OpenFile, _Files):
    """The files of an archive; they are read in it, and nothing is unpacked to the disk."""

    def __init__(self, path: Path) -> None:
        self.path = path
        require_regular(path)
        try:
            super().__init__()
            self.names = [info.filename for info in self._file.infolist() if not info.is_dir()]
        except Exception as error:  # zipfile has several, and lets through what damaged names and sizes cause
            raise FileFormatError(path, f"not a whole .r3d archive: {error}") from error
        for name in self.names:
            parts = PurePosixPath(name.replace("\\", "/")).parts
            if ".." in parts or parts[:1] == ("/",) or re.match(r"[A-Za-z]:", name):
                raise FileFormatError(path, f"refused: the name {name!r} leads out of the archive")

    def _open(self) -> Any:
        import zipfile

        return zipfile.ZipFile(self.path)

    def read(self, name: str, most: int) -> bytes:
        info = self._file.getinfo(name)
        if info.file_size > most:
            reason = f"larger than what it can hold: {info.file_size} bytes, more than {most}"
            raise FileFormatError(self.path / name, reason)
        if info.compress_type not in _COMPRESSIONS:
            raise FileFormatError(
                self.path / name, "refused: it is compressed by neither deflate nor nothing"
            )
        if info.file_size > (1 << 20) + _MOST_RATIO * info.compress_size:
            reason = f"refused: {info.file_size} bytes from {info.compress_size}"
            raise FileFormatError(self.path / name, reason)
        try:
            with self._turn() as archive, archive.open(info) as stream:
                data: bytes = stream.read(info.file_size)  # no more, whatever there is
                return data
        except Exception as error:  # zipfile's, and those of its decompressors
            raise FileFormatError(self.path / name, f"damaged in the archive: {error}") from error


@dataclass(frozen=True)
class _Images:
    """The images of a recording, all brought to one size (width, height)."""

    files: _Files
    size: tuple[int, int]
    depth_scale: float

    def depth(self, place: Path) -> npt.NDArray[np.float32]:
        """Read a depth image [m]."""
        return self.files.depth(self.files.name_of(place), self.size) / np.float32(self.depth_scale)

    def color(self, place: Path) -> npt.NDArray[np.uint8]:
        """Read a colour image."""
        return self.files.color(self.files.name_of(place), self.size)

    def confidence(self, place: Path) -> npt.NDArray[np.uint8]:
        """Read how sure the camera is of its pixels."""
        return self.files.plane(self.files.name_of(place), np.uint8, self.size)


class _Metadata:
    """What the recording says of itself."""

    def __init__(self, files: _Files) -> None:
        name = next((name for name in ("metadata", "metadata.json") if name in files.names), None)
        if name is None:
            raise FileFormatError(files.path, "the file 'metadata' is missing")
        self.place = files.path / name
        self.told = parse_json(self.place, files.read(name, _MOST_METADATA))
        if not isinstance(self.told, dict):
            raise FileFormatError(self.place, f"an object was expected, not a {type(self.told).__name__}")
        self.times = self._table("frameTimestamps", 1)

    @property
    def depth_size(self) -> tuple[int, int] | None:
        """Width and height of the depth images; None where an early version does not tell."""
        if "dw" not in self.told and "dh" not in self.told:
            return None
        return self._size("dw", "dh")

    def time(self, number: int) -> float | None:
        """Return when a frame was taken [s]."""
        if self.times is not None and number < len(self.times):
            return float(self.times[number, 0])
        fps = self.told.get("fps")
        if fps is not None and not (type(fps) in (int, float) and 0 <= fps < 1e6):
            raise FileFormatError(self.place, f"fps must be a number of frames per second, got {shown(fps)}")
        return number / fps if fps else None

    def camera(self, width: int, height: int) -> Camera:
        """Return the camera of depth images of a size; the file has that of the colours, which are larger."""
        color_width, color_height = self._size("w", "h")
        every = self._table("perFrameIntrinsicCoeffs", 4)
        if every is not None and len(every):
            fx, fy, cx, cy = np.median(every, axis=0)
        else:
            matrix = self._table("K", 1)
            if matrix is None or len(matrix) != 9:
                raise FileFormatError(self.place, "K must be nine numbers, the camera matrix by columns")
            fx, fy, cx, cy = matrix[[0, 4, 6, 7], 0]
        x, y = width / color_width, height / color_height
        # Pixel centres are integers: the middle of a wider pixel moves.
        try:
            camera = Camera(width, height, x * fx, y * fy, x * (cx + 0.5) - 0.5, y * (cy + 0.5) - 0.5)
            return check_lens(self.place, camera)
        except ValueError as error:
            raise FileFormatError(self.place, str(error)) from error

    def trajectory(self, numbers: list[int]) -> Trajectory | None:
        """Return the phone's estimate of ``world_from_camera``."""
        rows = self._table("poses", 7)
        times = [(number, self.time(number)) for number in numbers]
        if rows is None or any(number >= len(rows) or time is None for number, time in times):
            return None
        poses = np.tile(np.eye(4), (len(numbers), 1, 1))
        for pose, number in zip(poses, numbers, strict=True):
            try:
                pose[:3, :3] = matrix_from_quaternion(rows[number, :4])
            except ValueError as error:
                raise FileFormatError(self.place, f"poses[{number}]: {error}") from error
            pose[:3, :3] *= (1, -1, -1)  # ARKit's camera has y up and looks along -z
            pose[:3, 3] = rows[number, 4:]
            if np.abs(pose[:3, 3]).max() > FARTHEST:
                raise FileFormatError(self.place, f"poses[{number}] is more than {FARTHEST:g} m away")
        return Trajectory(np.array([time for _, time in times], np.float64), poses)

    def _size(self, *keys: str) -> tuple[int, int]:
        sides = [self.told.get(key) for key in keys]
        for key, side in zip(keys, sides, strict=True):
            if not isinstance(side, int) or not 0 < side <= 1 << 14:
                raise FileFormatError(self.place, f"{key} must be a number of pixels, got {shown(side)}")
        return sides[0], sides[1]

    def _table(self, key: str, columns: int) -> npt.NDArray[np.float64] | None:
        """Return numbers, (N, columns); None where there are none."""
        value = self.told.get(key)
        if value is None or value == []:
            return None
        if not isinstance(value, list):
            raise FileFormatError(self.place, f"{key} must be a table of numbers, got {shown(value)}")
        try:
            table = np.array(value, np.float64).reshape(len(value), -1)
        except (ValueError, TypeError, OverflowError) as error:
            raise FileFormatError(self.place, f"{key} must be a table of numbers: {error}") from error
        if table.shape[1] != columns or not np.isfinite(table).all():
            raise FileFormatError(self.place, f"{key} must have {columns} finite numbers for each frame")
        return table
