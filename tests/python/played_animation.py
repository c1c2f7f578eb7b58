"""What a viewer works out from an animated GLB file."""

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[Any]


def played(path: Path) -> tuple[Array, Array, dict[str, Any]]:
    """Return the times and the vertices at each, as a viewer works them out from a file."""
    data = path.read_bytes()
    length = struct.unpack_from("<I", data, 12)[0]
    document, chunk = json.loads(data[20 : 20 + length]), data[28 + length :]

    def read(accessor: int) -> Array:
        one = document["accessors"][accessor]
        view = document["bufferViews"][one["bufferView"]]
        width = {"SCALAR": 1, "VEC3": 3}[one["type"]]
        values = np.frombuffer(chunk, "<f4", one["count"] * width, view["byteOffset"])
        return values.reshape(-1, width) if width > 1 else values

    (primitive,) = document["meshes"][0]["primitives"]
    targets = [read(target["POSITION"]) for target in primitive["targets"]]
    (sampler,) = document["animations"][0]["samplers"]
    weights = read(sampler["output"]).reshape(-1, len(targets))
    base = read(primitive["attributes"]["POSITION"]) + np.array(document["nodes"][0]["translation"])
    return read(sampler["input"]), base + np.einsum("fr,rni->fni", weights, targets), document
