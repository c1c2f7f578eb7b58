"""What is painted on a mesh: an image, and where its triangles lie on it."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre._internal import arrays
from nacre._internal.kinds import as_kind
from nacre._internal.value_equality import Value


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Texture(Value):
    """
    An image, and where the triangles of a mesh lie on it.

    Attributes
    ----------
    image : (H, W, 3) uint8
        RGB.
    uv : (N, 2) float32
        Places on the image, from 0 to 1: from its left edge to its right, from its top edge to its bottom.
    triangles : (T, 3) int32
        For each triangle of the mesh the rows of ``uv`` of its corners.
    """

    image: npt.NDArray[np.uint8]
    uv: npt.NDArray[np.float32]
    triangles: npt.NDArray[np.int32]


def check_texture(texture: Any, num_triangles: int) -> Texture:
    """Return a texture, which must fit a mesh of so many triangles."""
    as_kind("texture", texture, Texture, "a nacre.meshing.Texture")
    image = arrays.as_array("texture.image", texture.image)
    if image.dtype != np.uint8 or image.ndim != 3 or image.shape[2] != 3 or not image.size:
        raise ValueError(f"texture.image must be (H, W, 3) uint8, got {image.shape} of {image.dtype}")
    uv = arrays.as_rows(arrays.as_real("texture.uv", texture.uv), np.float32)
    if uv.ndim != 2 or uv.shape[1] != 2 or not np.isfinite(uv).all():
        raise ValueError(f"texture.uv must be (N, 2) finite numbers, got shape {uv.shape}")
    triangles = arrays.as_triangles("texture.triangles", texture.triangles, len(uv))
    if len(triangles) != num_triangles:
        raise ValueError(
            f"texture.triangles must have one row per triangle ({num_triangles}), got {len(triangles)}"
        )
    return Texture(np.ascontiguousarray(image), uv, triangles)
