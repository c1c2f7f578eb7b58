"""Colour images with their poses, as other programs take them."""

from __future__ import annotations

import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre._internal.arrays import FloatArray, as_poses
from nacre._internal.kinds import as_kind
from nacre.camera import Camera
from nacre.datasets.sequence import Sequence
from nacre.errors import FileFormatError
from nacre.io.cloud import cloud_of
from nacre.io.images import write_color_png

# Those programs have the origin in the corner of the first pixel, which in nacre is at its centre.
POSES_OF_RUN = "of a Reconstruction give done.sequence, done.poses and cloud=done.cloud"
PIXEL_CENTER = 0.5
_GRAY = 128


@dataclass(frozen=True)
class PosedImage:
    """A colour image that was written."""

    place: int
    """Of its view in the sequence."""
    path: Path
    world_from_camera: npt.NDArray[np.float64]


def pinhole_of(sequence: Sequence) -> Camera:
    """Return the camera of a recording, which must be one that other programs know."""
    camera = as_kind("sequence", sequence, Sequence, "a nacre.Sequence").camera
    if camera.model != "pinhole":
        raise FileFormatError(sequence.path, f"images need a pinhole camera, this one is {camera.model}")
    return camera


def require_new_folder(folder: Path) -> None:
    """Raise where a folder holds anything."""
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise FileExistsError(f"{folder} is not empty; give another folder or remove it first")


def write_images(folder: Path, sequence: Sequence, poses: npt.ArrayLike) -> list[PosedImage]:
    """
    Write the colour images of the views that have a pose, as they are stored where that can be.

    Raises
    ------
    FileFormatError
        No view has both an image and a pose.
    """
    known = as_poses("poses", poses)
    if len(known) != len(sequence):
        raise ValueError(f"poses must have one for each of {len(sequence)} views, got {len(known)}")
    written = []
    for i, pose in enumerate(known):
        if not np.isfinite(pose).all():
            continue
        stored = sequence.color_file(i)
        frame = None if stored is not None else sequence[i]
        if stored is None and (frame is None or frame.color is None):
            continue
        path = folder / f"frame_{i:06d}{'.png' if stored is None else stored.suffix.lower()}"
        folder.mkdir(parents=True, exist_ok=True)
        if stored is not None:
            shutil.copyfile(stored, path)
        elif frame is not None and frame.color is not None:
            write_color_png(path, frame.color)
        written.append(PosedImage(i, path, pose))
    if not written:
        reason = "no view has both a colour image and a pose, which other programs need"
        raise FileFormatError(sequence.path, reason)
    return written


def colored_points(given: Any) -> tuple[FloatArray, npt.NDArray[np.uint8]]:
    """Return the finite points of what has some and their colours, gray where they have none."""
    cloud = cloud_of(given)
    finite = np.isfinite(cloud.points).all(axis=1)
    points = cloud.points[finite]
    colors = np.full(points.shape, _GRAY, np.uint8) if cloud.colors is None else cloud.colors[finite]
    return points, colors
