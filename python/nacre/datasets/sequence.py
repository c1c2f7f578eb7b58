"""What every recording looks like once it is open."""

from __future__ import annotations

import collections.abc
import dataclasses
import hashlib
import logging
import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any, overload

import numpy as np
import numpy.typing as npt

from nacre._internal import arrays
from nacre._internal.guided import guided
from nacre._internal.value_equality import Value
from nacre._internal.warned import warn
from nacre.camera import Camera
from nacre.datasets.listing import files, pair
from nacre.datasets.sanity_check import depth_oddity
from nacre.errors import FileFormatError, printable
from nacre.io.images import ATTRIBUTE_SUFFIXES, COLOR_SUFFIXES, read_attribute, read_color, read_depth
from nacre.trajectory import Trajectory

_log = logging.getLogger(__name__)

DepthLoader = Callable[[Path], npt.NDArray[np.float32]]
ColorLoader = Callable[[Path], npt.NDArray[np.uint8]]
ConfidenceLoader = Callable[[Path], npt.NDArray[np.uint8]]


def load_confidence(path: Path) -> npt.NDArray[np.uint8]:
    """Read how sure a camera is of its pixels."""
    return np.ascontiguousarray(read_color(path)[..., 0])


def load_mask(path: Path) -> npt.NDArray[np.bool_]:
    """Read an image as a mask: pixels that are not black are of interest."""
    return np.asarray(read_color(path).any(axis=2), np.bool_)


@dataclass(frozen=True, eq=False, repr=False)
class SequenceFrame(Value):
    """
    One view of a recording.

    Attributes
    ----------
    index : int
        The place in the recording, from 0; a slice of a sequence keeps it.
    depth : (H, W) float32
        Metres; NaN where nothing was measured.
    camera : Camera
        The depth camera.
    timestamp : float or None
        Seconds; None where the recording has no time stamps.
    color : (H, W, 3) uint8 or None
        RGB.
    truth : (4, 4) float64 or None
        ``world_from_camera``, where the recording knows it.
    mask : (H, W) bool or None
        The pixels of interest, where the recording says so.
    attributes : dict of str to (H, W) or (H, W, C) float32
        Whatever else the recording has for each pixel, by name.
    confidence : (H, W) uint8 or None
        How sure the camera is of each pixel, in levels of its own; 0 is not of interest.
    """

    index: int
    depth: npt.NDArray[np.float32]
    camera: Camera
    timestamp: float | None
    color: npt.NDArray[np.uint8] | None
    truth: npt.NDArray[np.float64] | None
    mask: npt.NDArray[np.bool_] | None = None
    attributes: Mapping[str, npt.NDArray[np.float32]] = field(default_factory=dict)
    confidence: npt.NDArray[np.uint8] | None = None

    def __repr__(self) -> str:
        height, width = self.depth.shape
        parts = [f"index={self.index}", f"depth={width}x{height}"]
        if self.timestamp is not None:
            parts.append(f"timestamp={self.timestamp!r}")
        parts += [
            name for name in ("color", "truth", "mask", "confidence") if getattr(self, name) is not None
        ]
        parts += self.attributes
        return f"SequenceFrame({', '.join(parts)})"

    def _repr_png_(self) -> bytes | None:
        from nacre.pictures.notebook import picture_of_depth

        return picture_of_depth(self.depth)


@dataclass(frozen=True, eq=False)
class FrameSource:
    """Where one view comes from: files that are read when the view is asked for."""

    index: int
    depth: Path
    color: Path | None = None
    timestamp: float | None = None
    truth: npt.NDArray[np.float64] | None = None
    mask: Path | None = None
    attributes: Mapping[str, Path] = field(default_factory=dict)
    confidence: Path | None = None


class Sequence(collections.abc.Sequence[SequenceFrame]):
    """
    A recording, read view by view when asked for; memory stays that of one view.

    It has a length, indices and slices, and it can be iterated. A view that cannot be read raises
    :class:`nacre.FileFormatError` with the file's name; the iterator can then go on with the next one.

    Attributes
    ----------
    name : str
        The recording's name.
    format : str
        Which reader opened it, for instance ``"tum"``.
    path : Path
        The folder or file.
    camera : Camera
        The depth camera, the same for all views.
    depth_scale : float
        Stored depth units per metre.
    truth : Trajectory or None
        The true trajectory, as recorded.
    estimate : Trajectory or None
        A trajectory that came along but is somebody's estimate.
    """

    @guided("nacre.open_sequence(path) opens a recording")
    def __init__(
        self,
        path: Path,
        *,
        format: str,
        camera: Camera,
        depth_scale: float,
        sources: collections.abc.Sequence[FrameSource],
        truth: Trajectory | None = None,
        estimate: Trajectory | None = None,
        load_depth: DepthLoader | None = None,
        load_color: ColorLoader = read_color,
        load_confidence: ConfidenceLoader = load_confidence,
        name: str | None = None,
    ) -> None:
        self.path = path
        self.name = printable(name if name is not None else path.resolve().name)
        self.format = format
        self.camera = camera
        self.depth_scale = depth_scale
        self.truth = truth
        self.estimate = estimate
        self._sources: collections.abc.Sequence[FrameSource] = tuple(sources)
        self._load_depth = load_depth or partial(load_depth_metres, depth_scale=depth_scale)
        self._load_color = load_color
        self._load_confidence = load_confidence

    def __len__(self) -> int:
        return len(self._sources)

    @overload
    def __getitem__(self, index: int) -> SequenceFrame: ...
    @overload
    def __getitem__(self, index: slice) -> Sequence: ...
    def __getitem__(self, index: int | slice) -> SequenceFrame | Sequence:
        if isinstance(index, slice):
            return self._with_sources(self._sources[index])
        return self._read(self._sources[index])

    def __iter__(self) -> Iterator[SequenceFrame]:
        return _FrameIterator(self)

    def __repr__(self) -> str:
        camera = f"{self.camera.model} {self.camera.width}x{self.camera.height}"
        extras = "".join(
            f", {name}"
            for name, there in (("color", self.has_color), ("truth", self.truth is not None))
            if there
        )
        return (
            f"Sequence({self.name!r}, format={self.format!r}, frames={len(self)}, camera={camera}, "
            f"depth_scale={self.depth_scale:g}{extras})"
        )

    @property
    def has_color(self) -> bool:
        """Whether any view has a colour image."""
        return any(source.color is not None for source in self._sources)

    @property
    def has_timestamps(self) -> bool:
        """Whether the views have time stamps."""
        return bool(self._sources) and all(source.timestamp is not None for source in self._sources)

    def file(self, index: int) -> Path:
        """Return the depth file of a view."""
        return self._sources[index].depth

    def color_file(self, index: int) -> Path | None:
        """Return the colour image of a view where that is a PNG or JPEG file, used as it is; else None."""
        path = self._sources[index].color
        if path is None or self._load_color is not read_color:
            return None
        return path if path.suffix.lower() in (".png", ".jpg", ".jpeg") else None

    def timestamp(self, index: int) -> float | None:
        """Return when a view was taken [s]; None where that is not known."""
        return self._sources[index].timestamp

    def true_pose(self, index: int) -> npt.NDArray[np.float64] | None:
        """Return ``world_from_camera`` of a view as the recording has it; None where it is not known."""
        return self._sources[index].truth

    def digests(self) -> dict[str, str]:
        """
        Return digests by which a recording that has changed is known again.

        Returns
        -------
        dict
            "files" of the names and sizes of the views' files, "times" of when they were written last; of a
            recording within a file that file's.
        """
        files, times = hashlib.sha256(), hashlib.sha256()
        for source in self._sources:
            given = (source.depth, source.color, source.mask, source.confidence, *source.attributes.values())
            for path in (path for path in given if path is not None):
                try:
                    found = path.stat()
                except OSError:
                    found = self.path.stat()
                files.update(os.fsencode(f"{path.name} {found.st_size}\n"))
                times.update(f"{found.st_mtime_ns}\n".encode())
        return {"files": files.hexdigest(), "times": times.hexdigest()}

    def without_color(self) -> Sequence:
        """Return the same recording with ``color`` None in every view."""
        return self._with_sources([dataclasses.replace(source, color=None) for source in self._sources])

    def with_masks(self, folder: str | os.PathLike[str]) -> Sequence:
        """
        Return the same recording with masks from a folder of images.

        A mask belongs to the depth image of the same stem, or else of the same first number; its pixels that
        are not black are of interest. A view without a mask is used whole.

        Raises
        ------
        FileFormatError
            None of the folder's images belongs to a depth image.
        """
        masks = self._paired(Path(folder), COLOR_SUFFIXES)
        return self._with_sources(
            [dataclasses.replace(s, mask=mask) for s, mask in zip(self._sources, masks, strict=True)]
        )

    def with_attribute(self, name: str, folder: str | os.PathLike[str]) -> Sequence:
        """
        Return the same recording with images of a folder as an attribute of its frames.

        An image (PNG, TIFF, JPEG or ``.npy``, with the values that are stored) belongs to the depth image of
        the same stem, or else of the same first number.

        Parameters
        ----------
        name : str
            Of the attribute.
        folder : path-like
            Of the images.

        Returns
        -------
        Sequence

        Raises
        ------
        FileFormatError
            None of the folder's images belongs to a depth image.
        """
        images = self._paired(Path(folder), ATTRIBUTE_SUFFIXES)
        return self._with_sources(
            [
                s if image is None else dataclasses.replace(s, attributes={**s.attributes, name: image})
                for s, image in zip(self._sources, images, strict=True)
            ]
        )

    def _paired(self, folder: Path, suffixes: Iterable[str]) -> list[Path | None]:
        """Return the image of a folder that belongs to each depth image."""
        found = pair([source.depth for source in self._sources], files(folder, suffixes))
        if not any(found):
            here = "no image here is named as a depth image of the recording is"
            raise FileFormatError(folder, here if folder.is_dir() else "there is no such folder")
        return found

    def _with_sources(self, sources: collections.abc.Sequence[FrameSource]) -> Sequence:
        return Sequence(
            self.path,
            format=self.format,
            camera=self.camera,
            depth_scale=self.depth_scale,
            sources=sources,
            truth=self.truth,
            estimate=self.estimate,
            load_depth=self._load_depth,
            load_color=self._load_color,
            load_confidence=self._load_confidence,
            name=self.name,
        )

    def _read(self, source: FrameSource) -> SequenceFrame:
        depth = _named(self._load_depth, source.depth)
        check_size(source.depth, depth, self.camera)
        color = None
        if source.color is not None:
            color = _named(self._load_color, source.color)
            check_size(source.color, color, self.camera)
        mask = None
        if source.mask is not None:
            mask = _named(load_mask, source.mask)
            check_size(source.mask, mask, self.camera)
        confidence = None
        if source.confidence is not None:
            confidence = _named(self._load_confidence, source.confidence)
            check_size(source.confidence, confidence, self.camera)
            mask = confidence > 0 if mask is None else mask & (confidence > 0)
        attributes = {name: _named(read_attribute, path) for name, path in source.attributes.items()}
        for name, path in source.attributes.items():
            check_size(path, attributes[name], self.camera)
        return SequenceFrame(
            source.index,
            depth,
            self.camera,
            source.timestamp,
            color,
            source.truth,
            mask,
            attributes,
            confidence,
        )


class _FrameIterator(Iterator[SequenceFrame]):
    """Unlike a generator it survives the view that cannot be read."""

    def __init__(self, sequence: Sequence) -> None:
        self._sequence = sequence
        self._next = 0

    def __next__(self) -> SequenceFrame:
        if self._next >= len(self._sequence):
            raise StopIteration
        self._next += 1
        return self._sequence[self._next - 1]


def load_depth_metres(path: Path, depth_scale: float) -> npt.NDArray[np.float32]:
    """Read a depth image as float32 metres; 0, 65535, negative and not finite values become NaN."""
    stored = read_depth(path)
    metres = arrays.in_metres(stored, depth_scale)
    invalid = ~(metres > 0) | ~np.isfinite(metres) | (stored == 65535)
    return np.where(invalid, np.float32(np.nan), metres)


def check_size(path: Path, image: npt.NDArray[Any], camera: Camera) -> None:
    """Raise unless an image has the camera's size."""
    height, width = image.shape[:2]
    if (width, height) != (camera.width, camera.height):
        raise FileFormatError(
            path,
            f"the image is {width} wide and {height} high, but the camera is {camera.width} by "
            f"{camera.height}; give the camera that took it",
        )


def check_first_view(sequence: Sequence) -> Sequence:
    """
    Compare the sizes of the first readable view with the camera, so that a wrong camera is told at once.

    Colour images of another size cannot be used pixel by pixel: the sequence then comes back without colour.
    """
    first_error: FileFormatError | None = None
    for source in sequence._sources:
        try:
            depth = _named(sequence._load_depth, source.depth)
        except FileFormatError as error:
            first_error = first_error or error
            continue
        check_size(source.depth, depth, sequence.camera)
        doubt = depth_oddity(depth)
        if doubt is not None:
            _log.warning("%s: %s", source.depth, doubt)
        if source.color is None:
            break
        try:
            check_size(source.color, _named(sequence._load_color, source.color), sequence.camera)
        except FileFormatError as error:
            warn(f"colour is left out: {error}")
            return sequence.without_color()
        break
    else:
        if first_error is not None:
            raise FileFormatError(
                sequence.path,
                f"none of its {len(sequence)} depth images can be read; the first: {first_error}",
            )
    return sequence


def _named(read: Callable[[Path], Any], path: Path) -> Any:
    """Read a file; that it is missing or not readable is said as a FileFormatError too."""
    try:
        return read(path)
    except OSError as error:
        raise FileFormatError(path, f"cannot be read: {error.strerror or error}") from error
