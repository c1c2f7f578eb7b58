"""OFF files: triangle meshes in."""

from __future__ import annotations

import os

from nacre.errors import FileFormatError
from nacre.io.mesh_arrays import MeshArrays, Polygons
from nacre.io.raw import code_lines, excerpt, read_file


def read_mesh(path: str | os.PathLike[str]) -> MeshArrays:
    """Read an OFF file; colours and normals are left out."""
    data = read_file(path)
    lines = ((number, words) for number, line in code_lines(data) if (words := line.split()))
    number, words = next(lines, (1, [b""]))
    if words[0] not in (b"OFF", b"COFF", b"NOFF", b"CNOFF", b"STOFF", b"STNOFF", b"STCOFF", b"STCNOFF"):
        raise FileFormatError(path, f"an OFF file begins with 'OFF', not {excerpt(words[0])}", line=number)
    if len(words) == 1:
        number, words = next(lines, (number, []))
    else:
        words = words[1:]
    mesh = Polygons()
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
