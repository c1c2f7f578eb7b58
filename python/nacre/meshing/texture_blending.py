"""What other images show beside the seams of patches, so that one fades into the next."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence

import numpy as np
import numpy.typing as npt

from nacre.meshing.texture_labels import NO_VIEW, Labels
from nacre.meshing.texture_patches import Patches
from nacre.meshing.texture_views import TextureView
from nacre.meshing.texture_visibility import pixels_of

Array = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]
Ints = npt.NDArray[np.intp]

_BAND = 6.0  # [pixels] on both sides of a seam: more than images lie beside their places
_MOST_ROUNDS = 20  # of averaging over neighbors, where triangles are smaller than pixels
_LEAST_WEIGHT = 0.01  # less is not seen


@dataclasses.dataclass(frozen=True, eq=False)
class Layer:
    """
    Triangles at seams as an image shows them that does not paint them.

    Attributes
    ----------
    view : int
        The image.
    triangles : (L,)
        Rows of the mesh's.
    weights : (L, 3)
        Of the image at their corners; what is left to 1 is that of the image that paints them, and others'.
    pixels : (L, 3, 2)
        Where the image shows the corners.
    corrections : (L, 3, 3)
        What is added to its colours at the corners.
    """

    view: int
    triangles: Ints
    weights: Array
    pixels: Array
    corrections: Array


def layers_at_seams(
    patches: Patches,
    vertices: npt.NDArray[np.floating],
    triangles: npt.NDArray[np.int32],
    views: Sequence[TextureView],
    is_shown: Bools,
    corrections: Array,
) -> Iterator[Layer]:
    """
    Yield what fades into patches from beyond their seams, image by image.

    Parameters
    ----------
    patches : Patches
        Of the mesh.
    vertices, triangles : (V, 3), (T, 3)
        The mesh.
    views : sequence of TextureView
        The images.
    is_shown : (K, T) bool
        Which image shows which triangle.
    corrections : (N, 3)
        Of the patches' nodes; beyond its patch an image's goes on as it is there.

    Notes
    -----
    The weights of the images belong to the vertices, not to the patches: the shares of the triangles around
    them, averaged over neighbors as often as spreads them over some pixels. Where patches meet they have the
    same colours, therefore. An image counts at vertices all of whose triangles it shows.
    """
    labels = patches.view_of_triangle
    band = _Band.around(patches, triangles, labels)
    if not len(band.vertices):
        return
    known = np.flatnonzero(labels[band.triangles] != NO_VIEW)
    shares = np.stack(
        [
            band.share(labels, view, is_shown[view])
            if (labels == view).any()
            else np.zeros(len(band.vertices))
            for view in range(len(views))
        ]
    )
    totals = shares.sum(axis=0)
    shares /= np.where(totals > 0, totals, 1)
    for view in range(len(views)):
        weights = shares[view][band.corners[known]]
        is_foreign = labels[band.triangles[known]] != view
        rows = known[is_foreign & (weights > _LEAST_WEIGHT).any(axis=1)]
        if not len(rows):
            continue
        corners = band.corners[rows]
        needed, places = np.unique(corners, return_inverse=True)
        places = places.reshape(-1, 3)
        pixels = pixels_of(vertices[band.vertices[needed]], views[view])
        spread = band.spread(*_corrections_of(view, patches, corrections, band))
        yield Layer(
            view,
            band.triangles[rows],
            shares[view][corners],
            pixels[places],
            spread[needed][places],
        )


@dataclasses.dataclass(frozen=True, eq=False)
class _Band:
    """The vertices of a mesh that are near seams, and the triangles between them."""

    vertices: Ints
    row_of_vertex: Ints
    triangles: Ints
    corners: Ints
    edges: Ints
    rounds: int

    @classmethod
    def around(cls, patches: Patches, triangles: npt.NDArray[np.int32], labels: Labels) -> _Band:
        sides = triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
        seam = np.unique(patches.vertex_of_node[patches.seams])
        num_vertices = int(triangles.max()) + 1
        nodes = patches.corners[np.isin(triangles, seam).any(axis=1) & (labels != NO_VIEW)]
        steps = np.linalg.norm(patches.pixels[nodes[:, [1, 2, 0]]] - patches.pixels[nodes], axis=2)
        length = max(float(np.median(steps)) if len(nodes) else 1.0, 1e-3)
        rounds = int(np.clip(np.ceil((_BAND / length) ** 2 / 2), 1, _MOST_ROUNDS))
        near = np.zeros(num_vertices, bool)
        near[seam] = True
        for _ in range(rounds):
            grown = sides[near[sides].any(axis=1)]
            near[grown] = True
        rows = np.flatnonzero(near)
        row_of_vertex = np.full(num_vertices, -1, np.intp)
        row_of_vertex[rows] = np.arange(len(rows))
        inside = np.flatnonzero(near[triangles].all(axis=1))
        corners = row_of_vertex[triangles[inside]]
        edges = corners[:, [0, 1, 1, 2, 2, 0, 1, 0, 2, 1, 0, 2]].reshape(-1, 2)
        return cls(rows, row_of_vertex, inside, corners, edges, rounds)

    def share(self, labels: Labels, view: int, is_shown: Bools) -> Array:
        """Return how much of a view there is around each vertex; 0 where it does not show all there."""
        count = len(self.vertices)
        corners = self.corners.ravel()
        totals = np.maximum(np.bincount(corners, minlength=count), 1)
        values = np.bincount(corners, np.repeat(labels[self.triangles] == view, 3), count) / totals
        hidden = np.bincount(corners, np.repeat(~is_shown[self.triangles], 3), count) > 0
        values[hidden] = 0
        degrees = np.maximum(np.bincount(self.edges[:, 0], minlength=count), 1)
        for _ in range(self.rounds):
            means = np.bincount(self.edges[:, 0], values[self.edges[:, 1]], count) / degrees
            values = np.where(hidden, 0, (values + means) / 2)
        return values

    def spread(self, values: Array, is_known: Bools) -> Array:
        """Continue (N, 3) values from where they are known, round by round; 0 where none reach."""
        values, is_known = values.copy(), is_known.copy()
        count = len(values)
        for _ in range(self.rounds):
            edges = self.edges[is_known[self.edges[:, 1]] & ~is_known[self.edges[:, 0]]]
            if not len(edges):
                break
            num_known = np.bincount(edges[:, 0], minlength=count)
            sums = [np.bincount(edges[:, 0], values[edges[:, 1], i], count) for i in range(3)]
            new = num_known > 0
            values[new] = (np.stack(sums, axis=1) / np.maximum(num_known, 1)[:, None])[new]
            is_known |= new
        return values


def _corrections_of(view: int, patches: Patches, corrections: Array, band: _Band) -> tuple[Array, Bools]:
    """Return the corrections of a view at the vertices of its patches, and which these are."""
    nodes = np.flatnonzero(patches.view_of_node == view)
    rows = band.row_of_vertex[patches.vertex_of_node[nodes]]
    nodes, rows = nodes[rows >= 0], rows[rows >= 0]
    values, is_known = np.zeros((len(band.vertices), 3)), np.zeros(len(band.vertices), bool)
    values[rows], is_known[rows] = corrections[nodes], True
    return values, is_known
