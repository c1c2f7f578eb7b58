"""GLB files made of arrays, as other programs write them."""

import json
import struct

import numpy as np

SQUARE = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], "<f4")
LIST = {"attributes": {"POSITION": 0}, "indices": 1}


def glb(arrays, primitive, nodes=None, **document):
    """Return a file whose accessors are the arrays, one after the other."""
    codes = {"i1": 5120, "u1": 5121, "i2": 5122, "u2": 5123, "u4": 5125, "f4": 5126}
    views, accessors, binary = [], [], b""
    for array in map(np.asarray, arrays):
        kind = "SCALAR" if array.ndim == 1 else f"VEC{array.shape[1]}"
        views.append({"buffer": 0, "byteOffset": len(binary), "byteLength": array.nbytes})
        accessors.append({
            "bufferView": len(accessors), "componentType": codes[array.dtype.str[1:]], "count": len(array),
            "type": kind, "normalized": array.dtype.kind != "f" and array.ndim == 2,
        })  # fmt: skip
        binary += array.tobytes() + bytes(-array.nbytes % 4)
    made = {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
        "nodes": nodes or [{"mesh": 0}], "meshes": [{"primitives": [primitive]}],
        "accessors": accessors, "bufferViews": views, "buffers": [{"byteLength": len(binary)}],
    }  # fmt: skip
    return packed(json.dumps({**made, **document}).encode(), binary)


def packed(text, binary):
    text += b" " * (-len(text) % 4)
    chunks = (
        struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(binary), b"BIN\0") + binary
    )
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks
