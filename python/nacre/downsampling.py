"""One point in place of all that share a cube of a grid."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from nacre._internal.arrays import as_colors, as_dtype, as_length, as_real, as_unit_rows
from nacre._internal.guided import guided

if TYPE_CHECKING:
    from nacre.io.cloud import Cloud


@guided(
    leaf_size="voxel_size", resolution="voxel_size", downsampling_resolution="voxel_size", size="voxel_size"
)
def voxel_downsample(
    points: Any,
    voxel_size: float,
    *,
    normals: npt.ArrayLike | None = None,
    colors: npt.ArrayLike | None = None,
    attributes: Mapping[str, npt.ArrayLike] | None = None,
) -> Cloud:
    """
    Replace the points of each cube of a grid by their mean.

    The cubes have the origin for a corner, so that clouds of one frame share them. Where points are noisy,
    :func:`nacre.consolidate` spreads them evenly and denoises them.

    Parameters
    ----------
    points : (N, 3) array_like, or Cloud, Model, Reconstruction or Consolidated
        Rows that are not finite are left out. What has normals, colours and attributes of its own (a model
        its :meth:`~nacre.Model.cloud`) brings them along, where no others are given.
    voxel_size : float
        Edge of a cube, in the unit of the points.
    normals : (N, 3) array, optional
        Of any length. Each result has the mean direction of those known, in float32; NaN where they cancel.
    colors : (N, 3) array of integers from 0 to 255, or of floats from 0 to 1, optional
        Averaged and rounded.
    attributes : mapping of str to (N,) or (N, A) array, optional
        In their own types: of integers, which may be classes, the most common (of several, the one nearest
        to the mean); of others the mean of those that are finite.

    Returns
    -------
    Cloud
        A point for each cube that holds any, in the order of the cubes: along x, then y, then z.

    Raises
    ------
    TypeError, ValueError
        Naming the argument, what was expected and what came.

    Examples
    --------
    >>> thin = nacre.voxel_downsample([[0.1, 0.1, 0.1], [0.3, 0.1, 0.1], [1.2, 0.1, 0.1]], 1.0)
    >>> thin.points
    array([[0.2, 0.1, 0.1],
           [1.2, 0.1, 0.1]])
    """
    from nacre.io.cloud import Cloud, cloud_of

    cloud = cloud_of(points)
    count = len(cloud)
    size = as_length("voxel_size", voxel_size)
    if not 0 < size < np.inf:
        raise ValueError(f"voxel_size must be positive and finite, got {size}")
    is_finite = np.isfinite(cloud.points).all(axis=1)
    voxels = _Voxels(cloud.points[is_finite], size)

    thin_normals = thin_colors = None
    if (given := cloud.normals if normals is None else normals) is not None:
        rows = as_unit_rows("normals", given, "points", count)[is_finite]
        thin_normals = _unit_length(voxels.mean(rows, rows.dtype))
    if (given := cloud.colors if colors is None else colors) is not None:
        thin_colors = voxels.mean(as_colors("colors", given, (count, 3))[is_finite], np.dtype(np.uint8))
    thin_attributes = {}
    for name, values in (cloud.attributes if attributes is None else attributes).items():
        array = as_real(f"attributes[{name!r}]", values)
        if array.ndim not in (1, 2) or len(array) != count:
            raise ValueError(
                f"attributes[{name!r}] must have one row per point, ({count},) or ({count}, A), "
                f"got {array.shape}"
            )
        rows = array[is_finite]
        thin_attributes[name] = voxels.mean(rows, rows.dtype) if rows.dtype.kind == "f" else voxels.mode(rows)
    return Cloud(
        voxels.mean(cloud.points[is_finite], cloud.points.dtype), thin_normals, thin_colors, thin_attributes
    )


class _Voxels:
    """The rows that share a voxel, and what stands for them."""

    def __init__(self, points: npt.NDArray[Any], size: float) -> None:
        with np.errstate(over="ignore"):
            voxels = np.floor(points.astype(np.float64) / size)
        if not np.isfinite(voxels).all():
            raise ValueError(f"voxel_size must not be so small beside the points' coordinates, got {size}")
        self._order = np.lexsort(voxels.T[::-1])
        ordered = voxels[self._order]
        begins = np.ones(len(ordered), bool)
        begins[1:] = (ordered[1:] != ordered[:-1]).any(axis=1)
        self._starts = np.flatnonzero(begins)

    def mean(self, values: npt.NDArray[Any], dtype: np.dtype[Any]) -> npt.NDArray[Any]:
        """Return the mean of each voxel's finite values, NaN where there are none."""
        rows = values.astype(np.float64)[self._order]
        if not len(rows):
            return values
        is_known = np.isfinite(rows)
        counts = np.add.reduceat(is_known, self._starts, axis=0, dtype=np.int64)
        sums = np.add.reduceat(np.where(is_known, rows, 0.0), self._starts, axis=0)
        return as_dtype(np.divide(sums, counts, out=np.full_like(sums, np.nan), where=counts > 0), dtype)

    def mode(self, values: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """Return each voxel's most common values; of several, the one nearest to the mean."""
        if not len(values):
            return values
        columns = values.reshape(len(values), -1).T
        modes = [self._mode(column[self._order]) for column in columns]
        return np.stack(modes, axis=1).reshape(-1, *values.shape[1:])

    def _mode(self, ordered: npt.NDArray[Any]) -> npt.NDArray[Any]:
        sizes = np.diff(self._starts, append=len(ordered))
        voxel = np.repeat(np.arange(len(sizes)), sizes)
        means = np.add.reduceat(ordered, self._starts, dtype=np.float64) / sizes
        by_value = np.lexsort((ordered, voxel))
        values, voxel = ordered[by_value], voxel[by_value]
        begins = np.ones(len(values), bool)
        begins[1:] = (voxel[1:] != voxel[:-1]) | (values[1:] != values[:-1])
        runs = np.flatnonzero(begins)
        counts = np.diff(runs, append=len(values))
        values, voxel = values[runs], voxel[runs]
        best = np.lexsort((values, np.abs(values - means[voxel]), -counts, voxel))
        return values[best[np.searchsorted(voxel, np.arange(len(sizes)))]]


def _unit_length(normals: npt.NDArray[Any]) -> npt.NDArray[Any]:
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    unit: npt.NDArray[Any] = np.full_like(normals, np.nan)
    np.divide(normals, lengths, out=unit, where=lengths > _CANCELLED)
    return unit


_CANCELLED = 1e-6
"""The length of a mean of unit vectors that has no direction: rounding in float32."""
