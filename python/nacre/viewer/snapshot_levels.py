"""The levels of detail of points in memory."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import numpy.typing as npt

from nacre.io.octree import CELLS_PER_SIDE, Cube, Key, divided
from nacre.viewer.snapshot import Snapshot

_BITS = 21  # of a coordinate in the octree
_RECORD = np.dtype([("X", "<i4"), ("Y", "<i4"), ("Z", "<i4"), ("row", "<u4")])


class SnapshotLevels:
    """
    The points of a model as :class:`nacre.viewer.levels.Levels`; what it keeps is four bytes a point.

    Parameters
    ----------
    cloud : Snapshot
        With a point at least, all finite.
    """

    def __init__(self, cloud: Snapshot) -> None:
        self._cloud = cloud
        self.corner: npt.NDArray[np.float64] = cloud.points.min(axis=0).astype(np.float64)
        extent = float((cloud.points.max(axis=0) - self.corner).max())
        self.side = max(extent, 1e-6) * (1 + 2.0**-_BITS)
        self.spacing = self.side / CELLS_PER_SIDE
        records = np.empty(len(cloud.points), _RECORD)
        for axis, name in enumerate("XYZ"):
            records[name] = (cloud.points[:, axis] - self.corner[axis]) * ((1 << _BITS) / self.side)
        records["row"] = np.arange(len(records))
        self.counts: dict[Key, int] = {}
        parts: list[npt.NDArray[np.uint32]] = []
        for key, node in divided(records, Cube(np.zeros(3, np.int64), _BITS)):
            self.counts[key] = len(node)
            parts.append(node["row"].copy())
        self._rows = np.concatenate(parts)
        ends = np.cumsum([0, *self.counts.values()]).tolist()
        self._ranges = {key: slice(*ends) for key, ends in zip(self.counts, pairwise(ends), strict=True)}

    def read(self, key: Key) -> Snapshot:
        """Return the points of a node, from its lowest corner."""
        rows = self._rows[self._ranges[key]]
        part = self._cloud.rows(rows.astype(np.int64), self.spacing / 2 ** key[0])
        corner = self.corner + self.side / 2 ** key[0] * np.array(key[1:])
        part.points[:] = part.points - corner
        return part
