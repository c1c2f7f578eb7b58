"""Points as disks that close their surface: how large they are, and how far others are from them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.kdtree import KdTree
from nacre.viewer.snapshot import Snapshot

_NEIGHBORS = 4  # of a point of a square grid
_AROUND = 12  # nearest points that tell of the surface about one
_ONE_SIDED = 0.5  # length of the mean of directions to them: 0.64 where they fill a half plane
_FLATTEST = 0.35  # height of the neighbors over the tangent plane, by their distance
_ROWS_AT_ONCE = 1 << 17  # for the sake of memory


def disk_radii(cloud: Snapshot) -> npt.NDArray[np.float32]:
    """
    Return the radius of each point's disk [m]: the distance to its fourth neighbor.

    So the sparse surface of what is far closes as the dense one of what is near does. At the surface's rim,
    where half of the neighbors are missing, it is the distance to the second, so that the disk sticks out
    less. Where the neighbors are not in the point's tangent plane it is a speck, and its disk one spacing
    wide; beside a denser surface, as flakes are, a disk is twice as large as those there at most.
    """
    if len(cloud.points) < 2:
        return np.full(len(cloud.points), cloud.spacing, np.float32)
    tree = KdTree(cloud.points)
    reach, is_surface = np.empty(len(cloud.points)), np.empty(len(cloud.points), bool)
    for part, distances, rows in _neighbors(tree, cloud):
        offsets = cloud.points[rows] - cloud.points[part, None]
        toward = np.matmul((1 / np.maximum(distances, 1e-12))[:, None].astype(np.float32), offsets)[:, 0]
        is_rim = np.linalg.norm(toward, axis=1) > _ONE_SIDED * rows.shape[1]
        near = distances[:, :_NEIGHBORS]
        reach[part] = np.where(is_rim, near[:, (near.shape[1] - 1) // 2], near[:, -1])
        heights = np.abs(np.matmul(offsets[:, :_NEIGHBORS], cloud.normals[part, :, None])).sum(axis=(1, 2))
        is_surface[part] = heights < _FLATTEST * near.sum(axis=1)
    radii = np.empty(len(cloud.points))
    for part, _, rows in _neighbors(tree, cloud):
        quarter = rows.shape[1] // 4
        dense = np.partition(reach[rows], quarter, axis=1)[:, quarter]
        radii[part] = np.where(is_surface[part], np.minimum(reach[part], 2 * dense), cloud.spacing)
    return np.asarray(np.maximum(radii, 0.5 * cloud.spacing), np.float32)


def _neighbors(tree: KdTree, cloud: Snapshot) -> Iterator[tuple[slice, Any, Any]]:
    """Yield parts of the points, how far the nearest others are (M, K), and their rows."""
    num_nearest = min(_AROUND + 1, len(cloud.points))
    for start in range(0, len(cloud.points), _ROWS_AT_ONCE):
        part = slice(start, start + _ROWS_AT_ONCE)
        distances, rows = tree.query(cloud.points[part], k=num_nearest)
        yield part, distances[:, 1:], rows[:, 1:]


def deviation(cloud: Snapshot, other: Snapshot) -> npt.NDArray[np.float32]:
    """
    Return how far each point is from the surface of another model [m].

    Parameters
    ----------
    cloud, other : Snapshot
        In the same world frame; the other has a point at least.

    Returns
    -------
    (N,) float32
        The distance to the disk of the nearest point. The distance to that point itself would be half a
        spacing even between two samples of the same surface.
    """
    distances, nearest = KdTree(other.points).query(cloud.points)
    offsets = cloud.points - other.points[nearest]
    height = np.einsum("ij,ij->i", offsets, other.normals[nearest])
    aside = np.sqrt(np.maximum(distances**2 - height**2, 0))
    outside = np.maximum(aside - disk_radii(other)[nearest], 0)
    return np.asarray(np.hypot(height, outside), np.float32)
