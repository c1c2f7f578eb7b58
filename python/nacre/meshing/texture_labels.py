"""Which image paints which triangle, and the patches of one image that this makes."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from nacre import _core

Labels = npt.NDArray[np.int32]
Scores = npt.NDArray[np.float32]
Ints = npt.NDArray[np.intp]

NO_VIEW = -1
"""The label of triangles that no image shows."""

_GOOD = 0.5  # of the best score: an image with half the pixels does as well
_ROUNDS = 8  # of smoothing
_SMALL = 50  # triangles: smaller patches are not worth their seams


def choose_labels(scores: Scores, areas: npt.NDArray[np.float64], neighbors: Ints) -> Labels:
    """
    Choose an image for each triangle, so that few seams are left.

    Parameters
    ----------
    scores : (K, T) float32
        How well each image shows each triangle, in any unit; 0 where it does not.
    areas : (T,) float64
        Of the triangles, in any unit.
    neighbors : (T, 3)
        The triangles across the edges; -1 where there is none.

    Returns
    -------
    (T,) int32
        Rows of ``scores``, or ``NO_VIEW``.
    """
    labels = _cover(scores, areas)
    _smooth(labels, scores, neighbors)
    _absorb_small(labels, scores, neighbors)
    return labels


def _cover(scores: Scores, areas: npt.NDArray[np.float64]) -> Labels:
    """Give each image in turn all triangles that it shows well, the one with the largest share first."""
    best = scores.max(axis=0)
    good = (scores >= np.float32(_GOOD) * best) & (best > 0)
    labels = np.full(scores.shape[1], NO_VIEW, np.int32)
    weights = good.astype(np.float32)
    open_areas = np.where(best > 0, areas, 0).astype(np.float32)
    for _ in range(len(scores)):
        view = int(np.einsum("kt,t->k", weights, open_areas).argmax())
        taken = good[view] & (labels == NO_VIEW)
        labels[taken] = view
        open_areas[taken] = 0
    return labels


def _smooth(labels: Labels, scores: Scores, neighbors: Ints) -> None:
    """Give triangles the image that two of their neighbors have, where it shows them nearly as well."""
    least = np.float32(_GOOD / 2) * scores.max(axis=0)
    for i in range(_ROUNDS):
        around = np.where(neighbors >= 0, labels[neighbors], NO_VIEW)
        a, b, c = around.T
        common = np.where((a == b) | (a == c), a, np.where(b == c, b, NO_VIEW))
        rows = np.flatnonzero((common != NO_VIEW) & (common != labels) & (labels != NO_VIEW))
        rows = rows[rows % 2 == i % 2]  # neighbors take turns, else they would change places
        rows = rows[scores[common[rows], rows] >= least[rows]]
        labels[rows] = common[rows]


def _absorb_small(labels: Labels, scores: Scores, neighbors: Ints) -> None:
    """Let small patches, from their borders, go over to the larger ones around them that show them too."""
    for _ in range(_ROUNDS):
        patches = patches_of(labels, neighbors)
        seen = np.flatnonzero(labels != NO_VIEW)
        counts = np.bincount(patches)
        rows = seen[counts[patches[seen]] < _SMALL]
        around = np.where(neighbors[rows] >= 0, labels[neighbors[rows]], NO_VIEW)
        sizes = np.where(around != NO_VIEW, counts[patches[neighbors[rows]]], 0)
        is_shown = scores[around, rows[:, None]] > 0
        sizes = np.where(is_shown & (sizes > counts[patches[rows]][:, None]), sizes, 0)
        side = sizes.argmax(axis=1)
        each = np.arange(len(rows))
        changes = sizes[each, side] > 0
        if not changes.any():
            return
        labels[rows[changes]] = around[each, side][changes]


def patches_of(labels: Labels, neighbors: Ints) -> npt.NDArray[np.int32]:
    """Return to which patch, triangles of one label that edges join, each triangle belongs, from 0."""
    a, side = np.nonzero(neighbors >= 0)
    b = neighbors[a, side]
    joined = (labels[a] == labels[b]) & (a < b)
    links = np.stack([a, b, b], axis=1)[joined].astype(np.int32)
    patches: npt.NDArray[np.int32] = _core.connected_parts(links, len(labels))
    return patches


def neighbors_of(triangles: npt.NDArray[np.int32]) -> Ints:
    """Return the triangles across the edges of each, (T, 3); -1 where there is none."""
    edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2).astype(np.int64), axis=1)
    keys = edges[:, 0] << 32 | edges[:, 1]
    order = np.argsort(keys, kind="stable")
    pairs = np.flatnonzero(keys[order[1:]] == keys[order[:-1]])
    first, second = order[pairs], order[pairs + 1]
    neighbors = np.full(len(keys), -1, np.intp)
    neighbors[first], neighbors[second] = second // 3, first // 3
    return neighbors.reshape(-1, 3)
