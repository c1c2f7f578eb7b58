"""A triangle mesh as a file has it, and polygons on their way to triangles."""

from __future__ import annotations

import dataclasses
import os
from array import array
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from nacre._internal import arrays
from nacre.errors import FileFormatError
from nacre.io.cloud import Columns
from nacre.texture import Texture


@dataclass(frozen=True)
class MeshArrays:
    """
    The arrays of a mesh file.

    Attributes
    ----------
    vertices : (N, 3) float32 or float64
        As stored in PLY and STL files, float64 from texts and from GLB.
    triangles : (M, 3) int32
        Indices of the corners, counted from 0.
    normals : (N, 3) float32 or float64, or None
        Of the vertices.
    colors : (N, 3) uint8, or None
        Red, green, blue of the vertices.
    attributes : dict of str to (N,) or (N, K) array
        More of the vertices; read from PLY files.
    texture : Texture or None
        What is painted on the triangles; not read.
    comments : tuple of str
        Of the header; OFF and STL texts have none.
    """

    vertices: arrays.FloatArray
    triangles: npt.NDArray[np.int32]
    normals: arrays.FloatArray | None = None
    colors: npt.NDArray[np.uint8] | None = None
    attributes: Columns = field(default_factory=dict)
    texture: Texture | None = None
    comments: tuple[str, ...] = ()


def fan(
    path: str | os.PathLike[str],
    corners: npt.NDArray[np.int64],
    counts: npt.NDArray[np.int64],
    num_vertices: int,
) -> npt.NDArray[np.int32]:
    """Return polygons, given as all their corners and the number of corners of each, as fans of triangles."""
    small = np.flatnonzero(counts < 3)
    if len(small):
        raise FileFormatError(path, f"face {small[0]} has {counts[small[0]]} corners")
    if num_vertices > np.iinfo(np.int32).max:
        raise FileFormatError(path, f"{num_vertices} vertices are more than a mesh can have")
    wrong = np.flatnonzero((corners < 0) | (corners >= num_vertices))
    if len(wrong):
        face = int(np.searchsorted(np.cumsum(counts), wrong[0], side="right"))
        reason = f"face {face} names vertex {corners[wrong[0]]}, counted from 0, of {num_vertices} vertices"
        raise FileFormatError(path, reason)
    if (counts == 3).all():
        return corners.reshape(-1, 3).astype(np.int32)
    num_triangles = counts - 2
    first = np.repeat(np.cumsum(counts) - counts, num_triangles)
    step = np.arange(num_triangles.sum()) - np.repeat(np.cumsum(num_triangles) - num_triangles, num_triangles)
    triangles = np.column_stack((first, first + step + 1, first + step + 2))
    result: npt.NDArray[np.int32] = corners.astype(np.int32)[triangles]
    return result


def vertex_normals(points: arrays.FloatArray, triangles: npt.NDArray[np.int32]) -> npt.NDArray[np.float64]:
    """Return the mean direction of the triangles about each point, by area; NaN where there are none."""
    a, b, c = points.astype(np.float64)[triangles].transpose(1, 0, 2)
    with np.errstate(invalid="ignore"):
        areas = np.repeat(np.cross(b - a, c - a), 3, axis=0)
        sums = [np.bincount(triangles.ravel(), areas[:, axis], len(points)) for axis in range(3)]
        normals = np.stack(sums, axis=1)
        return np.asarray(normals / np.linalg.norm(normals, axis=1, keepdims=True))


def split(mesh: MeshArrays, places: npt.NDArray[np.integer]) -> tuple[MeshArrays, npt.NDArray[np.int64]]:
    """
    Return a mesh whose vertices have one place on an image each, and the places.

    Parameters
    ----------
    mesh : MeshArrays
        Its attributes stay as they are.
    places : (M, 3) array
        Of the corners of the triangles, counted from 0.
    """
    num_places = int(places.max(initial=0)) + 1
    pairs = mesh.triangles.astype(np.int64) * num_places + places
    corners, triangles = np.unique(pairs, return_inverse=True)
    rows, chosen = np.divmod(corners, num_places)
    parted = dataclasses.replace(
        mesh,
        vertices=mesh.vertices[rows],
        triangles=triangles.reshape(-1, 3).astype(np.int32),
        normals=None if mesh.normals is None else mesh.normals[rows],
        colors=None if mesh.colors is None else mesh.colors[rows],
    )
    return parted, chosen


class Polygons:
    """A mesh as it grows line by line."""

    def __init__(self) -> None:
        self.coordinates = array("d")
        self.corners = array("q")
        self.counts = array("q")

    @property
    def num_vertices(self) -> int:
        """How many vertices there are by now."""
        return len(self.coordinates) // 3

    def add_vertex(self, words: Sequence[bytes]) -> None:
        """Take in three coordinates; what follows them is left out."""
        x, y, z = words[:3]
        self.coordinates.extend(map(float_of, (x, y, z)))

    def add_face(self, corners: Sequence[int]) -> None:
        """Take in the corners of a polygon."""
        self.corners.extend(corners)
        self.counts.append(len(corners))

    def finish(self, path: str | os.PathLike[str]) -> MeshArrays:
        """Return vertices and triangles."""
        corners, counts = (np.frombuffer(values, np.int64) for values in (self.corners, self.counts))
        vertices = np.frombuffer(self.coordinates, np.float64).reshape(-1, 3)
        return MeshArrays(vertices, fan(path, corners, counts, len(vertices)))


def float_of(word: bytes) -> float:
    """Return a number; raise a ValueError where Python alone would take it (1_0)."""
    if b"_" in word:
        raise ValueError
    return float(word)
