"""Images, depth and poses as nerfstudio takes them: ``transforms.json``."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre._internal.guided import guided
from nacre.camera import Camera
from nacre.datasets.posed_images import (
    PIXEL_CENTER,
    POSES_OF_RUN,
    PosedImage,
    colored_points,
    pinhole_of,
    require_new_folder,
    write_images,
)
from nacre.datasets.sequence import Sequence
from nacre.io.atomic import atomic_writer
from nacre.io.cloud import Cloud
from nacre.io.images import write_depth_png
from nacre.io.points import write_points

_DEPTH_SCALE = 1000.0  # nerfstudio's own: stored units per metre
_LARGEST_STORED = 65535
_OPENGL_FROM_OPENCV = np.diag([1.0, -1.0, -1.0, 1.0])  # y up, looking along -z


@guided(POSES_OF_RUN)
def write_nerfstudio(
    folder: str | os.PathLike[str],
    sequence: Sequence,
    poses: npt.ArrayLike,
    *,
    cloud: Cloud | None = None,
) -> int:
    """
    Write colour images, depth images, poses and points as nerfstudio takes them.

    ``transforms.json`` names ``images/``, ``depth/`` (16 bits, millimetres; not of cameras that measure along
    the ray) and ``points.ply``. Lengths stay in metres, and the world's axes as they are.

    Parameters
    ----------
    folder : path-like
        It is made where it does not exist, and must be empty.
    sequence : Sequence
        A recording with colour images.
    poses : (N, 4, 4) array
        ``world_from_camera`` of each view; NaN where it is not known: that view is left out.
    cloud : Cloud, optional
        Points of the world, such as ``nacre.read_points("OUT/model.ply")``; gray where it has no colours.

    Returns
    -------
    int
        How many images were written.

    Raises
    ------
    FileFormatError
        No view has both an image and a pose, or the camera is orthographic.
    FileExistsError
        The folder is not empty.
    ValueError
        When an argument does not fit; the message names it.

    Notes
    -----
    Format: M. Tancik et al., "Nerfstudio", SIGGRAPH 2023, and its documentation of data conventions.
    """
    home = Path(folder)
    require_new_folder(home)
    camera = pinhole_of(sequence)
    images = write_images(home / "images", sequence, poses)
    document = _camera_fields(camera)
    if cloud is not None:
        points, colors = colored_points(cloud)
        write_points(home / "points.ply", points, colors=colors)
        document["ply_file_path"] = "points.ply"
    document["frames"] = [_frame_fields(image) for image in images]
    if camera.depth == "z":
        _write_depth(home / "depth", sequence, images, document["frames"])
    with atomic_writer(home / "transforms.json") as stream:
        stream.write((json.dumps(document, indent=1) + "\n").encode())
    return len(images)


def _camera_fields(camera: Camera) -> dict[str, Any]:
    k1, k2, p1, p2, k3 = camera.distortion
    return {
        "camera_model": "OPENCV",
        "w": camera.width,
        "h": camera.height,
        "fl_x": camera.fx,
        "fl_y": camera.fy,
        "cx": camera.cx + PIXEL_CENTER,
        "cy": camera.cy + PIXEL_CENTER,
        "k1": k1,
        "k2": k2,
        "k3": k3,
        "p1": p1,
        "p2": p2,
    }


def _frame_fields(image: PosedImage) -> dict[str, Any]:
    pose = image.world_from_camera @ _OPENGL_FROM_OPENCV
    return {"file_path": f"images/{image.path.name}", "transform_matrix": pose.tolist()}


def _write_depth(
    folder: Path, sequence: Sequence, images: list[PosedImage], fields: list[dict[str, Any]]
) -> None:
    """Write the depth images that belong to colour images, and name them in the fields of their frames."""
    folder.mkdir()
    for image, field in zip(images, fields, strict=True):
        stored = np.rint(np.nan_to_num(sequence[image.place].depth) * _DEPTH_SCALE)
        name = f"{image.path.stem}.png"
        write_depth_png(
            folder / name, np.where(stored <= _LARGEST_STORED, stored, 0).astype(np.uint16), fast=True
        )
        field["depth_file_path"] = f"depth/{name}"
