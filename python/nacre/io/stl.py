"""STL files, binary and text: triangle meshes in and out."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Iterator, Sequence
from io import BytesIO

import numpy as np
import numpy.typing as npt

from nacre.errors import FileFormatError
from nacre.io.cloud import check_comments
from nacre.io.mesh_arrays import MeshArrays, Polygons
from nacre.io.raw import decode, excerpt, file_writer, read_file
from nacre.io.rows import encode_lines, encode_rows

_FACET = np.dtype([("normal", "<f4", (3,)), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_TEXT_BYTES, _HEADER_BYTES = 80, 84
_TITLE = b"binary STL"
_FACETS_AT_ONCE = 1 << 16
_TEXT_FACET = """facet normal {} {} {}
  outer loop
    vertex {} {} {}
    vertex {} {} {}
    vertex {} {} {}
  endloop
endfacet
"""


def read_mesh(path: str | os.PathLike[str]) -> MeshArrays:
    """
    Read an STL file; equal corners become one vertex, normals and colours are left out.

    Comments are those that nacre writes in the 80 bytes with which binary files begin.
    """
    data = read_file(path)
    num_facets = int.from_bytes(data[80:84], "little")
    expected = _HEADER_BYTES + num_facets * _FACET.itemsize
    if len(data) == expected:
        facets = np.frombuffer(data, _FACET, num_facets, _HEADER_BYTES)
        mesh = _merge(facets["corners"].reshape(-1, 3))
        return dataclasses.replace(mesh, comments=_comments(data[:_TEXT_BYTES]))
    if data[:5].lower() == b"solid":
        return _merge(_read_text(path, data))
    if len(data) < _HEADER_BYTES:
        raise FileFormatError(path, "neither a binary STL file nor a text that begins with 'solid'", offset=0)
    reason = f"a binary STL file of {num_facets} facets has {expected} bytes, this one {len(data)}"
    raise FileFormatError(path, reason, offset=80)


def _comments(text: bytes) -> tuple[str, ...]:
    title, *lines = text.rstrip(b" ").split(b"\n")
    return tuple(map(decode, lines)) if title == _TITLE else ()


def _read_text(path: str | os.PathLike[str], data: bytes) -> npt.NDArray[np.float32]:
    facet = (b"facet", b"outer", b"vertex", b"vertex", b"vertex", b"endloop", b"endfacet")
    mesh = Polygons()
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


def write_mesh(
    path: str | os.PathLike[str], mesh: MeshArrays, *, comments: Sequence[str] = (), binary: bool = True
) -> None:
    """Write an STL file, of which each facet has its own normal; :func:`nacre.write_mesh` says the rest."""
    text = _TITLE
    for line in check_comments(comments):
        longer = text + b"\n" + line.encode()
        text = longer if len(longer) <= _TEXT_BYTES else text
    with file_writer(path) as stream:
        if binary:
            stream.write(text.ljust(_TEXT_BYTES) + np.uint32(len(mesh.triangles)).astype("<u4").tobytes())
            for facets in _facets(mesh):
                attribute = np.zeros(len(facets[0]), np.uint16)
                stream.writelines(encode_rows([*facets, attribute], binary=True))
        else:
            stream.write(b"solid nacre\n")
            for facets in _facets(mesh):
                stream.writelines(encode_lines(_TEXT_FACET, facets))
            stream.write(b"endsolid nacre\n")


def _facets(mesh: MeshArrays) -> Iterator[list[npt.NDArray[np.float32]]]:
    """Yield the normals (N, 3) and the corners (N, 9) of some triangles after the other."""
    for start in range(0, len(mesh.triangles), _FACETS_AT_ONCE):
        corners = mesh.vertices[mesh.triangles[start : start + _FACETS_AT_ONCE]]
        with np.errstate(over="ignore", invalid="ignore"):
            stored = corners.astype(np.float32)
        if not np.isfinite(stored).all():
            raise ValueError("vertices must be finite, and fit float32 in an STL file, got some that do not")
        yield [_facet_normals(corners), stored.reshape(-1, 9)]


def _facet_normals(corners: npt.NDArray[np.floating]) -> npt.NDArray[np.float32]:
    """Return unit vectors by the right-hand rule; 0 where a triangle has no area."""
    a, b, c = (corners[:, i].astype(np.float64) for i in range(3))
    normals = np.cross(b - a, c - a)
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    unit = np.divide(normals, lengths, out=np.zeros_like(normals), where=lengths > 0)
    return np.asarray(unit, np.float32)


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
    return MeshArrays(corners[first[by_position]], indices.reshape(-1, 3))
