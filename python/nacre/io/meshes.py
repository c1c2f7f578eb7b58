"""Triangle meshes: OBJ, OFF, STL and PLY in, PLY out."""

from __future__ import annotations

import os
from array import array
from collections.abc import Iterator, Sequence
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from nacre._internal import arrays
from nacre.errors import FileFormatError
from nacre.io.cloud import Columns, check_cloud
from nacre.io.ply import read_ply, vertex_columns, write_ply
from nacre.io.ply_tables import Ragged
from nacre.io.raw import excerpt, read_file

if TYPE_CHECKING:
    from nacre.mesh import Mesh

MeshArrays = tuple[arrays.FloatArray, npt.NDArray[np.int32]]

_STL_FACET = np.dtype([("normal", "<f4", (3,)), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_STL_HEADER_BYTES = 84


def read_mesh(path: str | os.PathLike[str]) -> Mesh:
    """
    Read a triangle mesh.

    Parameters
    ----------
    path : path-like
        An ``.obj``, ``.off``, ``.stl`` or ``.ply`` file. Polygons become fans of triangles; the equal corners
        of an STL file become one vertex. Colours, normals and texture coordinates are left out.

    Returns
    -------
    Mesh

    Raises
    ------
    FileFormatError
        When the file is broken, has no triangle or a vertex that is not finite. The error names path, place
        and reason.
    OSError
        When the file cannot be read (FileNotFoundError, IsADirectoryError, ...).
    ValueError
        When the suffix is none of the above.
    """
    from nacre.mesh import Mesh

    vertices, triangles = read_mesh_arrays(path)
    try:
        return Mesh(vertices, triangles)
    except ValueError as error:
        raise FileFormatError(path, str(error)) from error


def read_mesh_arrays(path: str | os.PathLike[str]) -> MeshArrays:
    """
    Read a triangle mesh as arrays; :func:`read_mesh` has the formats and the errors.

    Returns
    -------
    vertices : (N, 3) float32 or float64
        As stored in PLY and STL files, float64 from the texts OBJ and OFF.
    triangles : (M, 3) int32
        Indices of the corners, counted from 0.
    """
    suffix = Path(path).suffix.lower()
    readers = {".obj": _read_obj, ".off": _read_off, ".stl": _read_stl, ".ply": _read_ply}
    if suffix not in readers:
        raise ValueError(f"mesh files end in {', '.join(readers)}, got {os.fspath(path)!r}")
    return readers[suffix](path)


def write_mesh(
    path: str | os.PathLike[str],
    vertices: npt.ArrayLike | Mesh,
    triangles: npt.ArrayLike | None = None,
    *,
    normals: npt.ArrayLike | None = None,
    colors: npt.ArrayLike | None = None,
    comments: Sequence[str] = (),
    binary: bool = True,
) -> None:
    """
    Write a triangle mesh as a PLY file, whole or not at all.

    Parameters
    ----------
    path : path-like
        A ``.ply`` file.
    vertices : Mesh, or (N, 3) array
        float32 is stored as float, everything else as double.
    triangles : (M, 3) array of integers
        Indices of the corners, counted from 0; not with a Mesh, which has its own.
    normals : (N, 3) array, optional
        Of the vertices; stored by the same rule.
    colors : (N, 3) array of integers from 0 to 255, or of floats from 0 to 1, optional
        Red, green, blue of the vertices.
    comments : sequence of str
        Lines for the header.
    binary : bool
        Binary little-endian; else text.

    Raises
    ------
    TypeError, ValueError
        When an argument does not fit; the message names it.
    OSError
        When the file cannot be written; it has the path.
    """
    if Path(path).suffix.lower() != ".ply":
        raise ValueError(f"meshes are written to .ply files, got {os.fspath(path)!r}")
    from nacre.mesh import Mesh

    if isinstance(vertices, Mesh):
        if triangles is not None:
            raise ValueError("triangles must not be given with a Mesh, which has its own")
        triangles, vertices = vertices.triangles, vertices.vertices
    if triangles is None:
        raise TypeError("triangles must be an array of indices, got None")
    points = arrays.as_points("vertices", vertices)
    corners = arrays.as_triangles("triangles", triangles, len(points))
    columns = vertex_columns(check_cloud(points, normals, colors, None))
    tables: dict[str, Columns] = {"vertex": columns, "face": {"vertex_indices": corners}}
    write_ply(path, tables, comments=comments, binary=binary)


def _fan(
    path: str | os.PathLike[str],
    corners: npt.NDArray[np.int64],
    counts: npt.NDArray[np.int64],
    num_vertices: int,
) -> npt.NDArray[np.int32]:
    """Return polygons, given as all their corners and the number of corners of each, as fans of triangles."""
    small = np.flatnonzero(counts < 3)
    if len(small):
        raise FileFormatError(path, f"face {small[0]} has {counts[small[0]]} corners")
    if num_vertices > np.iinfo(np.int32).max:
        raise FileFormatError(path, f"{num_vertices} vertices are more than a mesh can have")
    wrong = np.flatnonzero((corners < 0) | (corners >= num_vertices))
    if len(wrong):
        face = int(np.searchsorted(np.cumsum(counts), wrong[0], side="right"))
        reason = f"face {face} names vertex {corners[wrong[0]]}, counted from 0, of {num_vertices} vertices"
        raise FileFormatError(path, reason)
    if (counts == 3).all():
        return corners.reshape(-1, 3).astype(np.int32)
    num_triangles = counts - 2
    first = np.repeat(np.cumsum(counts) - counts, num_triangles)
    step = np.arange(num_triangles.sum()) - np.repeat(np.cumsum(num_triangles) - num_triangles, num_triangles)
    triangles = np.column_stack((first, first + step + 1, first + step + 2))
    result: npt.NDArray[np.int32] = corners.astype(np.int32)[triangles]
    return result


def _read_ply(path: str | os.PathLike[str]) -> MeshArrays:
    file = read_ply(path)
    vertices = file.points()
    table = file.tables.get("face", {})
    faces = table.get("vertex_indices", table.get("vertex_index"))
    if not isinstance(faces, Ragged) or faces.values.dtype.kind == "f":
        raise FileFormatError(path, "not a mesh: there is no element face with lists vertex_indices")
    return vertices, _fan(path, faces.values.astype(np.int64), faces.counts.astype(np.int64), len(vertices))


class _Polygons:
    """A mesh as it grows line by line."""

    def __init__(self) -> None:
        self.coordinates = array("d")
        self.corners = array("q")
        self.counts = array("q")

    @property
    def num_vertices(self) -> int:
        return len(self.coordinates) // 3

    def add_vertex(self, words: Sequence[bytes]) -> None:
        """Take in three coordinates; what follows them is left out."""
        x, y, z = words[:3]
        if b"_" in x + y + z:  # Python would read 1_0 as 10
            raise ValueError
        self.coordinates.extend((float(x), float(y), float(z)))

    def add_face(self, corners: Sequence[int]) -> None:
        """Take in the corners of a polygon."""
        self.corners.extend(corners)
        self.counts.append(len(corners))

    def finish(self, path: str | os.PathLike[str]) -> MeshArrays:
        """Return vertices and triangles."""
        corners, counts = (np.frombuffer(values, np.int64) for values in (self.corners, self.counts))
        vertices = np.frombuffer(self.coordinates, np.float64).reshape(-1, 3)
        return vertices, _fan(path, corners, counts, len(vertices))


def _read_obj(path: str | os.PathLike[str]) -> MeshArrays:
    mesh = _Polygons()
    for number, line in _lines(read_file(path)):
        keyword, *words = line.split() or [b""]
        try:
            if keyword == b"v":
                mesh.add_vertex(words)
            elif keyword == b"f":
                mesh.add_face([_obj_corner(word, mesh.num_vertices) for word in words])
            elif not keyword.isascii() or (keyword and not keyword[:1].isalpha()):
                raise ValueError
        except (ValueError, OverflowError):
            raise FileFormatError(path, f"cannot read {excerpt(line.strip())}", line=number) from None
    if not mesh.counts:
        raise FileFormatError(path, "not a mesh: there is no face")
    return mesh.finish(path)


def _lines(data: bytes) -> Iterator[tuple[int, bytes]]:
    """Yield numbered lines without comments; a backslash at its end joins a line with the next."""
    parts: list[bytes] = []
    number = 0
    for number, raw in enumerate(BytesIO(data.removeprefix(b"\xef\xbb\xbf")), 1):
        line = raw.partition(b"#")[0].rstrip()
        parts.append(line.removesuffix(b"\\"))
        if not line.endswith(b"\\"):
            yield number, b" ".join(parts)
            parts.clear()
    yield number, b" ".join(parts)


def _obj_corner(word: bytes, num_vertices: int) -> int:
    """Return the vertex of ``v``, ``v/vt``, ``v//vn`` or ``v/vt/vn``, which count from 1 or back from -1."""
    text = word.partition(b"/")[0]
    index = int(text)
    if b"_" in text or index == 0 or -index > num_vertices:
        raise ValueError
    return index - 1 if index > 0 else num_vertices + index


def _read_off(path: str | os.PathLike[str]) -> MeshArrays:
    data = read_file(path)
    lines = ((number, words) for number, line in _lines(data) if (words := line.split()))
    number, words = next(lines, (1, [b""]))
    if words[0] not in (b"OFF", b"COFF", b"NOFF", b"CNOFF", b"STOFF", b"STNOFF", b"STCOFF", b"STCNOFF"):
        raise FileFormatError(path, f"an OFF file begins with 'OFF', not {excerpt(words[0])}", line=number)
    if len(words) == 1:
        number, words = next(lines, (number, []))
    else:
        words = words[1:]
    mesh = _Polygons()
    try:
        num_vertices, num_faces = (_whole(word) for word in words[:2])
        for _ in range(num_vertices):
            number, words = next(lines)
            mesh.add_vertex(words)
        for _ in range(num_faces):
            number, words = next(lines)
            corners = [_whole(word) for word in words[1 : 1 + _whole(words[0])]]
            if len(corners) != _whole(words[0]):
                raise ValueError
            mesh.add_face(corners)
    except StopIteration:
        found = f"{mesh.num_vertices} of {num_vertices} vertices and {len(mesh.counts)} of {num_faces} faces"
        reason = f"the file ends after {found}"
        raise FileFormatError(path, reason, line=number) from None
    except (ValueError, OverflowError):
        raise FileFormatError(path, f"cannot read {excerpt(b' '.join(words))}", line=number) from None
    rest = next(lines, None)
    if rest is not None:
        reason = f"more lines than the {num_vertices} vertices and {num_faces} faces"
        raise FileFormatError(path, reason, line=rest[0])
    return mesh.finish(path)


def _whole(word: bytes) -> int:
    if not word.isdigit():
        raise ValueError
    return int(word)


def _read_stl(path: str | os.PathLike[str]) -> MeshArrays:
    data = read_file(path)
    num_facets = int.from_bytes(data[80:84], "little")
    expected = _STL_HEADER_BYTES + num_facets * _STL_FACET.itemsize
    if len(data) == expected:
        facets = np.frombuffer(data, _STL_FACET, num_facets, _STL_HEADER_BYTES)
        return _merge(facets["corners"].reshape(-1, 3))
    if data[:5].lower() == b"solid":
        return _merge(_read_stl_text(path, data))
    if len(data) < _STL_HEADER_BYTES:
        raise FileFormatError(path, "neither a binary STL file nor a text that begins with 'solid'", offset=0)
    reason = f"a binary STL file of {num_facets} facets has {expected} bytes, this one {len(data)}"
    raise FileFormatError(path, reason, offset=80)


def _read_stl_text(path: str | os.PathLike[str], data: bytes) -> npt.NDArray[np.float32]:
    facet = (b"facet", b"outer", b"vertex", b"vertex", b"vertex", b"endloop", b"endfacet")
    mesh = _Polygons()
    state, is_open, number = 0, False, 0
    for number, line in enumerate(BytesIO(data), 1):
        keyword, *words = line.lower().split() or [b""]
        try:
            if is_open and keyword == facet[state]:
                if keyword == b"vertex":
                    mesh.add_vertex(words)
                state = (state + 1) % len(facet)
            elif state == 0 and keyword == (b"endsolid" if is_open else b"solid"):
                is_open = not is_open
            elif keyword:
                raise ValueError
        except ValueError:
            raise FileFormatError(path, f"cannot read {excerpt(line.strip())}", line=number) from None
    if is_open:
        raise FileFormatError(path, "the file ends before 'endsolid'", line=number)
    with np.errstate(over="ignore"):
        return np.array(mesh.coordinates).reshape(-1, 3).astype(np.float32)


def _merge(corners: npt.NDArray[np.float32]) -> MeshArrays:
    """Return the triangles whose corners come three by three; equal corners become one vertex."""
    corners = corners + np.float32(0)  # -0 becomes 0
    order = np.lexsort(corners.view(np.uint32).T)
    is_new = np.ones(len(corners), dtype=bool)
    is_new[1:] = (corners.view(np.uint32)[order[1:]] != corners.view(np.uint32)[order[:-1]]).any(axis=1)
    first = order[is_new]  # lexsort is stable, so it is the smallest index of its group
    rank = np.empty(len(first), dtype=np.int32)
    by_position = np.argsort(first)
    rank[by_position] = np.arange(len(first), dtype=np.int32)
    indices = np.empty(len(corners), dtype=np.int32)
    indices[order] = rank[np.cumsum(is_new) - 1]
    return corners[first[by_position]], indices.reshape(-1, 3)
