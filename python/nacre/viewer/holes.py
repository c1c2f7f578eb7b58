"""What a model still lacks: the borders of its surface where a camera looked, but saw no more of it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from nacre.meshing import boundary_loops
from nacre.viewer.snapshot import Snapshot
from nacre.viewer.timeline import Timeline
from nacre.viewer.views import Array, could_be_measured

_MIN_EDGES = 16  # of a hole: shorter ones are gaps between a few points
_MIN_RIM = 60  # edges of a rim: shorter ones are those of loose flakes
_MARGIN = 0.04  # of the image's width and height, and of the limits of depth: what is cut there goes on
_OUTWARDS = 0.2  # mean cosine: of a hole the surface lies outwards of its middle
_LIFT = 0.7  # spacings that the lines lie above the surface


class Holes(NamedTuple):
    """
    Borders of a surface, as lines.

    Attributes
    ----------
    segments : (N, 6) float32
        Both ends of each edge [m], a little above the surface.
    is_hole : (N,) uint8
        1: of a hole, which the surface surrounds; 0: of the surface's rim.
    sizes : list of float
        The longest side of each hole's bounding box [m], the largest first.
    """

    segments: npt.NDArray[np.float32]
    is_hole: npt.NDArray[np.uint8]
    sizes: list[float]


def find_holes(cloud: Snapshot, triangles: npt.NDArray[np.int32], timeline: Timeline, place: int) -> Holes:
    """
    Find the borders of a surface that are worth another look.

    Where every camera had a border at the edge of its image, if at all, or at a limit of depth, the scene
    goes on: that part of it is left out, and a loop that is mostly such is no hole. Holes of fewer than 16
    edges are left out, too, and rims of fewer than 60.

    Parameters
    ----------
    cloud : Snapshot
        The model.
    triangles : (T, 3) int32
        Rows of its points, as :func:`nacre.meshing.triangulate` joins them.
    timeline : Timeline
        Its cameras; where they are not known, all borders count.
    place : int
        The last of its frames that counts.

    Returns
    -------
    Holes
    """
    loops = [loop for loop in boundary_loops(triangles) if len(loop) >= _MIN_EDGES]
    corners = np.concatenate([*loops, np.zeros(0, np.int32)])
    seen = could_be_measured(timeline, place, cloud.points[corners], _MARGIN)
    ends = np.cumsum([len(loop) for loop in loops])[:-1]
    segments, is_hole, sizes = [np.zeros((0, 6), np.float32)], [np.zeros(0, np.uint8)], []
    for loop, was_seen in zip(loops, np.split(seen, ends), strict=False):
        points, normals = cloud.points[loop].astype(np.float64), cloud.normals[loop].astype(np.float64)
        surrounds = bool(was_seen.mean() > 0.5) and _surface_lies_outwards(points, normals)
        if not surrounds and len(loop) < _MIN_RIM:
            continue
        if surrounds:
            sizes.append(float(np.ptp(points, axis=0).max()))
        lifted = points + _LIFT * cloud.spacing * normals
        kept = np.hstack([lifted, np.roll(lifted, -1, axis=0)])[was_seen & np.roll(was_seen, -1)]
        segments.append(kept.astype(np.float32))
        is_hole.append(np.full(len(kept), surrounds, np.uint8))
    return Holes(np.concatenate(segments), np.concatenate(is_hole), sorted(sizes, reverse=True))


def _surface_lies_outwards(points: Array, normals: Array) -> bool:
    """Say of a loop, which has the surface on its left, whether that lies outwards of the loop's middle."""
    edges = np.roll(points, -1, axis=0) - points
    inwards = np.cross(normals, edges)  # into the surface, as long as the edges
    offsets = points - points.mean(axis=0)
    lengths = np.linalg.norm(inwards, axis=1) * np.linalg.norm(offsets, axis=1)
    return bool((inwards * offsets).sum() > _OUTWARDS * lengths.sum())
