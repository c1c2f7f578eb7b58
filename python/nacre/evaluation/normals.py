"""How far normals are from the true ones."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from nacre._internal.arrays import as_matching_points, as_points
from nacre._internal.guided import guided
from nacre.evaluation.result import Count, Fraction, Radians, Result


@dataclass(frozen=True, eq=False, repr=False)
class NormalError(Result):
    """Angles between normals and their references; made by :func:`normal_error`."""

    mean: Radians  #: from 0 to pi: the side counts
    p95: Radians
    unoriented_mean: Radians  #: from 0 to pi / 2: a flipped normal is as good
    unoriented_p95: Radians
    flipped: Fraction  #: normals on the wrong side
    beyond_30_degrees: Fraction  #: of the unoriented angles
    num_normals: Count  #: pairs that were compared


@guided()
@np.errstate(over="ignore", invalid="ignore")
def normal_error(normals: npt.ArrayLike, reference_normals: npt.ArrayLike) -> NormalError:
    """
    Measure the angles between normals and their references.

    Parameters
    ----------
    normals, reference_normals : array_like, shape (N, 3)
        Row by row; lengths do not matter. Rows that are not finite or zero in either are not compared.

    Returns
    -------
    NormalError
        NaN where no row can be compared.
    """
    array = as_points("normals", normals).astype(np.float64)
    reference = as_matching_points("reference_normals", reference_normals, "normals", len(array))
    reference = reference.astype(np.float64)
    dot = np.einsum("ij,ij->i", array, reference)
    cross = np.linalg.norm(np.cross(array, reference), axis=1)
    usable = np.isfinite(dot) & np.isfinite(cross) & ((dot != 0) | (cross != 0))
    if not usable.any():
        return NormalError(np.nan, np.nan, np.nan, np.nan, np.nan, np.nan, num_normals=0)
    angle = np.arctan2(cross[usable], dot[usable])
    unoriented = np.minimum(angle, np.pi - angle)
    return NormalError(
        mean=float(angle.mean()),
        p95=float(np.percentile(angle, 95)),
        unoriented_mean=float(unoriented.mean()),
        unoriented_p95=float(np.percentile(unoriented, 95)),
        flipped=float((angle > np.pi / 2).mean()),
        beyond_30_degrees=float((unoriented > np.pi / 6).mean()),
        num_normals=int(usable.sum()),
    )
