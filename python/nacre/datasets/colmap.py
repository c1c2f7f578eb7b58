"""A COLMAP model as text: cameras, images and points."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import numpy.typing as npt

from nacre._internal.guided import guided
from nacre._internal.quaternions import quaternion_from_matrix
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
from nacre.io.rows import encode_lines

_UNKNOWN_ERROR = -1  # as COLMAP has it for points that it did not triangulate itself


@guided(POSES_OF_RUN)
def write_colmap(
    folder: str | os.PathLike[str],
    sequence: Sequence,
    poses: npt.ArrayLike,
    *,
    cloud: Cloud | None = None,
) -> int:
    """
    Write colour images, their poses and points as a COLMAP model, for Gaussian splatting and the like.

    ``images/`` has the images, ``sparse/0/`` the texts ``cameras.txt``, ``images.txt`` and ``points3D.txt``.
    Lengths stay in metres, and the world's axes as they are.

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
    Format: J. L. Schonberger and J.-M. Frahm, "Structure-from-Motion Revisited", CVPR 2016, and COLMAP's
    documentation.
    """
    home = Path(folder)
    require_new_folder(home)
    camera = pinhole_of(sequence)
    images = write_images(home / "images", sequence, poses)
    model = home / "sparse" / "0"
    model.mkdir(parents=True)
    _write_points(model / "points3D.txt", cloud)
    with atomic_writer(model / "cameras.txt") as stream:
        stream.write(f"# CAMERA_ID MODEL WIDTH HEIGHT PARAMS[]\n1 {_camera_words(camera)}\n".encode())
    with atomic_writer(model / "images.txt") as stream:
        stream.write(
            b"# IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME, then a line of POINTS2D[], empty here\n"
        )
        stream.writelines(_image_line(i, image).encode() for i, image in enumerate(images, 1))
    return len(images)


def _camera_words(camera: Camera) -> str:
    """Return the simplest of COLMAP's camera models that has this camera's distortion."""
    k1, k2, p1, p2, k3 = camera.distortion
    if k3 != 0:
        name, distortion = "FULL_OPENCV", [k1, k2, p1, p2, k3, 0.0, 0.0, 0.0]
    elif any(camera.distortion):
        name, distortion = "OPENCV", [k1, k2, p1, p2]
    else:
        name, distortion = "PINHOLE", []
    center = (camera.cx + PIXEL_CENTER, camera.cy + PIXEL_CENTER)
    numbers = (camera.fx, camera.fy, *center, *distortion)
    return f"{name} {camera.width} {camera.height} {' '.join(map(repr, map(float, numbers)))}"


def _image_line(number: int, image: PosedImage) -> str:
    """Return the two lines of an image: its pose, which takes the world to the camera, and no points."""
    rotation = image.world_from_camera[:3, :3].T
    x, y, z, w = quaternion_from_matrix(rotation).tolist()
    translation = (-rotation @ image.world_from_camera[:3, 3]).tolist()
    words = " ".join(map(repr, (w, x, y, z, *translation)))
    return f"{number} {words} 1 {image.path.name}\n\n"


def _write_points(path: Path, cloud: Cloud | None) -> None:
    with atomic_writer(path) as stream:
        stream.write(b"# POINT3D_ID X Y Z R G B ERROR TRACK[] as (IMAGE_ID POINT2D_IDX), empty here\n")
        if cloud is None:
            return
        points, colors = colored_points(cloud)
        line = f"{{}} {{}} {{}} {{}} {{}} {{}} {{}} {_UNKNOWN_ERROR}\n"
        stream.writelines(encode_lines(line, [np.arange(1, len(points) + 1), points, colors]))
