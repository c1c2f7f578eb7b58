"""The texture of patches: cut out of their images, laid on an atlas, and corrected."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np
import numpy.typing as npt

from nacre.meshing.texture_atlas import CELL, MOST_PIXELS, Changes, cut, pack, paint_cells, rectangles
from nacre.meshing.texture_blending import Layer
from nacre.meshing.texture_labels import NO_VIEW
from nacre.meshing.texture_patches import Patches
from nacre.meshing.texture_views import TextureView
from nacre.texture import Texture

Array = npt.NDArray[np.float64]
Image = npt.NDArray[np.uint8]

_SHRINKING = 0.97  # what is scaled down to an area does not fill it evenly


def paint(
    patches: Patches,
    views: Sequence[TextureView],
    gains: Array,
    node_colors: Array,
    corrections: Array,
    layers: Iterable[Layer] = (),
) -> Texture:
    """
    Return the texture of patches.

    Parameters
    ----------
    patches : Patches
        Of the mesh.
    views : sequence of TextureView
        With the images.
    gains : (K, 3)
        By which each image's channels are multiplied.
    node_colors : (N, 3)
        Of the nodes, for the patches without a view.
    corrections : (N, 3)
        What is added at the nodes, and between them.
    layers : iterable of Layer
        What other images have a share in.
    """
    is_cell = patches.view_of_triangle == NO_VIEW
    num_cells = int(is_cell.sum())
    seen = np.flatnonzero(patches.view_of_node != NO_VIEW)
    shown_patches, group = np.unique(patches.patch_of_node[seen], return_inverse=True)
    scale = 1.0
    while True:
        pixels = scale * (patches.pixels[seen] + 0.5) - 0.5
        first, size = rectangles(pixels, group, len(shown_patches))
        layout = pack(size, num_cells)
        if layout.fits:
            break
        room = MOST_PIXELS**2 - num_cells * CELL**2
        if room <= MOST_PIXELS * CELL or scale < 0.05:
            raise ValueError(
                f"triangles without a view must fit one atlas, got {num_cells}: simplify the mesh"
            )
        scale *= _SHRINKING * min(1.0, math.sqrt(room / size.prod(axis=1).sum()))
    atlas = np.zeros((layout.height, layout.width, 3), np.uint8)
    for view in np.unique(patches.view_of_patch[shown_patches]).tolist():
        image = _exposed(_scaled(views[view].color, scale), gains[view])
        for i in np.flatnonzero(patches.view_of_patch[shown_patches] == view).tolist():
            (left, top), (width, height) = layout.corners[i], size[i]
            atlas[top : top + height, left : left + width] = cut(image, first[i], size[i])
    places = np.zeros((len(patches.pixels), 2))
    places[seen] = pixels - first[group] + layout.corners[group]
    shown = patches.corners[~is_cell]
    changes = Changes(atlas)
    changes.add(places[shown], corrections[shown])
    layers = list(layers)
    if layers:
        at_seams = patches.corners[np.unique(np.concatenate([layer.triangles for layer in layers]))]
        changes.add_beside(places[at_seams], corrections[at_seams])
    for layer in layers:
        image = _exposed(_scaled(views[layer.view].color, scale), gains[layer.view])
        corners = patches.corners[layer.triangles]
        pixels = scale * (layer.pixels + 0.5) - 0.5
        added = layer.corrections - corrections[corners]
        changes.blend(places[corners], image, pixels, layer.weights, added)
    changes.apply()
    corners = patches.corners[is_cell]
    cell_places = paint_cells(atlas, layout.cells, (node_colors + corrections)[corners])
    rows = patches.corners.astype(np.int32)
    rows[is_cell] = len(places) + np.arange(3 * num_cells).reshape(-1, 3)
    uv = (np.concatenate([places, cell_places.reshape(-1, 2)]) + 0.5) / (layout.width, layout.height)
    return Texture(atlas, uv.astype(np.float32), rows)


def _scaled(image: Image, scale: float) -> Image:
    if scale == 1:
        return image
    from nacre._internal.pillow import import_pillow

    pillow = import_pillow()
    size = [max(1, round(scale * side)) for side in image.shape[1::-1]]
    return np.asarray(pillow.fromarray(image).resize(size, pillow.Resampling.BOX))


def _exposed(image: Image, gains: Array) -> Image:
    """Multiply the channels of an image."""
    table = np.clip(np.rint(np.arange(256)[:, None] * gains), 0, 255).astype(np.uint8)
    return np.stack([table[:, i][image[..., i]] for i in range(3)], axis=-1)
