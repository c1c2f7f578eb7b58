"""OBJ files: triangle meshes in and out."""

from __future__ import annotations

import dataclasses
import os
from array import array
from collections.abc import Callable, Iterator, Sequence
from io import BytesIO
from itertools import islice
from pathlib import Path

import numpy as np
import numpy.typing as npt

from nacre.errors import FileFormatError
from nacre.io.cloud import check_comments
from nacre.io.images import encode_jpeg
from nacre.io.mesh_arrays import MeshArrays, Polygons, float_of
from nacre.io.raw import MAX_COMMENTS, code_lines, decode, excerpt, file_writer, read_file
from nacre.io.rows import encode_lines
from nacre.texture import Texture

Float64 = npt.NDArray[np.float64]

_NO_NORMAL = -1
_MATERIAL = "texture"


def read_mesh(path: str | os.PathLike[str]) -> MeshArrays:
    """
    Read an OBJ file.

    Colours are the three numbers from 0 to 1 that may follow the coordinates. Normals are taken where each
    vertex has the same one in all its faces; texture coordinates and materials are left out.
    """
    return read_into(Attributed(), path)


def read_into(mesh: Attributed, path: str | os.PathLike[str]) -> MeshArrays:
    """Read an OBJ file; what else ``mesh`` takes of it is there afterwards."""
    data = read_file(path)
    for line_number, line in code_lines(data):
        keyword, *words = line.split() or [b""]
        try:
            if keyword == b"v":
                mesh.add_vertex(words)
            elif keyword == b"vn":
                mesh.normals.extend(map(float_of, words[:3]))
            elif keyword == b"f":
                mesh.add_corners(words)
            elif keyword in mesh.others:
                mesh.others[keyword](line.strip()[len(keyword) :].strip(), line_number)
            elif not keyword.isascii() or (keyword and not keyword[:1].isalpha()):
                raise ValueError
        except (ValueError, OverflowError):
            raise FileFormatError(path, f"cannot read {excerpt(line.strip())}", line=line_number) from None
    if not mesh.counts:
        raise FileFormatError(path, "not a mesh: there is no face")
    comments = tuple(islice(_comments(data), MAX_COMMENTS))
    return dataclasses.replace(mesh.finish(path), comments=comments)


def _comments(data: bytes) -> Iterator[str]:
    """Yield the lines of comment with which a file begins."""
    for line in BytesIO(data):
        if not line.startswith(b"#"):
            return
        yield decode(line[1:].strip())


class Attributed(Polygons):
    """
    A mesh with normals and colours as it grows line by line.

    Attributes
    ----------
    others : dict of bytes to callable
        What takes in lines that begin so, but for those of vertices, normals and faces: the rest of the line
        and its number.
    """

    def __init__(self) -> None:
        super().__init__()
        self.colors = array("d")
        self.normals = array("d")
        self.normal_of_corner = array("q")
        self.others: dict[bytes, Callable[[bytes, int], None]] = {}

    def add_vertex(self, words: Sequence[bytes]) -> None:
        """Take in three coordinates, and the colour that may follow them."""
        super().add_vertex(words)
        if len(words) == 6:
            self.colors.extend(map(float_of, words[3:]))

    def add_corners(self, words: Sequence[bytes]) -> None:
        """Take in a polygon, given as words ``v``, ``v/vt``, ``v//vn`` or ``v/vt/vn``."""
        self.add_face([index_of(word.partition(b"/")[0], self.num_vertices) for word in words])
        num_normals = len(self.normals) // 3
        for word in words:
            normal = b"".join(word.split(b"/")[2:3])
            self.normal_of_corner.append(index_of(normal, num_normals) if normal else _NO_NORMAL)

    def finish(self, path: str | os.PathLike[str]) -> MeshArrays:
        """Return vertices and triangles, with normals and colours where all vertices have them."""
        bare = super().finish(path)
        colors = np.frombuffer(self.colors, np.float64).reshape(-1, 3)
        has_colors = len(colors) == len(bare.vertices) and colors.min() >= 0 and colors.max() <= 1
        return MeshArrays(
            bare.vertices,
            bare.triangles,
            self._vertex_normals(),
            np.rint(255 * colors).astype(np.uint8) if has_colors else None,
        )

    def _vertex_normals(self) -> Float64 | None:
        """Return the normals of the vertices, or None where one has several, or none."""
        corners, chosen = (np.frombuffer(a, np.int64) for a in (self.corners, self.normal_of_corner))
        given = np.frombuffer(self.normals, np.float64)
        if len(given) % 3 or not len(given) or chosen.min() < 0 or chosen.max() >= len(given) // 3:
            return None
        given = given.reshape(-1, 3)
        normals = np.full((self.num_vertices, 3), np.nan)
        normals[corners] = given[chosen]
        is_same = (normals[corners] == given[chosen]).all()
        return normals if is_same and np.isfinite(normals).all() else None


def index_of(text: bytes, count: int) -> int:
    """Return the place, from 0, of an index that counts from 1 or, of the ``count`` so far, back from -1."""
    index = int(text)
    if b"_" in text or index == 0 or -index > count:
        raise ValueError
    return index - 1 if index > 0 else count + index


def write_mesh(
    path: str | os.PathLike[str], mesh: MeshArrays, *, comments: Sequence[str] = (), binary: bool = True
) -> None:
    """Write an OBJ file, which is text; :func:`nacre.write_mesh` has the parameters."""
    texture = mesh.texture
    vertex_line, vertex_columns = "v {} {} {}\n", [mesh.vertices]
    if mesh.colors is not None and texture is None:
        vertex_line = "v {} {} {} {} {} {}\n"
        vertex_columns.append(np.round(mesh.colors / 255.0, 6))
    head = "".join(f"# {line}".rstrip() + "\n" for line in check_comments(comments))
    if texture is not None:
        head += f"mtllib {_write_material(Path(path), texture)}\nusemtl {_MATERIAL}\n"
    face_line, face_columns = _faces(mesh)
    with file_writer(path) as stream:
        stream.write(head.encode())
        stream.writelines(encode_lines(vertex_line, vertex_columns))
        if texture is not None:
            upwards = texture.uv.astype(np.float64) * (1, -1) + (0, 1)
            stream.writelines(encode_lines("vt {} {}\n", [np.round(upwards, 7)]))
        if mesh.normals is not None:
            stream.writelines(encode_lines("vn {} {} {}\n", [mesh.normals]))
        stream.writelines(encode_lines(face_line, face_columns))


def _faces(mesh: MeshArrays) -> tuple[str, list[npt.NDArray[np.int64]]]:
    """Return a face's line, with corners ``v``, ``v/vt``, ``v//vn`` or ``v/vt/vn``, and its numbers."""
    vertices = mesh.triangles + np.int64(1)
    numbers, corner = [vertices], "{}"
    if mesh.texture is not None:
        numbers.append(mesh.texture.triangles + np.int64(1))
        corner += "/{}"
    if mesh.normals is not None:
        numbers.append(vertices)
        corner += "/{}" if mesh.texture is not None else "//{}"
    return f"f {corner} {corner} {corner}\n", [np.stack(numbers, axis=2).reshape(len(vertices), -1)]


def _write_material(path: Path, texture: Texture) -> str:
    """Write image and material beside an OBJ file, and return the material's file name."""
    image, material = path.with_name(f"{path.stem}_texture.jpg"), path.with_suffix(".mtl")
    if not path.name.isprintable():
        raise ValueError(f"path must be a name that fits a line of an OBJ file, got {path.name!r}")
    data = encode_jpeg(texture.image)
    with file_writer(image) as stream:
        stream.write(data)
    with file_writer(material) as stream:
        stream.write(
            f"newmtl {_MATERIAL}\nKa 1 1 1\nKd 1 1 1\nKs 0 0 0\nillum 1\nmap_Kd {image.name}\n".encode()
        )
    return material.name
