"""GLB files, the binary form of glTF 2.0: triangle meshes out."""

from __future__ import annotations

import json
import os
import struct
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre._internal.arrays import localize
from nacre.io.cloud import check_comments
from nacre.io.mesh_arrays import MeshArrays
from nacre.io.raw import file_writer
from nacre.io.srgb import linear_from_srgb

MAGIC, VERSION = b"glTF", 2
JSON_CHUNK, BINARY_CHUNK = b"JSON", b"BIN\0"
FLOAT, UNSIGNED_INT = 5126, 5125
TRIANGLES = 4
_VERTEX_BUFFER, _INDEX_BUFFER = 34962, 34963
# Both sides are seen, and light is scattered as by paper: a surface that is open, of unknown gloss.
_MATERIAL = {"doubleSided": True, "pbrMetallicRoughness": {"metallicFactor": 0.0, "roughnessFactor": 1.0}}


def write_mesh(
    path: str | os.PathLike[str], mesh: MeshArrays, *, comments: Sequence[str] = (), binary: bool = True
) -> None:
    """
    Write a GLB file, which is binary; :func:`nacre.write_mesh` has the parameters.

    Coordinates are float32 about a place that the node's ``translation`` gives in float64.
    """
    vertices, origin = localize(mesh.vertices)
    if not np.isfinite(vertices).all():
        raise ValueError("vertices must be finite, and fit float32 in a GLB file, got some that do not")
    buffer = _Buffer()
    bounds = {"min": vertices.min(axis=0).tolist(), "max": vertices.max(axis=0).tolist()}
    attributes = {"POSITION": buffer.add(vertices, "VEC3", _VERTEX_BUFFER, **bounds)}
    if mesh.normals is not None:
        attributes["NORMAL"] = buffer.add(_unit(mesh.normals), "VEC3", _VERTEX_BUFFER)
    if mesh.colors is not None:
        attributes["COLOR_0"] = buffer.add(linear_from_srgb(mesh.colors), "VEC3", _VERTEX_BUFFER)
    corners = mesh.triangles.reshape(-1).astype(np.uint32)
    indices = buffer.add(corners, "SCALAR", _INDEX_BUFFER)
    primitive = {"attributes": attributes, "indices": indices, "material": 0, "mode": TRIANGLES}
    asset: dict[str, Any] = {"version": "2.0", "generator": "nacre"}
    if comments:
        asset["extras"] = {"comments": check_comments(comments)}
    document = {
        "asset": asset,
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "translation": origin.tolist()}],
        "meshes": [{"primitives": [primitive]}],
        "materials": [_MATERIAL],
        "accessors": buffer.accessors,
        "bufferViews": buffer.views,
        "buffers": [{"byteLength": buffer.size}],
    }
    text = json.dumps(document, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    if buffer.size + len(text) > (1 << 32) - 100:
        raise ValueError(f"vertices and triangles must fit the 4 GiB of a GLB file, got {buffer.size} bytes")
    with file_writer(path) as stream:
        stream.write(MAGIC + struct.pack("<II", VERSION, 12 + 8 + len(text) + 8 + buffer.size))
        stream.write(struct.pack("<I", len(text)) + JSON_CHUNK + text)
        stream.write(struct.pack("<I", buffer.size) + BINARY_CHUNK)
        stream.writelines(buffer.parts)


class _Buffer:
    """The binary chunk as it grows, and what says where each array is."""

    def __init__(self) -> None:
        self.parts: list[memoryview] = []
        self.size = 0
        self.views: list[dict[str, Any]] = []
        self.accessors: list[dict[str, Any]] = []

    def add(self, array: npt.NDArray[Any], kind: str, target: int, **bounds: Any) -> int:
        """Take in an array of float32 or uint32, all of 4 bytes, and return its accessor."""
        component = FLOAT if array.dtype.kind == "f" else UNSIGNED_INT
        view = {"buffer": 0, "byteOffset": self.size, "byteLength": array.nbytes, "target": target}
        accessor = {"bufferView": len(self.views), "componentType": component, "count": len(array)}
        self.views.append(view)
        self.accessors.append({**accessor, "type": kind, **bounds})
        stored = np.ascontiguousarray(array, array.dtype.newbyteorder("<"))
        self.parts.append(stored.reshape(-1).view(np.uint8).data)
        self.size += array.nbytes
        return len(self.accessors) - 1


def _unit(normals: npt.NDArray[Any]) -> npt.NDArray[np.float32]:
    """Return vectors of unit length, as glTF has them; what has no direction becomes the z axis."""
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        unit = normals / np.linalg.norm(normals.astype(np.float64), axis=1, keepdims=True)
    unit[~np.isfinite(unit).all(axis=1)] = (0.0, 0.0, 1.0)
    return np.asarray(unit, np.float32)
