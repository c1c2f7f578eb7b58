"""PLY files: points, meshes and Stanford range scans (ascii, binary little and big endian)."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre._internal import arrays
from nacre._internal.warned import warn
from nacre.errors import FileFormatError
from nacre.io.cloud import (
    Cloud,
    Columns,
    check_comments,
    gather_columns,
    gather_floats,
    native,
    with_attributes,
)
from nacre.io.mesh_arrays import MeshArrays, fan
from nacre.io.ply_header import BYTE_ORDERS, TYPES, Header, read_header
from nacre.io.ply_tables import Ragged, Table, check_table_size, read_binary_table, read_text_table
from nacre.io.raw import TextTable, check_padding, file_writer, read_file, read_head, read_records
from nacre.io.rows import encode_rows


@dataclass(frozen=True)
class PlyFile:
    """A PLY file: its header and, for each element, the columns of its table."""

    path: Path
    header: Header
    tables: dict[str, Table]

    def points(self) -> arrays.FloatArray:
        """Return the coordinates of the vertices."""
        return gather_floats(scalar_columns(self.tables["vertex"]), ("x", "y", "z"))


def scalar_columns(table: Table) -> Columns:
    """Return the columns that hold single values."""
    return {name: column for name, column in table.items() if not isinstance(column, Ragged)}


def read_ply(path: str | os.PathLike[str]) -> PlyFile:
    """
    Read every element of a PLY file that has vertices.

    Lines of the header that are none of the format's are passed over, with a warning in the log.

    Raises
    ------
    FileFormatError
        When the file is broken in any way: it is read whole or not at all.
    OSError
        When it cannot be read.
    """
    data = read_file(path)
    header = read_header(path, data)
    _check_vertices(path, header)
    if header.newline == b"\r" and header.format == "ascii":
        data = data.replace(b"\r", b"\n")
    text = TextTable(path, data, header.size)
    position = header.size
    tables: dict[str, Table] = {}
    for element in header.elements:
        if header.format == "ascii":
            tables[element.name], position = read_text_table(text, element), text.offset
        else:
            order = BYTE_ORDERS[header.format]
            tables[element.name], position = read_binary_table(path, data, position, element, order)
    check_padding(path, data, position)
    if header.stray_lines:
        where = ", ".join(map(str, header.stray_lines[:5])) + ", ..." * (len(header.stray_lines) > 5)
        warn(f"{os.fspath(path)}: passed over lines of the header that are none of PLY's: {where}")
    return PlyFile(Path(path), header, tables)


def _check_vertices(path: str | os.PathLike[str], header: Header) -> None:
    vertex = next((element for element in header.elements if element.name == "vertex"), None)
    if vertex is None:
        raise FileFormatError(path, "there is no element vertex", offset=header.size)
    names = {entry.name for entry in vertex.properties if entry.count_dtype is None}
    if not names.issuperset("xyz"):
        missing = ", ".join(name for name in "xyz" if name not in names)
        raise FileFormatError(path, f"element vertex has no single value {missing}", line=vertex.line)


def count_points(path: str | os.PathLike[str]) -> int:
    """Return how many vertices the header promises."""
    header = read_header(path, read_head(path, b"end_header"))
    _check_vertices(path, header)
    return next(element.num_rows for element in header.elements if element.name == "vertex")


def read_cloud(path: str | os.PathLike[str]) -> Cloud:
    """Read the vertices of a PLY file; :func:`nacre.read_points` says what is returned and raised."""
    return _vertices(read_ply(path))


def read_chunks(path: str | os.PathLike[str], num_rows: int) -> Iterator[Cloud] | None:
    """Return a binary PLY file in pieces of so many vertices; None where their size in bytes is not known."""
    header = read_header(path, read_head(path, b"end_header"))
    _check_vertices(path, header)
    if header.format not in BYTE_ORDERS:
        return None
    offset = header.size
    for element in header.elements:
        if any(entry.count_dtype is not None for entry in element.properties):
            return None
        order = BYTE_ORDERS[header.format]
        dtype = np.dtype([(entry.name, entry.dtype.newbyteorder(order)) for entry in element.properties])
        if element.name == "vertex":
            break
        offset += element.num_rows * dtype.itemsize
    check_table_size(path, element, dtype.itemsize * element.num_rows, Path(path).stat().st_size - offset)
    is_last = element is header.elements[-1]
    tables = read_records(path, offset, dtype, element.num_rows, num_rows, are_last=is_last)
    names = [entry.name for entry in element.properties]
    return (
        _vertices(PlyFile(Path(path), header, {"vertex": {name: rows[name] for name in names}}))
        for rows in tables
    )


def read_mesh(path: str | os.PathLike[str]) -> MeshArrays:
    """Read vertices and faces of a PLY file; :func:`nacre.read_mesh` says what is raised."""
    file = read_ply(path)
    cloud = _vertices(file)
    table = file.tables.get("face", {})
    faces = table.get("vertex_indices", table.get("vertex_index"))
    if not isinstance(faces, Ragged) or faces.values.dtype.kind == "f":
        reason = "not a mesh: there is no element face with lists vertex_indices"
        raise FileFormatError(path, f"{reason}; nacre.read_points(path) reads points")
    triangles = fan(path, faces.values.astype(np.int64), faces.counts.astype(np.int64), len(cloud))
    attributes = {name: values for name, values in cloud.attributes.items() if values.dtype.kind in "buif"}
    return MeshArrays(
        cloud.points, triangles, cloud.normals, cloud.colors, attributes, comments=cloud.comments
    )


def _vertices(file: PlyFile) -> Cloud:
    points = file.points()
    table = file.tables["vertex"]
    columns = scalar_columns(table)
    used = {"x", "y", "z"}
    normals, colors = None, None
    for names in (("nx", "ny", "nz"), ("normal_x", "normal_y", "normal_z")):
        if normals is None and all(name in columns and columns[name].dtype.kind == "f" for name in names):
            normals = gather_floats(columns, names)
            used.update(names)
    names = ("red", "green", "blue")
    if all(name in columns and columns[name].dtype == np.uint8 for name in names):
        colors = gather_columns(columns, names)
        used.update(names)
    attributes = {
        name: column.as_array() if isinstance(column, Ragged) else native(column)
        for name, column in table.items()
        if name not in used
    }
    comments = file.header.comments + file.header.obj_info
    return Cloud(points, normals, colors, attributes, comments, path=file.path)


def read_range_grid(path: str | os.PathLike[str]) -> arrays.FloatArray:
    """
    Read a range scan of the Stanford 3D Scanning Repository as an organised cloud.

    Its element ``range_grid`` has one list for each pixel, row after row: empty, or the index of the pixel's
    vertex; ``obj_info`` lines give ``num_cols`` and ``num_rows``.

    Parameters
    ----------
    path : path-like
        The PLY file.

    Returns
    -------
    (H, W, 3) float32 or float64
        The points in the file's own order of rows (Stanford's scans begin at the bottom); NaN where nothing
        was measured.

    Raises
    ------
    FileFormatError
        When the file is broken or is not a range scan.
    OSError
        When it cannot be read.
    """
    file = read_ply(path)
    points = file.points()
    grid = file.tables.get("range_grid", {}).get("vertex_indices")
    if not isinstance(grid, Ragged) or grid.values.dtype.kind == "f":
        raise FileFormatError(path, "not a range scan: no element range_grid with lists vertex_indices")
    sizes = [_read_info(file, name) for name in ("num_rows", "num_cols")]
    if sizes[0] * sizes[1] != len(grid.counts):
        raise FileFormatError(
            path,
            f"num_rows {sizes[0]} times num_cols {sizes[1]} is not {len(grid.counts)}, as range_grid has",
        )
    if grid.counts.max(initial=0) > 1:
        raise FileFormatError(path, "range_grid has a pixel with more than one vertex")
    if len(grid.values) and (grid.values.min() < 0 or grid.values.max() >= len(points)):
        raise FileFormatError(path, f"range_grid names a vertex outside 0 to {len(points) - 1}")
    image = np.full((len(grid.counts), 3), np.nan, dtype=points.dtype)
    image[grid.counts == 1] = points[grid.values]
    return image.reshape(*sizes, 3)


def _read_info(file: PlyFile, name: str) -> int:
    for line in file.header.obj_info:
        words = line.split()
        if len(words) == 2 and words[0] == name and words[1].isdecimal() and len(words[1]) < 10:
            return int(words[1])
    raise FileFormatError(file.path, f"not a range scan: no line 'obj_info {name}' with a number")


def write_cloud(
    path: str | os.PathLike[str], cloud: Cloud, *, comments: Sequence[str] = (), binary: bool = True
) -> None:
    """Write points as a PLY file; :func:`nacre.write_points` has the parameters."""
    write_ply(path, {"vertex": _vertex_columns(cloud)}, comments=comments, binary=binary)


def write_mesh(
    path: str | os.PathLike[str], mesh: MeshArrays, *, comments: Sequence[str] = (), binary: bool = True
) -> None:
    """Write vertices and faces as a PLY file; :func:`nacre.write_mesh` has the parameters."""
    columns = _vertex_columns(Cloud(mesh.vertices, mesh.normals, mesh.colors, mesh.attributes))
    tables: dict[str, Columns] = {"vertex": columns, "face": {"vertex_indices": mesh.triangles}}
    write_ply(path, tables, comments=comments, binary=binary)


def _vertex_columns(cloud: Cloud) -> Columns:
    """Return what is written of each point."""
    columns: Columns = {name: cloud.points[:, i] for i, name in enumerate(("x", "y", "z"))}
    if cloud.normals is not None:
        columns.update({name: cloud.normals[:, i] for i, name in enumerate(("nx", "ny", "nz"))})
    if cloud.colors is not None:
        columns.update({name: cloud.colors[:, i] for i, name in enumerate(("red", "green", "blue"))})
    storable = {name: _storable(name, array) for name, array in cloud.attributes.items()}
    return with_attributes(columns, storable)


def _storable(name: str, array: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Return the array in a type that PLY has: 64-bit integers become 32-bit ones when they fit."""
    if array.dtype.kind not in "iu" or array.dtype.itemsize < 8:
        return array
    for dtype in (np.int32, np.uint32):
        limits = np.iinfo(dtype)
        if array.size == 0 or (array.min() >= limits.min and array.max() <= limits.max):
            return array.astype(dtype)
    raise ValueError(f"attributes[{name!r}] must fit 32-bit integers: PLY has no larger ones, PCD has")


def write_ply(
    path: str | os.PathLike[str],
    tables: Mapping[str, Columns],
    *,
    comments: Sequence[str] = (),
    binary: bool = True,
) -> None:
    """
    Write elements as a PLY file, whole or not at all.

    Parameters
    ----------
    path : path-like
        The file.
    tables : mapping of str to dict of str to array
        For each element its columns: (N,) arrays are single values, (N, K) arrays are lists of K values.
    comments : sequence of str
        Comments of the header.
    binary : bool
        binary_little_endian, else ascii.
    """
    sizes = {name: len(next(iter(columns.values()))) for name, columns in tables.items()}
    with file_writer(path) as stream:
        stream.write(_header(tables, sizes, comments, binary))
        for columns in tables.values():
            stream.writelines(encode_rows(_with_counts(columns), binary=binary))


def write_chunks(path: str | os.PathLike[str], chunks: Iterable[Cloud], num_points: int) -> None:
    """Write pieces of a cloud, all with the same fields and of ``num_points`` in all, as one PLY file."""
    with file_writer(path) as stream:
        for number, cloud in enumerate(chunks):
            columns = _vertex_columns(cloud)
            if number == 0:
                stream.write(_header({"vertex": columns}, {"vertex": num_points}, cloud.comments, True))
            stream.writelines(encode_rows(_with_counts(columns), binary=True))


def _header(
    tables: Mapping[str, Columns], sizes: Mapping[str, int], comments: Sequence[str], binary: bool
) -> bytes:
    lines = ["ply", f"format {'binary_little_endian' if binary else 'ascii'} 1.0"]
    lines += [f"comment {comment}".rstrip() for comment in check_comments(comments)]
    for name, columns in tables.items():
        lines.append(f"element {name} {sizes[name]}")
        for column_name, column in columns.items():
            list_part = f"list {_type_name(_count_dtype(column))} " if column.ndim == 2 else ""
            lines.append(f"property {list_part}{_type_name(column.dtype)} {column_name}")
    return "\n".join([*lines, "end_header\n"]).encode()


def _type_name(dtype: np.dtype[Any]) -> str:
    return next(name for name, known in TYPES.items() if known == dtype)


def _count_dtype(column: npt.NDArray[Any]) -> np.dtype[Any]:
    return np.dtype(np.uint8 if column.shape[1] < 256 else np.uint32)


def _with_counts(columns: Columns) -> Iterator[npt.NDArray[Any]]:
    """Yield the columns with the length of each list before it."""
    for column in columns.values():
        if column.ndim == 2:
            yield np.broadcast_to(np.array(column.shape[1], dtype=_count_dtype(column)), len(column))
        yield column
