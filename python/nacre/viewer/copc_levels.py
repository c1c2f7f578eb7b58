"""The levels of detail of a COPC file, of which memory holds none."""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.io.cloud import Cloud
from nacre.io.copc_reader import CopcFile
from nacre.io.octree import Key
from nacre.normals import estimate_normals
from nacre.viewer.snapshot import Snapshot

_AFAR = 1000.0  # sides of the root
_FIELDS = ("confidence", "last_seen", "sigma")


class CopcLevels:
    """
    A COPC file as :class:`nacre.viewer.levels.Levels`, from the middle of its root.

    Points without normals get those of their node's surface, turned upwards: z is up in surveys.

    Parameters
    ----------
    path : path-like
        The file, which stays open.

    Attributes
    ----------
    origin : (3,) float64
        The middle of the root, in the file's coordinates.
    comments : tuple of str
        Of the file.

    Raises
    ------
    FileFormatError, OSError, ImportError
        As :class:`nacre.io.copc_reader.CopcFile` does.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self._file = CopcFile(path, _FIELDS)
        self.counts, self.comments = self._file.counts, self._file.comments
        self.side, self.spacing = self._file.side, self._file.spacing
        self.origin = self._file.corner + self.side / 2
        self.corner: npt.NDArray[np.float64] = np.full(3, -self.side / 2)

    def read(self, key: Key) -> Snapshot:
        """Return the points of a node, from its lowest corner."""
        corner = self._file.corner + self.side / 2 ** key[0] * np.array(key[1:])
        return self._snapshot(self._file.read(key), corner, self.spacing / 2 ** key[0])

    def coarsest(self, max_points: int) -> Snapshot:
        """Return the points of as many levels as have so few together, one at least, from the origin."""
        deepest, total = 0, 0
        for level in range(max((key[0] for key in self.counts), default=-1) + 1):
            total += sum(count for key, count in self.counts.items() if key[0] == level)
            if total > max_points and level:
                break
            deepest = level
        clouds = [self._file.read(key) for key in sorted(self.counts) if key[0] <= deepest]
        whole = _joined(clouds) if clouds else Cloud(np.zeros((0, 3)))
        return self._snapshot(whole, self.origin, self.spacing / 2**deepest)

    def _snapshot(self, cloud: Cloud, corner: npt.NDArray[np.float64], spacing: float) -> Snapshot:
        points = (cloud.points - corner).astype(np.float32)
        normals = cloud.normals
        if normals is None:
            normals = estimate_normals(points, viewpoint=(0, 0, _AFAR * self.side))
        known = np.isfinite(normals).all(axis=1, keepdims=True)
        normals = np.where(known, normals, (0, 0, 1)).astype(np.float32)
        confidence, last_seen, sigma = map(cloud.attributes.get, _FIELDS)
        return Snapshot(points, normals, spacing, cloud.colors, confidence, last_seen, sigma)


def _joined(clouds: list[Cloud]) -> Cloud:
    """Return the points of several clouds with the same fields as one."""

    def column(of: Callable[[Cloud], Any]) -> Any:
        return None if of(clouds[0]) is None else np.concatenate([of(cloud) for cloud in clouds])

    names = clouds[0].attributes
    return Cloud(
        column(lambda cloud: cloud.points),
        column(lambda cloud: cloud.normals),
        column(lambda cloud: cloud.colors),
        {name: np.concatenate([cloud.attributes[name] for cloud in clouds]) for name in names},
    )
