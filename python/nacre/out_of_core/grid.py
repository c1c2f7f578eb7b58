"""The cubes of space that points are sorted into, and the cells that are made of them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from nacre._internal.cubes import cube_numbers
from nacre.out_of_core.survey import Survey

Keys = npt.NDArray[np.int64]

_SPACINGS_PER_SIDE = 64.0  # a few thousand points of a surface in each cube
_MOST_PER_AXIS = 1 << 20  # whose product an int64 holds


@dataclass(frozen=True)
class Grid:
    """
    Cubes that fill the bounding box of a cloud; they follow from its points alone.

    Attributes
    ----------
    origin : (3,) float64
        The corner of the first cube, a multiple of the side.
    side : float
        A power of two, so that nothing is rounded.
    shape : (3,) int64
        How many cubes there are along each axis.
    """

    origin: npt.NDArray[np.float64]
    side: float
    shape: npt.NDArray[np.int64]

    @classmethod
    def of(cls, survey: Survey) -> Grid:
        """Return cubes that hold some thousand points each, where the cloud is a surface."""
        extent = float((survey.upper - survey.lower).max())
        smallest = max(float(np.abs([survey.lower, survey.upper]).max()) * 1e-12, 1e-300)
        wanted = max(_SPACINGS_PER_SIDE * survey.spacing, 2 * extent / _MOST_PER_AXIS, smallest)
        side = 2.0 ** round(math.log2(wanted))
        first = np.floor(survey.lower / side)
        return cls(first * side, side, (np.floor(survey.upper / side) - first).astype(np.int64) + 1)

    def keys(self, points: npt.NDArray[np.floating]) -> Keys:
        """Return the number of the cube that each point lies in."""
        return cube_numbers(points, self.origin, self.side, self.shape)

    def places(self, keys: Keys) -> npt.NDArray[np.int64]:
        """Return where cubes stand along the three axes, (K, 3)."""
        first, z = np.divmod(keys, self.shape[2])
        x, y = np.divmod(first, self.shape[1])
        return np.column_stack([x, y, z])


def divide_into_cells(
    places: npt.NDArray[np.int64], counts: npt.NDArray[np.int64], most: int
) -> list[npt.NDArray[np.intp]]:
    """
    Divide cubes into boxes of at most so many points, as a k-d tree does.

    Parameters
    ----------
    places : (K, 3) int64
        Where the cubes stand, in ascending order.
    counts : (K,) int64
        Their points.
    most : int
        A box is cut across its longest side, between two layers of cubes and as near as can be to the middle
        of its points, while it has more points than this; a single cube is never cut.

    Returns
    -------
    list of (n,) intp
        The cubes of each box.
    """
    cells: list[npt.NDArray[np.intp]] = []
    left = [np.arange(len(places))]
    while left:
        cubes = left.pop()
        here = places[cubes]
        lower, sizes = here.min(axis=0), np.ptp(here, axis=0)
        axis = int(np.argmax(sizes))
        if counts[cubes].sum() <= most or sizes[axis] == 0:
            cells.append(cubes)
            continue
        layers = here[:, axis] - lower[axis]
        below = np.cumsum(np.bincount(layers, counts[cubes]))[:-1]
        is_first = layers <= int(np.argmin(np.abs(below - counts[cubes].sum() / 2)))
        left += [cubes[~is_first], cubes[is_first]]
    return cells
