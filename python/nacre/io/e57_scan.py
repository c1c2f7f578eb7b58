"""One scan of an E57 file, with the normals that pye57's own calls leave out."""

from __future__ import annotations

import uuid
from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

AXES = ("cartesianX", "cartesianY", "cartesianZ")
COLORS = ("colorRed", "colorGreen", "colorBlue")
NORMALS = ("nor:normalX", "nor:normalY", "nor:normalZ")
_NORMALS_URI = "http://www.libe57.org/E57_NOR_surface_normals.txt"
_INVALID = ("cartesianInvalidState", "sphericalInvalidState")


def write_scan(
    file: Any,
    library: Any,
    columns: Mapping[str, npt.NDArray[Any]],
    name: str,
    origin: Array,
    description: str = "",
) -> None:
    """
    Write a scan.

    Parameters
    ----------
    file : pye57.E57
        Opened to write.
    library : module
        ``pye57.libe57``.
    columns : mapping of str to (N,) float32 or uint8
        The coordinates, from the origin; and what else there is of each point.
    name : str
        Of the scan.
    origin : (3,)
        The place of the scan.
    description : str
        Of what is in it.
    """
    image = file.image_file

    def text(value: str) -> Any:
        return library.StringNode(image, value)

    def number(value: float) -> Any:
        return library.FloatNode(image, float(value))

    def structure(members: Mapping[str, Any]) -> Any:
        node = library.StructureNode(image)
        for key, member in members.items():
            node.set(key, member)
        return node

    def field(values: npt.NDArray[Any]) -> Any:
        if values.dtype == np.uint8:
            return library.IntegerNode(image, 0, 0, 255)
        low, high = float(values.min()), float(values.max())
        return library.FloatNode(image, low, library.E57_SINGLE, low, high)

    if NORMALS[0] in columns:
        image.extensionsAdd("nor", _NORMALS_URI)
    turn = {"w": 1, "x": 0, "y": 0, "z": 0}
    members = {
        "guid": text(f"{{{uuid.uuid4()}}}"),
        "name": text(name),
        "pose": structure(
            {
                "rotation": structure({axis: number(value) for axis, value in turn.items()}),
                "translation": structure(dict(zip("xyz", map(number, origin), strict=True))),
            }
        ),
        "cartesianBounds": structure(
            {
                f"{axis[-1].lower()}{end}": number(getattr(np, reduce)(columns[axis]))
                for axis in AXES
                for end, reduce in (("Minimum", "min"), ("Maximum", "max"))
            }
        ),
    }
    if description:
        members["description"] = text(description)
    if "intensity" in columns:
        low, high = columns["intensity"].min(), columns["intensity"].max()
        members["intensityLimits"] = structure(
            {"intensityMinimum": number(low), "intensityMaximum": number(high)}
        )
    if COLORS[0] in columns:
        members["colorLimits"] = structure(
            {
                f"{color}{end}": library.IntegerNode(image, limit)
                for color in COLORS
                for end, limit in (("Minimum", 0), ("Maximum", 255))
            }
        )
    scan = structure(members)
    prototype = structure({key: field(values) for key, values in columns.items()})
    points = library.CompressedVectorNode(image, prototype, library.VectorNode(image, True))
    scan.set("points", points)
    file.data3d.append(scan)
    writer = points.writer(_buffers(image, library, columns))
    writer.write(len(columns[AXES[0]]))
    writer.close()


def read_description(file: Any, index: int) -> str:
    """Return what a scan says of what is in it; "" where it says nothing."""
    scan = file.get_header(index).node
    return str(scan["description"].value()) if scan.isDefined("description") else ""


def read_normals(file: Any, library: Any, index: int) -> npt.NDArray[np.float32] | None:
    """Return the normals (N, 3) of a scan's valid points, turned into its place; None where it has none."""
    header = file.get_header(index)
    if not set(NORMALS) <= set(header.point_fields):
        return None
    columns: dict[str, npt.NDArray[Any]] = {
        name: np.empty(header.point_count, np.float32) for name in NORMALS
    }
    invalid = next((name for name in _INVALID if name in header.point_fields), None)
    if invalid is not None:
        columns[invalid] = np.empty(header.point_count, np.uint8)
    header.points.reader(_buffers(file.image_file, library, columns)).read()
    normals = np.column_stack([columns[name] for name in NORMALS])
    if invalid is not None:
        normals = normals[columns[invalid] == 0]
    if header.has_pose():
        normals = (normals @ header.rotation_matrix.T).astype(np.float32)
    normals[~normals.any(axis=1)] = np.nan
    return normals


def _buffers(image: Any, library: Any, columns: Mapping[str, npt.NDArray[Any]]) -> Any:
    """Return what the library fills or empties: it works in the columns themselves."""
    buffers = library.VectorSourceDestBuffer()
    for name, values in columns.items():
        buffers.append(library.SourceDestBuffer(image, name, values, len(values), True, True))
    return buffers
