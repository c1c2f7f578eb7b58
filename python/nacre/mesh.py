"""Triangle meshes: what a simulated camera looks at and what a model is measured against."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Any, Literal, Protocol

import numpy as np
import numpy.typing as npt

from nacre import _core, arrays

if TYPE_CHECKING:
    from nacre._core import Camera


class NoiseLike(Protocol):
    """What a noise model must have: sigma(z) = constant + quadratic * (z - offset)^2."""

    @property
    def constant(self) -> float:
        """[m]."""

    @property
    def quadratic(self) -> float:
        """[1/m]."""

    @property
    def offset(self) -> float:
        """[m]."""


@dataclasses.dataclass(frozen=True)
class RayHits:
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


@dataclasses.dataclass(frozen=True)
class ClosestPoints:
    """
    The points of a mesh that are nearest to given points, one row per point; NaN and -1 for points that are not finite.

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


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Mesh:
    """
    A triangle mesh with a search tree, built once, for rays and nearest points.

    Parameters
    ----------
    vertices : (V, 3) array_like of real numbers
        [m]. float64 coordinates far from 0 keep their digits: the tree works in float32 about a nearby origin.
    triangles : (T, 3) array_like of integers
        Vertex indices.

    Attributes
    ----------
    vertices : (V, 3) float32 or float64, read-only
        A copy.
    triangles : (T, 3) int32, read-only
        A copy.

    Raises
    ------
    TypeError, ValueError
        For vertices that are not finite, indices out of range, or no triangle.
    """

    vertices: arrays.FloatArray
    triangles: npt.NDArray[np.int32]

    def __post_init__(self) -> None:
        vertices = arrays.as_points("vertices", self.vertices).copy()
        triangles = arrays.as_triangles("triangles", self.triangles, len(vertices)).copy()
        local, origin = arrays.localize(vertices)
        tree = _core.MeshTree(local, triangles)
        for array in (vertices, triangles, origin):
            array.flags.writeable = False
        for name, value in (
            ("vertices", vertices),
            ("triangles", triangles),
            ("_tree", tree),
            ("_origin", origin),
        ):
            object.__setattr__(self, name, value)

    def __repr__(self) -> str:
        size = " x ".join(f"{side:.4g}" for side in self.bounds[1] - self.bounds[0])
        return f"Mesh({len(self.vertices)} vertices, {len(self.triangles)} triangles, {size} m)"

    def __reduce__(self) -> tuple[type[Mesh], tuple[arrays.FloatArray, npt.NDArray[np.int32]]]:
        return Mesh, (self.vertices, self.triangles)

    @property
    def bounds(self) -> npt.NDArray[np.float64]:
        """(2, 3): the smallest and the largest corner of the box around the triangles [m]."""
        tree, origin = self._parts()
        return np.stack([tree.lower, tree.upper]) + origin

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
        tree, origin = self._parts()
        queries = arrays.as_points("points", points).astype(np.float64) - origin
        nearest, normals, distances, triangles = tree.closest(queries, _threads(num_threads))
        return ClosestPoints(nearest + origin, normals, distances, triangles)

    def distance(self, points: npt.ArrayLike, *, num_threads: int = 0) -> npt.NDArray[np.float64]:
        """Return the unsigned distance of each point to the surface, (N, 3) -> (N,) [m]; see :meth:`closest`."""
        return self.closest(points, num_threads=num_threads).distances

    def cast(
        self, origins: npt.ArrayLike, directions: npt.ArrayLike, *, num_threads: int = 0
    ) -> RayHits:
        """
        Find the first triangle that each ray hits, from either side.

        Watertight: no ray slips between triangles that share an edge or a vertex (Woop, Benthin and Wald 2013).

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
        tree, origin = self._parts()
        starts = arrays.as_points("origins", origins).astype(np.float64) - origin
        ways = arrays.as_matching_points("directions", directions, "origins", len(starts)).astype(np.float64)
        return RayHits(*tree.cast(starts, ways, _threads(num_threads)))

    def simulate_depth(
        self,
        camera: Camera,
        world_from_camera: npt.ArrayLike,
        *,
        noise: float | Literal["kinect"] | NoiseLike = 0.0,
        edge_mixing: float = 0.0,
        background_depth: float | None = None,
        quantization: float = 0.0,
        dropout: float = 0.0,
        seed: int = 0,
        num_threads: int = 0,
    ) -> npt.NDArray[np.float32]:
        """Return the depth image that a camera sees; see :func:`nacre.simulate_depth`."""
        tree, origin = self._parts()
        pose = arrays.as_pose("world_from_camera", world_from_camera).copy()
        pose[:3, 3] -= origin
        options = _core.SimulationOptions()
        options.noise.constant, options.noise.quadratic, options.noise.offset = _noise_terms(noise)
        options.edge_mixing = float(edge_mixing)
        options.background_depth = _background(background_depth)
        options.quantization = quantization
        options.dropout = dropout
        options.seed = _seed(seed)
        options.num_threads = _threads(num_threads)
        image: npt.NDArray[np.float32] = _core.simulate_depth(tree, camera, pose, options)
        return image

    def _parts(self) -> tuple[Any, npt.NDArray[np.float64]]:
        return self.__dict__["_tree"], self.__dict__["_origin"]


def built_in_object() -> Mesh:
    """
    Return nacre's own test object: a snail with the ears of a rabbit, made by formula.

    It is 0.15 m long, looks along +x and stands on the plane y = 0 with y up. The surface is closed and consistently
    oriented (33 000 vertices, 67 000 triangles). Ears, the lip of the shell and the hem of the foot are sheets 3 mm
    thick; it has hollows and no symmetry.

    Returns
    -------
    Mesh
    """
    return Mesh(*_core.built_in_object())


def _noise_terms(noise: float | str | NoiseLike) -> tuple[float, float, float]:
    expected = 'noise must be a standard deviation in metres, "kinect" or a NoiseModel'
    if isinstance(noise, str):
        if noise != "kinect":
            raise ValueError(f"{expected}, got {noise!r}")
        noise = _core.NoiseModel.kinect()
    if isinstance(noise, (int, float, np.integer, np.floating)):
        if not (np.isfinite(noise) and noise >= 0):
            raise ValueError(f"{expected}, got {noise!r}")
        return float(noise), 0.0, 0.0
    try:
        return float(noise.constant), float(noise.quadratic), float(noise.offset)
    except AttributeError:
        raise TypeError(f"{expected}, got {type(noise).__name__}") from None


def _background(depth: float | None) -> float:
    if depth is None:
        return 0.0
    if not (np.isfinite(depth) and depth > 0):
        raise ValueError(f"background_depth must be None or a positive length in metres, got {depth!r}")
    return float(depth)


def _seed(seed: int) -> int:
    if not 0 <= seed < 2**64:
        raise ValueError(f"seed must be 0 to 2**64 - 1, got {seed!r}")
    return int(seed)


def _threads(num_threads: int) -> int:
    if num_threads < 0:
        raise ValueError(f"num_threads must be at least 0, got {num_threads!r}")
    return int(num_threads)
