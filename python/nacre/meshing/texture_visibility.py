"""What of a mesh an image shows, and how large."""

from __future__ import annotations

import dataclasses
import functools

import numpy as np
import numpy.typing as npt

from nacre.camera import Camera
from nacre.mesh import Mesh
from nacre.meshing.texture_views import TextureView

Array = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]

_COARSER = 3  # than the image is the mesh rendered to find what it hides: a budget of time
_EROSION = 1  # [rendered pixels] of what lies behind: poses, and colours beside depth, err by some
_LOST_AT_OUTLINE = 0.4  # of a triangle's area: the image may show what lies behind instead
_LEAST_FACING = 0.15  # cosine: more slanted, an image has but streaks
_MEASURED_TOLERANCE = 0.03  # of the distance: depth cameras err by less


@dataclasses.dataclass(frozen=True, eq=False)
class Projection:
    """
    A mesh in an image.

    Attributes
    ----------
    pixels : (V, 2) float64
        Where the vertices lie; not finite where there is no place.
    is_visible : (V,) bool
        Whether the image shows them.
    area : (T,) float32
        Of the triangles [pixels], less at silhouettes; 0 where not the whole is shown from in front.
    """

    pixels: Array
    is_visible: Bools
    area: npt.NDArray[np.float32]


def project(mesh: Mesh, view: TextureView, tolerance: Array) -> Projection:
    """Project a mesh into an image, which shows what is within (V,) tolerances [m] of what it sees."""
    camera = view.camera
    local = _in_camera(mesh.vertices, view)
    pixels = camera.project(local)
    depths = np.linalg.norm(local, axis=1) if camera.depth == "radial" else local[:, 2]
    inside = ((pixels >= 0) & (pixels <= np.array([camera.width, camera.height]) - 1)).all(axis=1)
    is_visible = inside & (depths > 0)
    rows = np.flatnonzero(is_visible)
    is_shown, is_outline = _shown(mesh, view, pixels[rows], depths[rows], tolerance[rows])
    is_visible[rows] = is_shown
    outline = np.zeros(len(pixels), np.bool_)
    outline[rows] = is_outline
    shown = np.flatnonzero(is_visible[mesh.triangles].all(axis=1))
    area = np.zeros(len(mesh.triangles), np.float32)
    corners = mesh.triangles[shown]
    a, b, c = (pixels[corners[:, i]] for i in range(3))
    facing = _facing(local, corners, camera)
    weight = (facing >= _LEAST_FACING) * (1 - _LOST_AT_OUTLINE * outline[corners].mean(axis=1))
    area[shown] = weight * np.abs(_cross(b - a, c - a)) / 2
    return Projection(pixels, is_visible, area)


def edge_lengths(mesh: Mesh) -> Array:
    """Return the mean length of the edges at each vertex, (V,) [m]: how much a mesh may err."""
    corners = mesh.triangles.ravel()
    ends = mesh.triangles[:, [1, 2, 0]].ravel()
    lengths = np.linalg.norm(mesh.vertices[corners] - mesh.vertices[ends], axis=1)
    num_vertices = len(mesh.vertices)
    totals = np.bincount(corners, lengths, num_vertices) + np.bincount(ends, lengths, num_vertices)
    means: Array = totals / np.maximum(2 * np.bincount(corners, minlength=num_vertices), 1)
    return means


def pixels_of(points: npt.NDArray[np.floating], view: TextureView) -> Array:
    """Return where an image shows points, (N, 2)."""
    return view.camera.project(_in_camera(points, view))


def _in_camera(points: npt.NDArray[np.floating], view: TextureView) -> Array:
    rotation, position = view.world_from_camera[:3, :3], view.world_from_camera[:3, 3]
    local: Array = (points - position) @ rotation
    return local


def _shown(
    mesh: Mesh, view: TextureView, pixels: Array, depths: Array, tolerance: Array
) -> tuple[Bools, Bools]:
    """
    Compare vertices with what the camera sees of the mesh, and with what it measured.

    Returns whether neither stands before them, nor anything measured is behind them; and whether something
    around them in the image is behind them.
    """
    camera = _coarser(view.camera)
    rendered = mesh.simulate_depth(camera, view.world_from_camera)
    slope = _EROSION * _COARSER * depths / _focal(view.camera) if camera.model == "pinhole" else 0
    margin = tolerance + slope
    columns, rows = np.rint((pixels.T + 0.5) / _COARSER - 0.5).astype(np.intp)
    columns, rows = np.clip(columns, 0, camera.width - 1), np.clip(rows, 0, camera.height - 1)
    nearest = _eroded(rendered, _EROSION)[rows, columns]
    farthest = -_eroded(-np.where(np.isfinite(rendered), rendered, np.inf), _EROSION)[rows, columns]
    is_shown: Bools = ~(depths - nearest > margin)
    is_outline: Bools = farthest - depths > margin
    if view.depth is not None:
        columns, rows = np.rint(pixels.T).astype(np.intp)
        margin = margin + _MEASURED_TOLERANCE * depths
        nearest = _eroded(view.depth, _EROSION * _COARSER)[rows, columns]
        farthest = -_eroded(-view.depth, _EROSION * _COARSER)[rows, columns]
        is_shown &= ~(depths - nearest > margin) & ~(view.depth[rows, columns] - depths > margin)
        is_outline |= farthest - depths > margin
    return is_shown, is_outline


def _facing(local: Array, corners: npt.NDArray[np.int32], camera: Camera) -> Array:
    """Return the cosine between triangles' normals and the ways to the camera."""
    a, b, c = (local[corners[:, i]] for i in range(3))
    normals = np.cross(b - a, c - a)
    ways = np.broadcast_to((0.0, 0.0, -1.0), a.shape) if camera.model == "orthographic" else -(a + b + c)
    lengths = np.linalg.norm(normals, axis=1) * np.linalg.norm(ways, axis=1)
    cosines: Array = np.einsum("ij,ij->i", normals, ways) / np.where(lengths > 0, lengths, 1)
    return cosines


def _coarser(camera: Camera) -> Camera:
    """Return the camera whose pixels are blocks of another's."""
    width, height = (max(1, size // _COARSER) for size in (camera.width, camera.height))
    if camera.model == "orthographic":
        return Camera.orthographic(width, height, camera.pixel_size * _COARSER)
    center = ((camera.cx + 0.5) / _COARSER - 0.5, (camera.cy + 0.5) / _COARSER - 0.5)
    focal = (camera.fx / _COARSER, camera.fy / _COARSER)
    return Camera(width, height, *focal, *center, distortion=camera.distortion, depth=camera.depth)


def _focal(camera: Camera) -> float:
    return min(abs(camera.fx), abs(camera.fy))


def _eroded(depth: npt.NDArray[np.float32], radius: int) -> npt.NDArray[np.float32]:
    """Return the least depth around each pixel; NaN where there is none."""
    for axis in (0, 1):
        padded = np.pad(depth, [(radius, radius) if i == axis else (0, 0) for i in (0, 1)], "edge")
        size = depth.shape[axis]
        shifted = (padded.take(range(i, i + size), axis) for i in range(2 * radius + 1))
        depth = functools.reduce(np.fmin, shifted)
    return depth


def _cross(a: Array, b: Array) -> Array:
    product: Array = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    return product
