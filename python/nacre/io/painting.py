"""The image that is painted on a mesh, as its file has it."""

from __future__ import annotations

import os
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from nacre.io.images import decode_color

_IMAGES = (b"\x89PNG\r\n\x1a\n", b"\xff\xd8\xff")  # how PNG and JPEG files begin


@dataclass(frozen=True, eq=False)
class Painting:
    """
    An image that is painted on a mesh.

    Attributes
    ----------
    image : bytes
        A PNG or JPEG file.
    uv : (N, 2) float32
        Where each vertex is on the image: parts of its width and height, from the upper left corner.
    """

    image: bytes
    uv: npt.NDArray[np.float32]

    def rows(self, chosen: slice | npt.NDArray[np.int64]) -> Painting:
        """Return it for some of the vertices."""
        return Painting(self.image, self.uv[chosen].copy())

    def colors(self, path: str | os.PathLike[str]) -> npt.NDArray[np.uint8]:
        """Return what is painted at the vertices, (N, 3); the path names the image where it is damaged."""
        image = decode_color(self.image, path)
        height, width = image.shape[:2]
        repeated = np.where((self.uv < 0) | (self.uv > 1), self.uv % 1.0, self.uv)
        pixels = np.floor(repeated * (width, height)).astype(np.int64)
        columns, rows = np.minimum(pixels, (width - 1, height - 1)).T
        return np.asarray(image[rows, columns], np.uint8)


def is_known_image(data: bytes) -> bool:
    """Say whether bytes are a file of PNG or JPEG, which all programs that show meshes read."""
    return data.startswith(_IMAGES)
