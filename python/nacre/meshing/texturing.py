"""A mesh painted with the images of a recording."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from nacre._internal import arrays
from nacre._internal.guided import guided
from nacre.camera import Camera
from nacre.mesh import Mesh
from nacre.meshing.texture_blending import layers_at_seams
from nacre.meshing.texture_exposure import (
    Falloff,
    blurred,
    colors_at,
    detail_at,
    image_gains,
    light_falloff,
    seam_corrections,
)
from nacre.meshing.texture_labels import NO_VIEW, choose_labels, neighbors_of
from nacre.meshing.texture_painting import paint
from nacre.meshing.texture_patches import Patches
from nacre.meshing.texture_views import TextureView, check_views
from nacre.meshing.texture_visibility import edge_lengths, project
from nacre.texture import Texture

Array = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]

_PLACES = 5_000  # budget: vertices at which the exposures are compared
_SAMPLES = 5  # of the colours along an edge
_GRAY = 128.0  # where neither an image nor a colour is known


@guided(
    "nacre.meshing.texture_views(sequence, poses) has views, and a Mesh vertices and triangles",
    faces="triangles",
)
def texture_mesh(
    vertices: npt.ArrayLike,
    triangles: npt.ArrayLike,
    views: Sequence[TextureView],
    *,
    colors: npt.ArrayLike | None = None,
    is_seen: npt.ArrayLike | None = None,
) -> Texture:
    """
    Paint a mesh with images: each triangle with one that shows it well, in one exposure, without seams.

    Parameters
    ----------
    vertices : (V, 3) array_like of real numbers
        [m].
    triangles : (T, 3) array_like of integers
        Vertex indices, counter-clockwise seen from outside.
    views : sequence of TextureView
        Images, whose places fit the mesh; :func:`texture_views` chooses some of a recording.
    colors : (V, 3) array_like of uint8, optional
        Of the vertices, for the triangles that no image shows.
    is_seen : (V,) array_like of bool, optional
        False at vertices that are a guess: their triangles have ``colors`` alone.

    Returns
    -------
    Texture

    Raises
    ------
    TypeError, ValueError
        Arguments of the wrong type or shape, or too many triangles that no image shows for one atlas.
    ImportError
        The images are too large for one atlas, and pillow, which scales them, is missing.

    Notes
    -----
    M. Waechter, N. Moehrle and M. Goesele, "Let There Be Color! Large-Scale Texturing of 3D Reconstructions",
    ECCV 2014, with a cover by few images in place of their Markov random field.
    """
    mesh = Mesh(vertices, triangles)
    checked = check_views("views", views)
    fallback = None if colors is None else _as_colors("colors", colors, len(mesh.vertices))
    is_guess = np.zeros(len(mesh.vertices), np.bool_)
    if is_seen is not None:
        is_guess = arrays.as_values("is_seen", is_seen, len(mesh.vertices), "vertex") == 0
    checked, labels, gains, is_shown = _choose_views(mesh, checked, is_guess)
    patches = Patches.of(mesh, labels, checked)
    node_colors = _node_colors(patches, checked, gains, fallback)
    edges = patches.corners[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    is_photographed = patches.view_of_node != NO_VIEW
    corrections = seam_corrections(node_colors, patches.vertex_of_node, edges, is_photographed)
    corrections[is_guess[patches.vertex_of_node]] = 0
    layers = layers_at_seams(patches, mesh.vertices, mesh.triangles, checked, is_shown, corrections)
    return paint(patches, checked, gains, node_colors, corrections, layers)


class _Choice(NamedTuple):
    """
    What triangles are painted with.

    Attributes
    ----------
    views : list of TextureView
        As bright at their corners as in the middle.
    labels : (T,) int32
        The view of each triangle.
    gains : (K, 3)
        Of the views' channels.
    is_shown : (K, T) bool
        Which view shows which triangle.
    """

    views: list[TextureView]
    labels: npt.NDArray[np.int32]
    gains: Array
    is_shown: Bools


def _choose_views(mesh: Mesh, views: Sequence[TextureView], is_guess: Bools) -> _Choice:
    tolerance = edge_lengths(mesh)
    places = np.unique(np.linspace(0, len(mesh.vertices) - 1, _PLACES).astype(np.intp))
    scores = np.empty((len(views), len(mesh.triangles)), np.float32)
    is_visible = np.empty((len(views), len(places)), np.bool_)
    colors = np.empty((len(views), len(places), 3))
    radii = np.empty((len(views), len(places)))
    for k, view in enumerate(views):
        projection = project(mesh, view, tolerance)
        image = blurred(view.color)
        scores[k] = projection.area * detail_at(image, projection.pixels)[mesh.triangles[:, 0]]
        is_visible[k] = projection.is_visible[places]
        colors[k] = colors_at(image, projection.pixels[places])
        radii[k] = _radii(view.camera, projection.pixels[places])
    scores[:, is_guess[mesh.triangles].any(axis=1)] = 0
    if not scores.any():
        raise ValueError("views show no triangle of the mesh: check that their poses are of its frame")
    falloff = light_falloff(colors, radii, is_visible)
    colors *= falloff.factors(radii)[..., None]
    a, b, c = (mesh.vertices[mesh.triangles[:, i]].astype(np.float64) for i in range(3))
    areas = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    return _Choice(
        [_evened(view, falloff) for view in views],
        choose_labels(scores, areas, neighbors_of(mesh.triangles)),
        image_gains(colors, is_visible),
        scores > 0,
    )


def _radii(camera: Camera, pixels: npt.NDArray[np.number]) -> Array:
    """Return how far (..., 2) pixels are from the optical axis, in half diagonals of the image."""
    offsets = np.nan_to_num(pixels) - (camera.cx, camera.cy)
    return np.asarray(2 * np.hypot(*np.moveaxis(offsets, -1, 0)) / np.hypot(camera.width, camera.height))


def _evened(view: TextureView, falloff: Falloff) -> TextureView:
    """Return a view that is as bright at its corners as in the middle."""
    if not falloff.is_seen:
        return view
    pixels = np.stack(np.meshgrid(*(np.arange(side) for side in view.color.shape[1::-1])), axis=-1)
    bright = view.color * falloff.factors(_radii(view.camera, pixels))[..., None]
    return dataclasses.replace(view, color=np.clip(np.rint(bright), 0, 255).astype(np.uint8))


def _node_colors(
    patches: Patches, views: Sequence[TextureView], gains: Array, fallback: Array | None
) -> Array:
    """Return what the images show at the corners of patches, in one exposure; else the fallback."""
    colors = np.full((len(patches.vertex_of_node), 3), _GRAY)
    for k, view in enumerate(views):
        image = gains[k] * blurred(view.color)
        rows = np.flatnonzero(patches.view_of_node == k)
        colors[rows] = colors_at(image, patches.pixels[rows])
        seams = patches.seams[patches.view_of_node[patches.seams[:, 0]] == k]
        rows, means = _means_along(image, patches.pixels, seams)
        colors[rows] = means
    unseen = patches.view_of_node == NO_VIEW
    if fallback is not None:
        colors[unseen] = fallback[patches.vertex_of_node[unseen]]
    return colors


def _means_along(
    image: Array, pixels: Array, edges: npt.NDArray[np.intp]
) -> tuple[npt.NDArray[np.intp], Array]:
    """
    Return the ends of edges, and the mean colours along their edges, weighted by nearness.

    Both sides of a seam have these edges: their means differ by exposure, and less by what lies beside them.
    """
    ends, rows = np.unique(edges, return_inverse=True)
    first, second = rows.reshape(-1, 2).T
    sums = np.zeros((len(ends), 4))
    for part in np.linspace(0, 1, _SAMPLES):
        places = (1 - part) * pixels[edges[:, 0]] + part * pixels[edges[:, 1]]
        samples = np.pad(colors_at(image, places), ((0, 0), (0, 1)), constant_values=1)
        np.add.at(sums, first, (1 - part) * samples)
        np.add.at(sums, second, part * samples)
    return ends, sums[:, :3] / sums[:, 3:]


def _as_colors(name: str, value: npt.ArrayLike, num_vertices: int) -> Array:
    array = arrays.as_real(name, value)
    if array.shape != (num_vertices, 3) or array.dtype != np.uint8:
        raise ValueError(f"{name} must be ({num_vertices}, 3) uint8, got {array.shape} of {array.dtype}")
    return array.astype(np.float64)
