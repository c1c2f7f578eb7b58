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
from nacre.io.images import encode_jpeg
from nacre.io.mesh_arrays import MeshArrays, split
from nacre.io.raw import file_writer
from nacre.io.srgb import linear_from_srgb

MAGIC, VERSION = b"glTF", 2
JSON_CHUNK, BINARY_CHUNK = b"JSON", b"BIN\0"
FLOAT, UNSIGNED_INT = 5126, 5125
CLAMP_TO_EDGE = 33071
TRIANGLES = 4
VERTEX_BUFFER, _INDEX_BUFFER = 34962, 34963
# Both sides are seen, and light is scattered as by paper: a surface that is open, of unknown gloss.
_MATERIAL: dict[str, Any] = {
    "doubleSided": True,
    "pbrMetallicRoughness": {"metallicFactor": 0.0, "roughnessFactor": 1.0},
}


def write_mesh(
    path: str | os.PathLike[str], mesh: MeshArrays, *, comments: Sequence[str] = (), binary: bool = True
) -> None:
    """
    Write a GLB file, which is binary; :func:`nacre.write_mesh` has the parameters.

    Coordinates are float32 about a place that the node's ``translation`` gives in float64.
    """
    document, buffer = document_of(mesh, comments)
    if mesh.texture is not None:
        _add_image(document, buffer, encode_jpeg(mesh.texture.image))
    store(path, document, buffer)


def document_of(mesh: MeshArrays, comments: Sequence[str] = ()) -> tuple[dict[str, Any], Buffer]:
    """Return what a file says of a mesh, but for the image that is painted on it, and its binary chunk."""
    mesh, uv = _split(mesh)
    vertices, origin = localize(mesh.vertices)
    if not np.isfinite(vertices).all():
        raise ValueError("vertices must be finite, and fit float32 in a GLB file, got some that do not")
    buffer = Buffer()
    bounds = {"min": vertices.min(axis=0).tolist(), "max": vertices.max(axis=0).tolist()}
    attributes = {"POSITION": buffer.add(vertices, "VEC3", VERTEX_BUFFER, **bounds)}
    if mesh.normals is not None:
        attributes["NORMAL"] = buffer.add(unit(mesh.normals), "VEC3", VERTEX_BUFFER)
    if uv is not None:
        attributes["TEXCOORD_0"] = buffer.add(uv, "VEC2", VERTEX_BUFFER)
    elif mesh.colors is not None:
        attributes["COLOR_0"] = buffer.add(linear_from_srgb(mesh.colors), "VEC3", VERTEX_BUFFER)
    corners = mesh.triangles.reshape(-1).astype(np.uint32)
    indices = buffer.add(corners, "SCALAR", _INDEX_BUFFER)
    primitive = {"attributes": attributes, "indices": indices, "material": 0, "mode": TRIANGLES}
    asset: dict[str, Any] = {"version": "2.0", "generator": "nacre"}
    if comments:
        asset["extras"] = {"comments": check_comments(comments)}
    return {
        "asset": asset,
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "translation": origin.tolist()}],
        "meshes": [{"primitives": [primitive]}],
        "materials": [_MATERIAL],
        "accessors": buffer.accessors,
        "bufferViews": buffer.views,
    }, buffer


def store(path: str | os.PathLike[str], document: dict[str, Any], buffer: Buffer) -> None:
    """Write a file of two chunks: what it says, and its arrays."""
    document["buffers"] = [{"byteLength": buffer.size}]
    text = json.dumps(document, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    if buffer.size + len(text) > (1 << 32) - 100:
        raise ValueError(f"vertices and triangles must fit the 4 GiB of a GLB file, got {buffer.size} bytes")
    with file_writer(path) as stream:
        stream.write(MAGIC + struct.pack("<II", VERSION, 12 + 8 + len(text) + 8 + buffer.size))
        stream.write(struct.pack("<I", len(text)) + JSON_CHUNK + text)
        stream.write(struct.pack("<I", buffer.size) + BINARY_CHUNK)
        stream.writelines(buffer.parts)


def _split(mesh: MeshArrays) -> tuple[MeshArrays, npt.NDArray[np.float32] | None]:
    """Return a mesh whose vertices have one place on the texture each, and those places."""
    texture = mesh.texture
    if texture is None:
        return mesh, None
    mesh, places = split(mesh, texture.triangles)
    return mesh, texture.uv[places]


def _add_image(document: dict[str, Any], buffer: Buffer, data: bytes) -> None:
    """Paint the mesh with a JPEG image."""
    material: dict[str, Any] = document["materials"][0]
    document["images"] = [{"bufferView": buffer.add_bytes(data), "mimeType": "image/jpeg"}]
    document["samplers"] = [{"wrapS": CLAMP_TO_EDGE, "wrapT": CLAMP_TO_EDGE}]
    document["textures"] = [{"source": 0, "sampler": 0}]
    reflectance = material["pbrMetallicRoughness"] | {"baseColorTexture": {"index": 0}}
    document["materials"] = [material | {"pbrMetallicRoughness": reflectance}]


class Buffer:
    """The binary chunk as it grows, and what says where each array is."""

    def __init__(self) -> None:
        self.parts: list[memoryview] = []
        self.size = 0
        self.views: list[dict[str, Any]] = []
        self.accessors: list[dict[str, Any]] = []

    def add(self, array: npt.NDArray[Any], kind: str, target: int | None = None, **bounds: Any) -> int:
        """Take in an array of float32 or uint32, all of 4 bytes, and return its accessor."""
        component = FLOAT if array.dtype.kind == "f" else UNSIGNED_INT
        stored = np.ascontiguousarray(array, array.dtype.newbyteorder("<"))
        of_vertices = {} if target is None else {"target": target}
        view = self._add_view(stored.reshape(-1).view(np.uint8).data, **of_vertices)
        accessor = {"bufferView": view, "componentType": component, "count": len(array)}
        self.accessors.append({**accessor, "type": kind, **bounds})
        return len(self.accessors) - 1

    def add_bytes(self, data: bytes) -> int:
        """Take in a file, filled up to 4 bytes, and return its view."""
        view = self._add_view(memoryview(data))
        filling = bytes(-len(data) % 4)
        self.parts.append(memoryview(filling))
        self.size += len(filling)
        return view

    def _add_view(self, part: memoryview, **more: int) -> int:
        self.views.append({"buffer": 0, "byteOffset": self.size, "byteLength": part.nbytes, **more})
        self.parts.append(part)
        self.size += part.nbytes
        return len(self.views) - 1


def unit(normals: npt.NDArray[Any]) -> npt.NDArray[np.float32]:
    """Return vectors of unit length, as glTF has them; what has no direction becomes the z axis."""
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        directions = normals / np.linalg.norm(normals.astype(np.float64), axis=1, keepdims=True)
    directions[~np.isfinite(directions).all(axis=1)] = (0.0, 0.0, 1.0)
    return np.asarray(directions, np.float32)
