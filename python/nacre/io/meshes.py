"""Triangle meshes, whichever their format."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy.typing as npt

from nacre._internal import arrays
from nacre._internal.arrays import as_flag
from nacre._internal.guided import guided
from nacre._internal.warned import warn_of_loss
from nacre.errors import FileFormatError
from nacre.io import glb, glb_reader, obj, off, ply, stl
from nacre.io.cloud import check_cloud
from nacre.io.mesh_arrays import MeshArrays
from nacre.io.raw import require_path
from nacre.texture import Texture, check_texture

if TYPE_CHECKING:
    from nacre.mesh import Mesh

_READERS = {".ply": ply, ".glb": glb_reader, ".obj": obj, ".off": off, ".stl": stl}
_WRITERS = {".ply": ply, ".glb": glb, ".obj": obj, ".stl": stl}

READ_SUFFIXES = tuple(_READERS)
WRITE_SUFFIXES = tuple(_WRITERS)
TEXTURE_SUFFIXES = (".glb", ".obj")

_CALLS = "write_mesh(path, mesh) and read_mesh(path)"


@guided()
def read_mesh(path: str | os.PathLike[str]) -> Mesh:
    """
    Read a triangle mesh.

    Parameters
    ----------
    path : path-like
        A ``.ply``, ``.glb``, ``.obj``, ``.off`` or ``.stl`` file. Polygons become fans of triangles, the
        equal corners of an STL file one vertex, the meshes of a GLB file's scene one mesh. Textures are left
        out.

    Returns
    -------
    Mesh
        With the normals and colours that PLY, GLB and OBJ files have of their vertices; of OBJ files normals
        where a vertex has the same one in all its faces.

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

    stored = read_mesh_arrays(path)
    try:
        return Mesh(stored.vertices, stored.triangles, normals=stored.normals, colors=stored.colors)
    except ValueError as error:
        raise FileFormatError(path, str(error)) from error


def read_mesh_arrays(path: str | os.PathLike[str]) -> MeshArrays:
    """Read a triangle mesh as it is stored; :func:`read_mesh` has the formats and the errors."""
    require_path(path, _CALLS)
    suffix = Path(path).suffix.lower()
    if suffix not in _READERS:
        raise ValueError(f"mesh files end in {', '.join(_READERS)}, got {os.fspath(path)!r}")
    mesh: MeshArrays = _READERS[suffix].read_mesh(path)
    return mesh


@guided("a Mesh, or vertices and triangles", faces="triangles", mesh="vertices")
def write_mesh(
    path: str | os.PathLike[str],
    vertices: npt.ArrayLike | Mesh,
    triangles: npt.ArrayLike | None = None,
    *,
    normals: npt.ArrayLike | None = None,
    colors: npt.ArrayLike | None = None,
    attributes: Mapping[str, npt.ArrayLike] | None = None,
    texture: Texture | None = None,
    comments: Sequence[str] = (),
    binary: bool = True,
) -> None:
    """
    Write a triangle mesh, whole or not at all.

    What the format has no place for is left out, with a warning; normals without one: STL has its triangles'.

    Parameters
    ----------
    path : path-like
        - ``.ply``: everything, exactly.
        - ``.glb`` (glTF 2.0): everything; coordinates are float32 about an origin that is a float64, colours
          are turned into linear light, as the format has them. Axes stay as they are: viewers show y upwards.
        - ``.obj``: everything; colours as three numbers from 0 to 1 after the coordinates.
        - ``.stl``: triangles alone, as float32; each has the normal that its corners give.
    vertices : Mesh, or (N, 3) array
        PLY stores float32 as float, everything else as double. The normals and colours of a Mesh are written
        with it, where no others are given.
    triangles : (M, 3) array of integers
        Indices of the corners, counted from 0; not with a Mesh, which has its own.
    normals : (N, 3) array, optional
        Of the vertices; stored by the same rule. Of any length, but in GLB files of unit length.
    colors : (N, 3) array of integers from 0 to 255, or of floats from 0 to 1, optional
        Red, green, blue of the vertices.
    attributes : mapping of str to (N,) or (N, K) array, optional
        More of the vertices; PLY alone has a place for them.
    texture : nacre.meshing.Texture, optional
        What is painted on the triangles, in place of ``colors``: in a GLB file, or beside an OBJ file as
        ``NAME.mtl`` and ``NAME_texture.jpg``. As a JPEG image, which needs pillow.
    comments : sequence of str
        Lines for the header; of a binary STL file those that fit its 69 bytes, of a text none.
    binary : bool
        Binary little-endian; else text. Of PLY and STL: GLB is always binary, OBJ always text.

    Raises
    ------
    TypeError, ValueError
        When an argument does not fit; the message names it.
    ImportError
        When a texture is to be written and pillow is missing.
    OSError
        When the file cannot be written; it has the path.
    """
    from nacre.mesh import Mesh

    binary = as_flag("binary", binary)
    require_mesh_suffix(path, textured=texture is not None)
    if isinstance(vertices, Mesh):
        if triangles is not None:
            raise ValueError("triangles must not be given with a Mesh, which has its own")
        normals = vertices.normals if normals is None else normals
        colors = vertices.colors if colors is None else colors
        triangles, vertices = vertices.triangles, vertices.vertices
    if triangles is None:
        raise TypeError(f"triangles must be an array of indices, got None: {_way_to_triangles(vertices)}")
    points = arrays.as_points("vertices", vertices)
    corners = arrays.as_triangles("triangles", triangles, len(points))
    checked = check_cloud(points, normals, colors, attributes)
    painted = None if texture is None else check_texture(texture, len(corners))
    mesh = MeshArrays(checked.points, corners, checked.normals, checked.colors, checked.attributes, painted)
    warn_of_loss(path, [name for name in lost_in(path, mesh) if name != "normals"])
    _WRITERS[Path(path).suffix.lower()].write_mesh(path, mesh, comments=comments, binary=binary)


def _way_to_triangles(value: object) -> str:
    """Say how to write as a mesh what was given without triangles."""
    if hasattr(value, "to_mesh"):
        return "give model.to_mesh()"
    if hasattr(value, "model"):
        return "give its .model.to_mesh()"
    for name in ("faces", "triangles"):
        if hasattr(value, "vertices") and hasattr(value, name):
            return f"give its .vertices and its .{name}"
    return "nacre.meshing.mesh_points(cloud.points, cloud.normals) makes a mesh of points"


def lost_in(path: str | os.PathLike[str], mesh: MeshArrays) -> list[str]:
    """Return what a mesh has that files which end so have no place for."""
    suffix = Path(path).suffix.lower()
    lost = [] if suffix == ".ply" else list(mesh.attributes)
    if suffix == ".stl":
        lost += [name for name in ("normals", "colors") if getattr(mesh, name) is not None]
    return lost


def require_mesh_suffix(path: str | os.PathLike[str], *, textured: bool = False) -> None:
    """Raise where no mesh, or none with a texture, is written to files that end so."""
    require_path(path, _CALLS)
    suffixes, what = (TEXTURE_SUFFIXES, "textured meshes") if textured else (WRITE_SUFFIXES, "meshes")
    if Path(path).suffix.lower() not in suffixes:
        raise ValueError(f"{what} are written to {', '.join(suffixes)}, got {os.fspath(path)!r}")
