"""Points as disks that close their surface: how large they are, and how far others are from them."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from nacre import KdTree
from nacre.viewer.timeline import Snapshot

_NEIGHBORS = 4  # of a point of a square grid
_FLATTEST = 0.35  # height of the neighbors over the tangent plane, by their distance


def disk_radii(cloud: Snapshot) -> npt.NDArray[np.float32]:
    """
    Return the radius of each point's disk [m]: the distance to its fourth neighbor.

    So the sparse surface of what is far closes as the dense one of what is near does. Where the neighbors are
    not in the point's tangent plane it is a speck, and its disk one spacing wide; beside neighbors that are
    denser a disk is twice as large as theirs at most.
    """
    if len(cloud.points) < 2:
        return np.full(len(cloud.points), cloud.spacing, np.float32)
    distances, rows = KdTree(cloud.points).query(cloud.points, k=min(_NEIGHBORS + 1, len(cloud.points)))
    offsets = cloud.points[rows] - cloud.points[:, None]
    heights = np.abs(np.einsum("ijk,ik->ij", offsets, cloud.normals))
    is_surface = heights.sum(axis=1) < _FLATTEST * distances.sum(axis=1)
    reach = distances[:, -1]
    radii = np.where(is_surface, np.minimum(reach, 2 * np.median(reach[rows[:, 1:]], axis=1)), cloud.spacing)
    return np.asarray(np.maximum(radii, 0.5 * cloud.spacing), np.float32)


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
