"""Depth images and nothing else, of a folder or a list: the caller says what the camera is."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from nacre.datasets.listing import describe, files, pair
from nacre.datasets.overrides import Overrides
from nacre.datasets.sequence import FrameSource, Sequence
from nacre.errors import FileFormatError
from nacre.io.images import COLOR_SUFFIXES, DEPTH_SUFFIXES

FORMAT = "images"
_UNDESCRIBED = (
    "these are depth images without a description. Give camera= and depth_scale= (units per metre: 1000 for "
    "millimetres, 5000 for TUM)"
)
LAYOUT = "depth images, in depth/ or directly, with camera=... and depth_scale=... given"


def recognise(folder: Path) -> bool:
    """Say whether a folder looks like this format."""
    return bool(_depth_images(folder))


def read(folder: Path, given: Overrides) -> Sequence:
    """Open a folder of this format."""
    depth = _depth_images(folder)
    if not depth:
        raise FileFormatError(folder, f"no depth images in the folder; it holds {describe(folder)}")
    camera, depth_scale = given.required(
        folder,
        f"{_UNDESCRIBED}, or put a camera.json beside depth/: "
        '{"model": "pinhole", "width": 640, "height": 480, '
        '"fx": 525, "fy": 525, "cx": 319.5, "cy": 239.5, "depth_scale": 1000}',
    )
    colors: list[Path | None] = [None] * len(depth)
    for candidates in (
        _marked(folder, ("color", "rgb")),
        *(files(folder / n, COLOR_SUFFIXES) for n in ("color", "rgb")),
    ):
        if candidates:
            colors = pair(depth, candidates)
            break
    return Sequence(
        folder,
        format=FORMAT,
        camera=camera,
        depth_scale=depth_scale,
        sources=[FrameSource(i, path, colors[i]) for i, path in enumerate(depth)],
    )


def read_listed(listed: Iterable[Any], given: Overrides) -> Sequence:
    """Open depth images, or pairs of a depth and a colour image, by their paths."""
    pairs = [item if isinstance(item, tuple) and len(item) == 2 else (item, None) for item in listed]
    for index, paths in enumerate(pairs):
        for path in paths:
            if not isinstance(path, str | os.PathLike | None) or paths[0] is None:
                raise TypeError(f"path[{index}] must be a path, or a pair of depth and colour, got {path!r}")
    if not pairs:
        raise ValueError("path must have at least one depth image, got none")
    depth = [Path(path) for path, _ in pairs]
    colors = [None if path is None else Path(path) for _, path in pairs]
    folder = depth[0].parent
    camera, depth_scale = given.required(folder, _UNDESCRIBED)
    return Sequence(
        folder,
        format=FORMAT,
        camera=camera,
        depth_scale=depth_scale,
        sources=[FrameSource(i, *paths) for i, paths in enumerate(zip(depth, colors, strict=True))],
    )


def _depth_images(folder: Path) -> list[Path]:
    inside = files(folder / "depth", DEPTH_SUFFIXES)
    if inside:
        return inside
    here = files(folder, DEPTH_SUFFIXES)
    return [path for path in here if "depth" in path.name.lower()] or here


def _marked(folder: Path, words: tuple[str, ...]) -> list[Path]:
    return [p for p in files(folder, COLOR_SUFFIXES) if any(word in p.name.lower() for word in words)]
