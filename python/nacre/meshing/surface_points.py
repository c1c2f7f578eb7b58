"""Which points of a model are a surface."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from nacre import _core
from nacre._internal import arrays
from nacre._internal.guided import guided
from nacre.frame_report import FrameReport
from nacre.meshing.support_planes import on_support
from nacre.meshing.triangulation import triangulate
from nacre.parameters import RegionParameters

_LEAST_OF_OBJECT = 0.01  # of the points of its largest part, tuned: smaller ones lie beside it


@guided("a Model has normals and confidence; model.cloud() has its points that are a surface")
def on_surface(
    points: npt.ArrayLike, normals: npt.ArrayLike, confidence: npt.ArrayLike, *, num_threads: int = 0
) -> npt.NDArray[np.bool_]:
    """
    Tell the points of a model that are a surface from litter, doubled layers, and normals that contradict.

    Parameters
    ----------
    points, normals : (N, 3) array_like
        [m], and vectors of any length that point out of the surface.
    confidence : (N,) array_like
        How sure each point is, in any unit.
    num_threads : int
        0 uses all. The result does not depend on it.

    Returns
    -------
    (N,) bool

    Raises
    ------
    TypeError, ValueError
        Arrays of the wrong type or shape.

    Notes
    -----
    A point is left out where surer ones cover it: points on the same side of the surface (normals within 60
    degrees) that lie above it, or below it, on all sides, since of two layers so near each other only one can
    be seen. Of the others those stay that :func:`triangulate` joins to a part of at least 30.
    """
    positions = arrays.as_points("points", points)
    directions = arrays.as_unit_rows("normals", normals, "points", len(positions))
    sure = arrays.as_rows(arrays.as_values("confidence", confidence, len(positions), "point"), np.float32)
    flags = _core.on_surface(
        arrays.localize(positions)[0], directions, sure, arrays.as_count("num_threads", num_threads)
    )
    return flags.astype(bool)


def on_main_parts(
    points: npt.NDArray[np.float32],
    normals: npt.NDArray[np.float32],
    is_support: npt.NDArray[np.bool_],
    *,
    num_threads: int = 0,
) -> npt.NDArray[np.bool_]:
    """
    Tell the points of an object from parts that no triangle joins to it: small ones, and some of its support.

    Parameters
    ----------
    points, normals : (N, 3) float32
        [m], and unit vectors.
    is_support : (N,) bool
        Which points lie on the plane that it stands on. A part goes where most do; the largest stays.
    num_threads : int
        0 uses all. The result does not depend on it.

    Returns
    -------
    (N,) bool
    """
    if not len(points):
        return np.zeros(0, bool)
    parts = _core.connected_parts(triangulate(points, normals, num_threads=num_threads), len(points))
    sizes = np.bincount(parts)
    is_main = (sizes >= _LEAST_OF_OBJECT * sizes.max()) & (2 * np.bincount(parts, is_support) <= sizes)
    is_main[sizes.argmax()] = True
    return np.asarray(is_main[parts])


def surface_rows(
    points: npt.NDArray[np.float32],
    normals: npt.NDArray[np.float32],
    confidence: npt.NDArray[np.float32],
    last_seen: npt.NDArray[np.int32],
    frames: Sequence[FrameReport],
    region: RegionParameters,
) -> npt.NDArray[np.int64]:
    """Return which points of a model are written: those on a surface, of an object without scraps."""
    rows = np.flatnonzero(on_surface(points, normals, confidence))
    if not region.object:
        return rows
    is_support = on_support(points[rows], normals[rows], last_seen[rows], frames, margin=region.plane_margin)
    return rows[on_main_parts(points[rows], normals[rows], is_support)]
