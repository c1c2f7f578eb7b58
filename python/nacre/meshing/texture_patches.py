"""The patches of a painted mesh."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from nacre.mesh import Mesh
from nacre.meshing.texture_labels import NO_VIEW, Labels, neighbors_of, patches_of
from nacre.meshing.texture_views import TextureView
from nacre.meshing.texture_visibility import pixels_of


@dataclasses.dataclass(frozen=True, eq=False)
class Patches:
    """
    Triangles that are joined and have one view.

    Their corners are nodes: a vertex of the mesh has one in each patch that it belongs to.

    Attributes
    ----------
    view_of_patch : (P,) int32
        ``NO_VIEW`` where no view shows it.
    corners : (T, 3)
        The nodes of each triangle.
    vertex_of_node, patch_of_node : (N,)
        To what they belong.
    pixels : (N, 2) float64
        Where the patch's view shows them; 0 without one.
    seams : (S, 2)
        The nodes of the edges at which a patch meets another; each has a row for both.
    """

    view_of_patch: Labels
    corners: npt.NDArray[np.intp]
    vertex_of_node: npt.NDArray[np.intp]
    patch_of_node: npt.NDArray[np.intp]
    pixels: npt.NDArray[np.float64]
    seams: npt.NDArray[np.intp]

    @classmethod
    def of(cls, mesh: Mesh, labels: Labels, views: Sequence[TextureView]) -> Patches:
        """Return the patches of a mesh whose triangles have views."""
        neighbors = neighbors_of(mesh.triangles)
        patches = patches_of(labels, neighbors)
        view_of_patch = np.full(int(patches.max()) + 1, NO_VIEW, np.int32)
        view_of_patch[patches] = labels
        num_vertices = len(mesh.vertices)
        keys = patches.astype(np.int64)[:, None] * num_vertices + mesh.triangles
        nodes, corners = np.unique(keys, return_inverse=True)
        patch_of_node, vertex_of_node = np.divmod(nodes, num_vertices)
        pixels = np.zeros((len(nodes), 2))
        for k, view in enumerate(views):
            rows = np.flatnonzero(view_of_patch[patch_of_node] == k)
            pixels[rows] = pixels_of(mesh.vertices[vertex_of_node[rows]], view)
        corners = corners.reshape(-1, 3)
        triangle, side = np.nonzero((neighbors >= 0) & (patches[neighbors] != patches[:, None]))
        seams = np.stack([corners[triangle, side], corners[triangle, (side + 1) % 3]], axis=1)
        return cls(view_of_patch, corners, vertex_of_node, patch_of_node, pixels, seams)

    @property
    def view_of_node(self) -> Labels:
        """(N,) int32."""
        view: Labels = self.view_of_patch[self.patch_of_node]
        return view

    @property
    def view_of_triangle(self) -> Labels:
        """(T,) int32."""
        view: Labels = self.view_of_node[self.corners[:, 0]]
        return view
