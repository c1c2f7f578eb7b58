"""How evenly points are spread."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from nacre._internal.arrays import as_points
from nacre._internal.guided import guided
from nacre.evaluation.result import Count, Fraction, Metres, Result


@dataclass(frozen=True, eq=False, repr=False)
class Uniformity(Result):
    """Statistics of each point's distance to its nearest other point; made by :func:`uniformity`."""

    mean: Metres
    std: Metres
    min: Metres
    max: Metres
    coefficient_of_variation: float  #: std / mean
    duplicates: Fraction  #: points with a neighbour nearer than half of the mean
    num_points: Count  #: points that are finite


@guided()
@np.errstate(over="ignore", invalid="ignore")
def uniformity(points: npt.ArrayLike) -> Uniformity:
    """
    Measure how evenly points are spread over their surface.

    The coefficient of variation of the nearest-neighbour distances is 0 for a regular lattice and
    sqrt(4 / pi - 1) = 0.523 for points thrown at random on a plane (Clark and Evans 1954).

    Parameters
    ----------
    points : array_like, shape (N, 3)
        Points [m]; rows that are not finite are ignored.

    Returns
    -------
    Uniformity
        NaN for fewer than two points.
    """
    from nacre.kdtree import KdTree

    array = as_points("points", points)
    array = array[np.isfinite(array).all(axis=1)]
    if len(array) < 2:
        return Uniformity(np.nan, np.nan, np.nan, np.nan, np.nan, np.nan, num_points=len(array))
    distances = np.asarray(KdTree(array).query(array, k=2)[0], dtype=np.float64)[:, 1]
    mean, std = float(distances.mean()), float(distances.std())
    return Uniformity(
        mean=mean,
        std=std,
        min=float(distances.min()),
        max=float(distances.max()),
        coefficient_of_variation=std / mean if mean > 0 else np.nan,
        duplicates=float((distances < 0.5 * mean).mean()) if mean > 0 else 1.0,
        num_points=len(array),
    )
