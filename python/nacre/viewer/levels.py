"""Levels of detail: the nodes of an octree, of which the page reads those that its view needs."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from nacre.io.octree import Key
from nacre.viewer.packing import morton_order, pack
from nacre.viewer.point_columns import point_columns
from nacre.viewer.snapshot import Snapshot

STEPS = 1 << 24
"""Of a node's side, to which its points are rounded: a graphics card's float32 tells no more apart."""

_CELL_ABOVE = 2.0
"""Spacings: a point that no node above has lies in a cell of which one of these has another point."""


class Levels(Protocol):
    """
    Points in an octree: a node has points that no node above it has, half as far apart as these.

    Attributes
    ----------
    corner : (3,) float64
        The lowest of the root [m], from the origin of the timeline.
    side, spacing : float
        Of the root, and between its points [m].
    """

    corner: npt.NDArray[np.float64]
    side: float
    spacing: float

    @property
    def counts(self) -> Mapping[Key, int]:
        """The points of each node."""
        ...

    def read(self, key: Key) -> Snapshot:
        """
        Return the points of a node, from its lowest corner.

        Raises
        ------
        KeyError
            When there is no such node.
        FileFormatError, OSError
            When they cannot be read.
        """
        ...


def pack_tree(levels: Levels) -> bytes:
    """Return what the page has to know of the nodes before it reads any."""
    counts = levels.counts
    header = {"origin": levels.corner.tolist(), "side": levels.side, "spacing": levels.spacing}
    nodes = np.array([(*key, counts[key]) for key in sorted(counts)], np.uint32).reshape(-1, 5)
    return pack(header, {"nodes": nodes})


def pack_node(levels: Levels, name: str) -> bytes:
    """
    Return the points of the node called LEVEL-X-Y-Z, along a Morton curve.

    Raises
    ------
    KeyError, FileFormatError, OSError
        As :meth:`Levels.read` does.
    """
    key = _key_of(name)
    cloud = levels.read(key)
    step = levels.side / 2 ** key[0] / STEPS
    rows = np.clip(np.rint(cloud.points / np.float64(step)), 0, STEPS - 1).astype(np.uint32)
    order = morton_order((rows >> 8).astype(np.uint16))
    origin = levels.corner + levels.side / 2 ** key[0] * np.array(key[1:])
    header: dict[str, Any] = {"spacing": cloud.spacing, "origin": origin.tolist(), "step": step}
    largest = _CELL_ABOVE if key[0] else np.inf
    return pack(header, {"points": rows[order]} | point_columns(cloud.rows(order, cloud.spacing), largest))


def name_of(key: Key) -> str:
    """Return what a node is called."""
    return "-".join(map(str, key))


def _key_of(name: str) -> Key:
    parts = name.split("-")
    if len(parts) != 4 or not all(part.isascii() and part.isdecimal() and len(part) < 12 for part in parts):
        raise KeyError(name)
    level, x, y, z = map(int, parts)
    return level, x, y, z
