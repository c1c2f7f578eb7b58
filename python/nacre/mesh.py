"""Triangle meshes: what a simulated camera looks at and what a model is measured against."""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Callable
from typing import Literal

import numpy as np
import numpy.typing as npt

from nacre import _core
from nacre._internal import arrays
from nacre._internal.core_options import to_core
from nacre._internal.guided import GuidedNames, guided
from nacre._internal.value_equality import Value
from nacre.noise import NoiseModel, NoiseName, as_noise

SensorName = Literal["none", "stereo", "structured_light", "time_of_flight", "phone_lidar"]

_FARTHEST = 1e150  # [m]: beyond it squared distances overflow


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class RayHits(Value):
    """
    What rays hit, one row per ray.

    Attributes
    ----------
    distances : (N,) float64
        In units of the direction's length; NaN where nothing was hit.
    triangles : (N,) int32
        -1 where nothing was hit.
    """

    distances: npt.NDArray[np.float64]
    triangles: npt.NDArray[np.int32]


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class ClosestPoints(Value):
    """
    The points of a mesh that are nearest to given points, one row per point.

    Rows of points that are not finite, or beyond 1e150 m, are NaN, with triangle -1.

    Attributes
    ----------
    points : (N, 3) float64
        On the surface [m].
    normals : (N, 3) float64
        Of the triangles, unit length, by the right-hand rule; 0 for a degenerate triangle.
    distances : (N,) float64
        Unsigned [m].
    triangles : (N,) int32
        The smallest index where several are equally near.
    """

    points: npt.NDArray[np.float64]
    normals: npt.NDArray[np.float64]
    distances: npt.NDArray[np.float64]
    triangles: npt.NDArray[np.int32]


class Mesh(GuidedNames):
    """
    A triangle mesh with a search tree, built once, for rays and nearest points. Immutable.

    Parameters
    ----------
    vertices : (V, 3) array_like of real numbers
        [m]. float64 coordinates far from 0 keep their digits: the tree is made about a nearby origin.
    triangles : (T, 3) array_like of integers
        Vertex indices.
    normals : (V, 3) array_like of real numbers, optional
        Of the vertices.
    colors : (V, 3) array_like of integers from 0 to 255, or of floats from 0 to 1, optional
        Red, green, blue of the vertices.

    Raises
    ------
    TypeError, ValueError
        For vertices that are not finite, indices out of range, or no triangle; for normals or colours of
        another number than there are vertices.
    """

    @guided(
        "model.to_mesh() makes a mesh of a model, nacre.meshing.mesh_points(points, normals) of points, and "
        "nacre.read_mesh(path) reads one",
        faces="triangles",
        vertex_normals="normals",
        vertex_colors="colors",
    )
    def __init__(
        self,
        vertices: npt.ArrayLike,
        triangles: npt.ArrayLike,
        *,
        normals: npt.ArrayLike | None = None,
        colors: npt.ArrayLike | None = None,
    ) -> None:
        self._vertices = arrays.as_points("vertices", vertices).copy()
        size = len(self._vertices)
        self._triangles = arrays.as_triangles("triangles", triangles, size).copy()
        self._normals, self._colors = None, None
        if normals is not None:
            self._normals = arrays.as_matching_points("normals", normals, "vertices", size).copy()
        if colors is not None:
            self._colors = arrays.as_colors("colors", colors, (size, 3)).copy()
        for array in (self._vertices, self._triangles, self._normals, self._colors):
            if array is not None:
                array.flags.writeable = False
        local, self._origin = arrays.localize(self._vertices)
        self._tree = _core.MeshTree(local, self._triangles)

    def __repr__(self) -> str:
        size = " x ".join(f"{side:.4g}" for side in self.bounds[1] - self.bounds[0])
        parts = [f"{len(self.vertices)} vertices", f"{len(self.triangles)} triangles", f"{size} m"]
        parts += [name for name in ("normals", "colors") if getattr(self, name) is not None]
        return f"Mesh({', '.join(parts)})"

    def __reduce__(self) -> tuple[Callable[..., Mesh], tuple[arrays.FloatArray, npt.NDArray[np.int32]]]:
        make = functools.partial(Mesh, normals=self.normals, colors=self.colors)
        return make, (self.vertices, self.triangles)

    @property
    def vertices(self) -> arrays.FloatArray:
        """(V, 3) float32 or float64, read-only [m]."""
        return self._vertices

    @property
    def triangles(self) -> npt.NDArray[np.int32]:
        """(T, 3) int32, read-only: vertex indices."""
        return self._triangles

    @property
    def normals(self) -> arrays.FloatArray | None:
        """(V, 3) float32 or float64, read-only: of the vertices, as they were given; or None."""
        return self._normals

    @property
    def colors(self) -> npt.NDArray[np.uint8] | None:
        """(V, 3) uint8, read-only: red, green, blue of the vertices; or None."""
        return self._colors

    @property
    def bounds(self) -> npt.NDArray[np.float64]:
        """(2, 3): the smallest and the largest corner of the box around the triangles [m]."""
        bounds: npt.NDArray[np.float64] = np.stack([self._tree.lower, self._tree.upper]) + self._origin
        return bounds

    def closest(self, points: npt.ArrayLike, *, num_threads: int = 0) -> ClosestPoints:
        """
        Find the points of the surface that are nearest to given points; exact.

        Parameters
        ----------
        points : (N, 3) array_like of real numbers
            [m].
        num_threads : int
            0: all.

        Returns
        -------
        ClosestPoints
        """
        queries = arrays.as_points("points", points).astype(np.float64) - self._origin
        queries[np.abs(queries).max(axis=1) > _FARTHEST] = np.nan
        nearest, normals, distances, triangles = self._tree.closest(
            queries, arrays.as_count("num_threads", num_threads)
        )
        return ClosestPoints(nearest + self._origin, normals, distances, triangles)

    def distance(self, points: npt.ArrayLike, *, num_threads: int = 0) -> npt.NDArray[np.float64]:
        """
        Return the unsigned distance of each point to the surface.

        Parameters
        ----------
        points : (N, 3) array_like of real numbers
            [m].
        num_threads : int
            0: all.

        Returns
        -------
        (N,) float64
            [m].
        """
        return self.closest(points, num_threads=num_threads).distances

    def cast(self, origins: npt.ArrayLike, directions: npt.ArrayLike, *, num_threads: int = 0) -> RayHits:
        """
        Find the first triangle that each ray hits, from either side.

        No ray slips between triangles that share an edge or a vertex (Woop, Benthin and Wald 2013).

        Parameters
        ----------
        origins, directions : (N, 3) array_like of real numbers
            Directions of any length but 0; a ray that is not finite hits nothing.
        num_threads : int
            0: all.

        Returns
        -------
        RayHits
        """
        starts = arrays.as_points("origins", origins).astype(np.float64) - self._origin
        ways = arrays.as_matching_points("directions", directions, "origins", len(starts)).astype(np.float64)
        return RayHits(*self._tree.cast(starts, ways, arrays.as_count("num_threads", num_threads)))

    def simulate_depth(
        self,
        camera: _core.Camera,
        world_from_camera: npt.ArrayLike,
        *,
        sensor: SensorName = "none",
        noise: float | NoiseName | NoiseModel = 0.0,
        edge_mixing: float = 0.0,
        background_depth: float | None = None,
        quantization: float = 0.0,
        dropout: float = 0.0,
        seed: int = 0,
        sensor_seed: int = 0,
        num_threads: int = 0,
    ) -> npt.NDArray[np.float32]:
        """
        Return the depth image that a camera sees.

        Parameters
        ----------
        camera, world_from_camera, sensor, noise, edge_mixing, background_depth
        quantization, dropout, seed, sensor_seed, num_threads
            As in :func:`nacre.simulate_depth`.

        Returns
        -------
        (H, W) float32
            In the camera's depth kind [m]; NaN where nothing is seen.

        Raises
        ------
        TypeError, ValueError
            Naming the argument, what was expected and what came.
        """
        camera = arrays.as_camera("camera", camera)
        pose = arrays.as_pose("world_from_camera", world_from_camera).copy()
        pose[:3, 3] -= self._origin
        parameters = _Simulation(
            sensor=sensor,
            noise=as_noise("noise", noise, camera) or NoiseModel(),
            edge_mixing=edge_mixing,
            background_depth=_background(background_depth),
            quantization=quantization,
            dropout=dropout,
            seed=seed,
            sensor_seed=sensor_seed,
            num_threads=num_threads,
        )
        options = to_core(parameters, _core.SimulationOptions())
        return _core.simulate_depth(self._tree, camera, pose, options)


def built_in_object() -> Mesh:
    """
    Return nacre's own test object: a snail with the ears of a rabbit, made by formula.

    It is 0.15 m long, looks along +x and stands on the plane y = 0 with y up. The surface is closed and
    consistently oriented (33 000 vertices, 67 000 triangles). Ears, the lip of the shell and the hem of the
    foot are sheets 3 mm thick; it has hollows and no symmetry.

    Returns
    -------
    Mesh
    """
    return Mesh(*_core.built_in_object())


@dataclasses.dataclass(frozen=True)
class _Simulation:
    sensor: SensorName
    noise: NoiseModel
    edge_mixing: float
    background_depth: float
    quantization: float
    dropout: float
    seed: int
    sensor_seed: int
    num_threads: int


def _background(depth: float | None) -> float:
    if depth is None:
        return 0.0
    length = arrays.as_number("background_depth", depth)
    if not 0 < length < math.inf:
        raise ValueError(f"background_depth must be None or a positive length in metres, got {depth!r}")
    return length
