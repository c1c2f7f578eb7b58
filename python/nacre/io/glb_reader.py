"""GLB files, the binary form of glTF 2.0: triangle meshes in."""

from __future__ import annotations

import dataclasses
import os
import struct
from collections.abc import Iterator
from itertools import islice
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.errors import FileFormatError, printable, shown
from nacre.io.glb import BINARY_CHUNK, JSON_CHUNK, MAGIC, VERSION
from nacre.io.json_files import parse_json
from nacre.io.mesh_arrays import MeshArrays
from nacre.io.painting import Painting, is_known_image
from nacre.io.raw import MAX_COMMENTS, read_file
from nacre.io.srgb import srgb_from_linear

Array = npt.NDArray[Any]
Float32 = npt.NDArray[np.float32]
Float64 = npt.NDArray[np.float64]

_TYPES = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
_TRIANGLES, _STRIP, _FAN = 4, 5, 6
_KNOWN_EXTENSIONS = {"KHR_mesh_quantization", "KHR_materials_unlit", "KHR_texture_transform"}
_MOST_PIECES = 100_000


def read_mesh(path: str | os.PathLike[str]) -> MeshArrays:
    """
    Read all meshes of a GLB file's scene, each in its place.

    Normals and colours are taken where all of them have some; textures and animations are left out.
    """
    file, pieces = _read_pieces(path)
    comments = _comments(file.document)
    return dataclasses.replace(_joined([mesh for _, mesh in pieces]), comments=comments)


def read_painting(path: str | os.PathLike[str]) -> Painting | None:
    """Read the image that is painted on all meshes of a GLB file's scene; None where there is not one."""
    file, pieces = _read_pieces(path)
    painted = [file.painted(primitive, len(mesh.vertices)) for primitive, mesh in pieces]
    found = [place for place in painted if place is not None]
    if len(found) < len(painted) or len({image for image, _ in found}) > 1:
        return None
    image = file.image(found[0][0])
    return None if image is None else Painting(image, np.concatenate([uv for _, uv in found]))


def _read_pieces(path: str | os.PathLike[str]) -> tuple[_Gltf, list[tuple[dict[str, Any], MeshArrays]]]:
    """Return the file, and its primitives that have triangles with these triangles in the world."""
    document, binary = _read_chunks(path, read_file(path))
    file = _Gltf(path, document, binary)
    unknown = sorted(set(map(str, file.items(document, "extensionsRequired"))) - _KNOWN_EXTENSIONS)
    if unknown:
        raise FileFormatError(path, f"it needs extensions that are not read: {', '.join(unknown)}", offset=20)
    pieces = []
    for mesh, place in file.meshes():
        for primitive in file.entries(mesh, "primitives"):
            pieces.append((primitive, _placed(file.primitive(primitive), place)))
            if len(pieces) > _MOST_PIECES:
                raise FileFormatError(path, f"more than {_MOST_PIECES} pieces", offset=20)
    pieces = [(primitive, piece) for primitive, piece in pieces if len(piece.triangles)]
    if not pieces:
        raise FileFormatError(path, "not a mesh: there is no triangle in its scene", offset=20)
    return file, pieces


def _comments(document: dict[str, Any]) -> tuple[str, ...]:
    """Return the comments that nacre writes; other programs may have anything in their place."""
    found: Any = document
    for name in ("asset", "extras", "comments"):
        found = found.get(name) if isinstance(found, dict) else None
    texts = [text for text in found if isinstance(text, str)] if isinstance(found, list) else []
    lines = (printable(line) for text in texts for line in text.splitlines() or [""])
    return tuple(islice(lines, MAX_COMMENTS))


def _read_chunks(path: str | os.PathLike[str], data: bytes) -> tuple[dict[str, Any], bytes]:
    """Return the JSON document and what follows it."""
    if len(data) < 20 or data[:4] != MAGIC:
        raise FileFormatError(path, "a GLB file begins with 'glTF' and a header of 20 bytes", offset=0)
    version, length, json_size = struct.unpack_from("<III", data, 4)
    if version != VERSION:
        raise FileFormatError(path, f"glTF of version {version}, expected {VERSION}", offset=4)
    if length != len(data):
        raise FileFormatError(path, f"the header promises {length} bytes, the file has {len(data)}", offset=8)
    end = 20 + json_size
    if data[16:20] != JSON_CHUNK or end > len(data):
        raise FileFormatError(path, "the JSON chunk is not whole", offset=12)
    document = parse_json(path, data[20:end])
    if not isinstance(document, dict):
        raise FileFormatError(path, f"expected a JSON object, got {shown(document)}", offset=20)
    if end == len(data):
        return document, b""
    if end + 8 > len(data) or data[end + 4 : end + 8] != BINARY_CHUNK:
        raise FileFormatError(path, "the second chunk is not one of binary data", offset=end)
    (size,) = struct.unpack_from("<I", data, end)
    if size > len(data) - end - 8:
        raise FileFormatError(path, "the binary chunk is not whole", offset=end)
    return document, data[end + 8 : end + 8 + size]


class _Gltf:
    """Checked access to the document; an error names the file and the key."""

    def __init__(self, path: str | os.PathLike[str], document: dict[str, Any], binary: bytes) -> None:
        self.path = path
        self.document = document
        self.binary = binary

    def wrong(self, key: str, value: object, expected: str) -> FileFormatError:
        """Return the error for a value."""
        return FileFormatError(self.path, f"{key} must be {expected}, got {shown(value)}", offset=20)

    def entries(self, owner: dict[str, Any], key: str) -> list[dict[str, Any]]:
        """Return a list of objects, which may be missing."""
        found = owner.get(key, [])
        if not isinstance(found, list) or not all(isinstance(entry, dict) for entry in found):
            raise self.wrong(key, found, "a list of objects")
        return found

    def entry(self, key: str, index: object) -> dict[str, Any]:
        """Return one of the document's objects."""
        found = self.entries(self.document, key)
        if type(index) is not int or not 0 <= index < len(found):
            raise self.wrong(f"an index of {key}", index, f"a whole number below {len(found)}")
        return found[index]

    def whole(self, owner: dict[str, Any], key: str, default: int | None = None) -> int:
        """Return a whole number that is not negative."""
        value = owner.get(key, default)
        if type(value) is not int or not 0 <= value < 1 << 40:
            raise self.wrong(key, value, "a whole number, 0 or more")
        return value

    def numbers(self, owner: dict[str, Any], key: str, default: list[float]) -> Float64:
        """Return as many finite numbers as the default has."""
        value = owner.get(key, default)
        if not isinstance(value, list) or len(value) != len(default):
            raise self.wrong(key, value, f"a list of {len(default)} numbers")
        if not all(type(number) in (int, float) and abs(number) < 1e30 for number in value):
            raise self.wrong(key, value, "a list of finite numbers")
        return np.array(value, np.float64)

    def meshes(self) -> Iterator[tuple[dict[str, Any], Float64]]:
        """Yield the meshes of the scene with their 4x4 places in the world."""
        scene = self.entry("scenes", self.document.get("scene", 0))
        waiting = [(index, np.eye(4)) for index in self.items(scene, "nodes")]
        seen: set[object] = set()
        while waiting:
            index, parent = waiting.pop()
            node = self.entry("nodes", index)
            if index in seen:
                raise FileFormatError(
                    self.path, f"node {index} is there twice: nodes must be a tree", offset=20
                )
            seen.add(index)
            place = parent @ self.local(node)
            if "mesh" in node:
                yield self.entry("meshes", node["mesh"]), place
            waiting += [(child, place) for child in self.items(node, "children")]

    def items(self, owner: dict[str, Any], key: str) -> list[object]:
        """Return a list of whatever, which may be missing."""
        found = owner.get(key, [])
        if not isinstance(found, list):
            raise self.wrong(key, found, "a list")
        return found

    def local(self, node: dict[str, Any]) -> Float64:
        """Return what takes a node's coordinates into its parent's."""
        if "matrix" in node:  # column by column
            return self.numbers(node, "matrix", np.eye(4).reshape(-1).tolist()).reshape(4, 4).T
        x, y, z, w = self.numbers(node, "rotation", [0.0, 0.0, 0.0, 1.0])
        rotation = np.array([
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ])  # fmt: skip
        place = np.eye(4)
        place[:3, :3] = rotation * self.numbers(node, "scale", [1.0, 1.0, 1.0])
        place[:3, 3] = self.numbers(node, "translation", [0.0, 0.0, 0.0])
        return place

    def primitive(self, primitive: dict[str, Any]) -> MeshArrays:
        """Return the triangles of a primitive; none where it is of points or lines."""
        attributes = primitive.get("attributes")
        if not isinstance(attributes, dict):
            raise self.wrong("attributes", attributes, "an object")
        vertices = self.accessor(attributes.get("POSITION"), (3,))
        if "indices" in primitive:
            corners = self.accessor(primitive["indices"], (1,))[:, 0]
            if corners.dtype.kind != "u" or (len(corners) and corners.max() >= len(vertices)):
                raise self.wrong(
                    "indices", int(corners.max(initial=0)), f"whole numbers below {len(vertices)}"
                )
        else:
            corners = np.arange(len(vertices))
        triangles = self.triangles(corners.astype(np.int64), self.whole(primitive, "mode", _TRIANGLES))
        fields = {"NORMAL": (3,), "COLOR_0": (3, 4)}
        found = {k: self.accessor(attributes[k], widths) for k, widths in fields.items() if k in attributes}
        for name, values in found.items():
            if len(values) != len(vertices):
                raise self.wrong(f"count of {name}", len(values), f"that of POSITION, {len(vertices)}")
        colors = found.get("COLOR_0")
        return MeshArrays(
            vertices.astype(np.float64),
            triangles.astype(np.int32),
            found["NORMAL"].astype(np.float64) if "NORMAL" in found else None,
            None if colors is None else srgb_from_linear(colors[:, :3]),
        )

    def triangles(self, corners: npt.NDArray[np.int64], mode: int) -> npt.NDArray[np.int64]:
        """Return triangles from lists, strips or fans of corners."""
        if mode == _TRIANGLES and len(corners) % 3:
            raise self.wrong("the number of corners", len(corners), "a multiple of 3")
        if mode == _TRIANGLES:
            return corners.reshape(-1, 3)
        if mode not in (_STRIP, _FAN) or len(corners) < 3:
            return np.zeros((0, 3), np.int64)
        if mode == _FAN:
            first = np.broadcast_to(corners[0], len(corners) - 2)
            return np.column_stack([first, corners[1:-1], corners[2:]])
        strip = np.column_stack([corners[:-2], corners[1:-1], corners[2:]])
        strip[1::2, :2] = strip[1::2, 1::-1]  # every other one is turned round
        return strip

    def painted(self, primitive: dict[str, Any], num_vertices: int) -> tuple[object, Float32] | None:
        """Return which image is painted on a primitive, and where on it the vertices are, if one is."""
        if "material" not in primitive:
            return None
        material = self.entry("materials", primitive["material"]).get("pbrMetallicRoughness")
        texture = material.get("baseColorTexture") if isinstance(material, dict) else None
        if not isinstance(texture, dict):
            return None
        place = f"TEXCOORD_{self.whole(texture, 'texCoord', 0)}"
        uv = self.accessor(primitive["attributes"].get(place), (2,)).astype(np.float32)
        if len(uv) != num_vertices or not np.isfinite(uv).all():
            raise self.wrong(place, len(uv), f"finite places of the {num_vertices} vertices")
        return self.entry("textures", texture.get("index")).get("source"), _transformed(self, texture, uv)

    def image(self, index: object) -> bytes | None:
        """Return an image file, if it is in this one, and PNG or JPEG."""
        image = self.entry("images", index)
        if "bufferView" not in image:
            return None
        view = self.entry("bufferViews", image["bufferView"])
        start = self.whole(view, "byteOffset", 0)
        data = self.binary[start : start + self.whole(view, "byteLength")]
        return data if is_known_image(data) else None

    def accessor(self, index: object, widths: tuple[int, ...]) -> Array:
        """Return the (count, width) values of an accessor."""
        accessor = self.entry("accessors", index)
        code, kind = accessor.get("componentType"), str(accessor.get("type"))
        if code not in _TYPES or _WIDTHS.get(kind) not in widths:
            raise self.wrong(f"the type of accessor {index}", (code, kind), f"numbers by {widths}")
        if "sparse" in accessor or "bufferView" not in accessor:
            raise FileFormatError(self.path, f"accessor {index} is sparse, which is not read", offset=20)
        view = self.entry("bufferViews", accessor["bufferView"])
        buffer = self.entry("buffers", view.get("buffer"))
        if view.get("buffer") != 0 or "uri" in buffer:
            raise FileFormatError(self.path, "its data is in another file, which is not read", offset=20)
        dtype = np.dtype(_TYPES[code])
        shape = (self.whole(accessor, "count"), _WIDTHS[kind])
        row = shape[1] * dtype.itemsize
        stride = self.whole(view, "byteStride", row)
        start = self.whole(view, "byteOffset", 0)
        end = start + self.whole(view, "byteLength")
        start += self.whole(accessor, "byteOffset", 0)
        if (
            stride < row
            or end > len(self.binary)
            or start + max(shape[0] - 1, 0) * stride + row * (shape[0] > 0) > end
        ):
            raise FileFormatError(self.path, f"accessor {index} does not end within the data", offset=20)
        values: Array = np.ndarray(shape, dtype, self.binary, start, (stride, dtype.itemsize))
        return _fractions(values) if accessor.get("normalized") is True else values


def _transformed(file: _Gltf, texture: dict[str, Any], uv: Float32) -> Float32:
    """Return places on an image as the extension KHR_texture_transform moves them."""
    extensions = texture.get("extensions")
    change = extensions.get("KHR_texture_transform") if isinstance(extensions, dict) else None
    if not isinstance(change, dict):
        return uv
    (angle,) = file.numbers({"rotation": [change.get("rotation", 0.0)]}, "rotation", [0.0])
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    scaled = uv * file.numbers(change, "scale", [1.0, 1.0])
    return np.asarray(scaled @ turn.T + file.numbers(change, "offset", [0.0, 0.0]), np.float32)


def _fractions(values: Array) -> Array:
    """Return what whole numbers stand for: fractions of the largest of their type."""
    return values if values.dtype.kind == "f" else np.maximum(values / np.iinfo(values.dtype).max, -1.0)


def _placed(mesh: MeshArrays, place: Float64) -> MeshArrays:
    """Return a mesh in the world."""
    turn = place[:3, :3]
    is_mirrored = np.linalg.det(turn) < 0
    normals: Float64 | None = None if mesh.normals is None else mesh.normals.astype(np.float64)
    if normals is not None and not (turn == np.eye(3)).all():
        with np.errstate(divide="ignore", invalid="ignore"):
            normals = normals @ np.linalg.pinv(turn)
            normals = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    return MeshArrays(
        mesh.vertices @ turn.T + place[:3, 3],
        mesh.triangles[:, ::-1].copy() if is_mirrored else mesh.triangles,
        normals,
        mesh.colors,
    )


def _joined(pieces: list[MeshArrays]) -> MeshArrays:
    """Return several meshes as one."""
    starts = np.cumsum([0, *(len(piece.vertices) for piece in pieces)])
    normals: list[Any] = [piece.normals for piece in pieces if piece.normals is not None]
    colors = [piece.colors for piece in pieces if piece.colors is not None]
    triangles = [piece.triangles + start for piece, start in zip(pieces, starts, strict=False)]
    return MeshArrays(
        np.concatenate([piece.vertices for piece in pieces]),
        np.concatenate(triangles).astype(np.int32),
        np.concatenate(normals) if len(normals) == len(pieces) else None,
        np.concatenate(colors) if len(colors) == len(pieces) else None,
    )
