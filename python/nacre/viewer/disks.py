"""Points as disks that close their surface: how large they are, and how far others are from them."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from nacre import KdTree
from nacre.viewer.timeline import Snapshot

_NEIGHBORS = 4  # of a point of a square grid
_LONELIEST = 15.0  # spacings: what is farther from its neighbors is a speck


def disk_radii(cloud: Snapshot) -> npt.NDArray[np.float32]:
    """
    Return the radius of each point's disk [m]: the distance to its fourth neighbor.

    So the sparse surface of what is far closes as the dense one of what is near does. Disks of specks, which
    have no neighbors within 15 spacings, are one spacing wide.
    """
    if not len(cloud.points):
        return np.zeros(0, np.float32)
    distances, _ = KdTree(cloud.points).query(cloud.points, k=_NEIGHBORS + 1)
    radii = np.maximum(distances[:, -1], 0.5 * cloud.spacing)
    return np.asarray(np.where(radii > _LONELIEST * cloud.spacing, cloud.spacing, radii), np.float32)


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
