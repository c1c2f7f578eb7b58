"""Which reader opens a recording."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, NamedTuple

from nacre._internal.guided import guided
from nacre._internal.names_elsewhere import SOME_FRAMES
from nacre.camera import Camera
from nacre.datasets import (
    azure_kinect,
    icl_nuim,
    images,
    plain,
    record3d,
    redwood,
    rosbag,
    seven_scenes,
    stanford,
    stray_scanner,
    tum,
)
from nacre.datasets.listing import describe, files
from nacre.datasets.overrides import Overrides
from nacre.datasets.sequence import Sequence, check_first_view
from nacre.errors import UnknownRecordingError, meant
from nacre.io.cameras import read_camera
from nacre.io.images import COLOR_SUFFIXES, DEPTH_SUFFIXES


class Reader(NamedTuple):
    """One recorded format."""

    layout: str
    recognise: Callable[[Path], bool]
    read: Callable[[Path, Overrides], Sequence]


# The first that recognises a folder opens it.
READERS = {
    module.FORMAT: Reader(module.LAYOUT, module.recognise, module.read)
    for module in (
        rosbag, record3d, azure_kinect, icl_nuim, tum, stray_scanner, plain, seven_scenes, stanford, redwood,
        images,
    )
}  # fmt: skip
_OF_FILES = [module.FORMAT for module in (stanford, rosbag, record3d, azure_kinect)]
# Recordings that are one file; .ply may be a range scan or a point file.
FILE_SUFFIXES = (*rosbag.SUFFIXES, *record3d.SUFFIXES, *azure_kinect.SUFFIXES)


@guided("a recording, or depth images with camera= and depth_scale=", **SOME_FRAMES)
def open_sequence(
    path: str | os.PathLike[str] | Iterable[Any],
    *,
    format: str | None = None,
    camera: Camera | str | os.PathLike[str] | None = None,
    depth_scale: float | None = None,
    max_difference: float = 0.02,
) -> Sequence:
    """
    Open a recording of a depth camera; the format is recognised from the files.

    Parameters
    ----------
    path : path-like, or iterable of path-like
        The folder of the recording, a file (``.bag``, ``.mcap``, ``.db3``, ``.r3d``), or a single range scan.
        Or depth images in their order, an iterable of paths, or of pairs of a depth and a colour image; then
        ``camera`` and ``depth_scale`` are needed.
    format : str, optional
        ``"tum"``, ``"redwood"`` (also Open3D), ``"7-scenes"``, ``"icl-nuim"``, ``"stray-scanner"``,
        ``"rosbag"`` (ROS 1 and 2, MCAP, RealSense), ``"record3d"``, ``"azure-kinect"`` (images of an
        ``.mkv``), ``"plain"`` (camera.json and depth/), ``"stanford"`` (range scans), or ``"images"`` (a
        folder of depth images). None recognises it.
    camera : Camera or path-like, optional
        The depth camera, or a camera file, in place of what the recording or its format says.
    depth_scale : float, optional
        Stored units per metre, in place of what the recording or its format says.
    max_difference : float
        How far in time a colour image or a true pose may be from its depth image [s].

    Returns
    -------
    Sequence
        Read view by view when asked for.

    Raises
    ------
    FileNotFoundError
        There is nothing at ``path``.
    FileFormatError
        The recording is not recognised or not complete: the message says what was looked for, what was found
        and what to do. Also when the images have not the camera's size.
    ImportError
        The images need a package that is not installed.

    Examples
    --------
    >>> sequence = nacre.open_sequence("rgbd_dataset_freiburg3_teddy")  # doctest: +SKIP
    >>> for frame in sequence:  # doctest: +SKIP
    ...     model.add_frame(frame.depth, color=frame.color, timestamp=frame.timestamp)
    """
    if depth_scale is not None and not (math.isfinite(depth_scale) and depth_scale > 0):
        raise ValueError(
            f"depth_scale must be a positive number of stored units per metre, got {depth_scale!r}"
        )
    if not max_difference >= 0:
        raise ValueError(f"max_difference must be seconds, 0 or more, got {max_difference!r}")
    if isinstance(camera, (str, os.PathLike)):
        found = read_camera(camera)
        camera, depth_scale = found.camera, depth_scale if depth_scale is not None else found.depth_scale
    given = Overrides(camera, depth_scale, max_difference)
    if not isinstance(path, str | os.PathLike):
        if not isinstance(path, Iterable):
            raise TypeError(f"path must be a path, or paths of depth images, got {type(path).__name__}")
        if format not in (None, images.FORMAT):
            raise ValueError(f"format must be None or {images.FORMAT!r} for a list of images, got {format!r}")
        return check_first_view(images.read_listed(path, given))
    folder = Path(path)
    if not folder.exists():
        beside = [p.name for p in folder.parent.iterdir()] if folder.parent.is_dir() else []
        raise FileNotFoundError(f"no such recording: {folder}{meant(folder.name, beside)}")
    reader = require_format(format) if format is not None else _recognised(folder, given)
    return check_first_view(reader.read(folder, given))


def is_recording(path: Path) -> bool:
    """Return whether a folder or a file looks like a recording; what is in it is not read."""
    return any(READERS[name].recognise(path) for name in (READERS if path.is_dir() else _OF_FILES))


def require_format(format: str) -> Reader:
    """Return the reader of a format; a ValueError lists those that there are."""
    key = format.lower().replace("_", "-")
    if key not in READERS:
        known = ", ".join(map(repr, READERS))
        raise ValueError(f"format must be one of {known}, got {format!r}{meant(key, READERS)}")
    return READERS[key]


def _recognised(path: Path, given: Overrides) -> Reader:
    if not path.is_dir():
        for name in _OF_FILES:
            if READERS[name].recognise(path):
                return READERS[name]
        raise UnknownRecordingError(
            path,
            "not a recording: a recording is a folder, a .bag, .mcap, .db3 or .r3d, or a range scan (.ply "
            "with a range_grid)",
        )
    for name, reader in READERS.items():
        if reader.recognise(path) and not (name == images.FORMAT and _needs_more(path, given)):
            return reader
    raise UnknownRecordingError(path, _explanation(path))


def _needs_more(folder: Path, given: Overrides) -> bool:
    return (given.camera is None or given.depth_scale is None) and _hint(folder) is not None


def _explanation(folder: Path) -> str:
    if not any(folder.iterdir()):
        return "the folder is empty: give the one that holds the depth images, or copy them there"
    known = "".join(f"\n  {name}: {reader.layout}" for name, reader in READERS.items())
    hint = _hint(folder)
    return (
        f"no known recording. Found: {describe(folder)}. "
        + (f"{hint} " if hint is not None else "")
        + f"Known formats:{known}"
    )


def _hint(folder: Path) -> str | None:
    """Say what a folder almost is."""
    depth = files(folder / "depth", DEPTH_SUFFIXES)
    if depth and (
        (folder / "groundtruth.txt").is_file()
        or (folder / "rgb.txt").is_file()
        or redwood.has_time_names(depth)
    ):
        return (
            "This is almost a TUM recording: depth.txt is missing, the list with a line 'timestamp file' for "
            "each depth image. (A plain recording needs camera.json instead.)"
            + _listing_command(folder, depth)
        )
    colors = [f"{name}/" for name in ("rgb", "color", "image", ".") if files(folder / name, COLOR_SUFFIXES)]
    if colors and not images.recognise(folder):
        return (
            f"There are colour images (in {colors[0].replace('./', 'the folder itself')}), but nothing that "
            "looks like depth: nacre needs depth images, in depth/ or with 'depth' in their names."
        )
    bags = files(folder, rosbag.SUFFIXES)
    if bags:
        return f"A ROS 2 recording has metadata.yaml, which is missing; give a file alone: {bags[0].name}."
    for module in (record3d, azure_kinect, stray_scanner):
        lacking: str | None = module.missing(folder)
        if lacking is not None:
            return lacking
    inside = [p for p in sorted(folder.iterdir()) if p.is_dir() and not p.name.startswith(".")]
    names = [p.name for p in inside if any(r.recognise(p) for n, r in READERS.items() if n != images.FORMAT)]
    if names:
        return f"Give one of the folders in it: {', '.join(names[:8])}."
    return None


def _listing_command(folder: Path, depth: list[Path]) -> str:
    """Say how to make depth.txt, where the images are named by their times."""
    if not redwood.has_time_names(depth):
        return ""
    suffix = depth[0].suffix
    command = f'for f in depth/*{suffix}; do echo "$(basename "$f" {suffix}) $f"; done > depth.txt'
    return f" Its images are named by their times: (cd '{folder}' && {command}) makes it."
