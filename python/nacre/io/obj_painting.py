"""The image that is painted on the mesh of an OBJ file."""

from __future__ import annotations

import dataclasses
import os
from array import array
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt

from nacre.errors import FileFormatError
from nacre.io.mesh_arrays import MeshArrays, fan, float_of, split, vertex_normals
from nacre.io.named_files import inside
from nacre.io.obj import Attributed, index_of, read_into
from nacre.io.painting import Painting, is_known_image
from nacre.io.raw import code_lines, decode, excerpt, read_file

_MOST_MATERIAL_BYTES = 1 << 24
_NO_PLACE = -1


def read_painted(path: str | os.PathLike[str]) -> tuple[MeshArrays, Painting | None]:
    """
    Read an OBJ file, and the image that its material paints on all triangles; None where there is none.

    A vertex that is at several places on the image is there several times.

    Raises
    ------
    FileFormatError
        When the mesh is broken, or what is painted on it is, or is more than one image.
    """
    lines = _Painted()
    mesh = read_into(lines, path)
    image = lines.image(Path(path))
    if image is None:
        return mesh, None
    uv, triangles = lines.painted(path)
    if mesh.normals is None:  # before the surface is cut into the parts of the image
        mesh = dataclasses.replace(mesh, normals=vertex_normals(mesh.vertices, mesh.triangles))
    mesh, places = split(mesh, triangles)
    return mesh, Painting(image, uv[places])


class _Painted(Attributed):
    """A mesh, and where its corners are on which images, as it grows line by line."""

    def __init__(self) -> None:
        super().__init__()
        self.places = array("d")
        self.place_of_corner = array("q")
        self.libraries: list[tuple[bytes, int]] = []
        self.material = b""
        self.used: set[bytes] = set()
        self.others = {b"vt": self.add_place, b"mtllib": self.add_library, b"usemtl": self.choose}

    def add_place(self, text: bytes, _: int) -> None:
        """Take in a place on the image: the second number may be missing, a third one has no meaning."""
        u, v, *_rest = [*text.split(), b"0"]
        self.places.extend((float_of(u), float_of(v)))

    def add_library(self, names: bytes, line: int) -> None:
        """Take in which files have the materials."""
        self.libraries.append((names, line))

    def choose(self, material: bytes, _: int) -> None:
        """Take in the material of the faces that follow."""
        self.material = material

    def add_corners(self, words: Sequence[bytes]) -> None:
        """Take in a polygon, and where its corners are on the image of its material."""
        super().add_corners(words)
        self.used.add(self.material)
        num_places = len(self.places) // 2
        for word in words:
            place = b"".join(word.split(b"/")[1:2])
            self.place_of_corner.append(index_of(place, num_places) if place else _NO_PLACE)

    def image(self, path: Path) -> bytes | None:
        """Return the file of the image that is on all faces; None where no face has one."""
        if not self.places:
            return None
        images: dict[bytes, Path | None] = {}
        for names, line in self.libraries:
            for library in _files(path, names, line):
                images |= _images(library)
        unknown = sorted(self.used - set(images) - {b""}) if self.libraries else []
        if unknown:
            raise FileFormatError(path, f"its material files have no {excerpt(unknown[0])}")
        found = {images.get(material) for material in self.used}
        (image, *others) = found
        if others or (image is not None and min(self.place_of_corner) == _NO_PLACE):
            raise FileFormatError(path, "several images, or one on some of the faces alone, are not read")
        if image is None:
            return None
        data = _read(image)
        if not is_known_image(data):
            raise FileFormatError(image, "neither a PNG nor a JPEG image", offset=0)
        return data

    def painted(self, path: str | os.PathLike[str]) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.int64]]:
        """Return places on an image, from its upper left corner, and those of each triangle's corners."""
        counts, place_of_corner = (np.frombuffer(a, np.int64) for a in (self.counts, self.place_of_corner))
        num_corners = len(place_of_corner)
        triangles = place_of_corner[fan(path, np.arange(num_corners), counts, num_corners)]
        with np.errstate(over="ignore", invalid="ignore"):
            upwards = np.frombuffer(self.places, np.float64).reshape(-1, 2)
            uv = (upwards * (1, -1) + (0, 1)).astype(np.float32)
        if triangles.max() >= len(uv):
            reason = f"a face names texture coordinates {triangles.max()}, counted from 0, of {len(uv)}"
            raise FileFormatError(path, reason)
        if not np.isfinite(uv).all():
            raise FileFormatError(path, "texture coordinates must be finite")
        return uv, triangles


def _images(library: Path) -> dict[bytes, Path | None]:
    """Return the image of each material of an MTL file."""
    images: dict[bytes, Path | None] = {}
    material = b""
    for line, text in code_lines(_read(library, _MOST_MATERIAL_BYTES)):
        keyword, _, rest = text.strip().partition(b" ")
        name, is_image = rest.strip(), keyword.lower() == b"map_kd"
        if keyword == b"newmtl" and name:
            material = name
            images[material] = None
        elif is_image and material and name.startswith(b"-"):
            raise FileFormatError(library, f"options are not read: {excerpt(text.strip())}", line=line)
        elif is_image and material and name:
            images[material] = _file(library, name, line)
        elif is_image or keyword == b"newmtl" or (keyword and not keyword[:1].isalpha()):
            raise FileFormatError(library, f"cannot read {excerpt(text.strip())}", line=line)
    return images


def _files(path: Path, names: bytes, line: int) -> list[Path]:
    """Return the files of a line that names one, or several with blanks between them."""
    if len(names.split()) < 2 or _file(path, names, line).is_file():
        return [_file(path, names, line)]
    return [_file(path, name, line) for name in names.split()]


def _file(path: Path, name: bytes, line: int) -> Path:
    """Return the file that a line of a file in the same folder names."""
    return inside(path.parent, decode(name).replace("\\", "/"), path, line)


def _read(path: Path, most: int | None = None) -> bytes:
    try:
        return read_file(path, most)
    except OSError as error:
        raise FileFormatError(path, f"it cannot be read: {error.strerror}") from None
