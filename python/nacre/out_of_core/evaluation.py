"""How good clouds larger than memory are, beside a surface that fits in memory."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, BinaryIO

import numpy as np
import numpy.typing as npt

from nacre._internal.arrays import as_points
from nacre._internal.guided import guided
from nacre._internal.value_equality import Value
from nacre.evaluation.surface import (
    Completeness,
    FScore,
    SurfaceAccuracy,
    as_thresholds,
    completeness_of,
    f_score_of,
    sample_surface,
    surface_accuracy,
)
from nacre.kdtree import KdTree
from nacre.mesh import Mesh
from nacre.out_of_core.hashes import LowestHashes
from nacre.out_of_core.memory import as_bytes
from nacre.out_of_core.survey import PathLike, Source, finite_rows, survey

_ROWS_AT_ONCE = 1 << 20


@dataclass(frozen=True, eq=False, repr=False)
class SurfaceEvaluation(Value):
    """
    What :func:`evaluate` found.

    Attributes
    ----------
    surface_accuracy : SurfaceAccuracy
        Its ``distances`` are left empty.
    completeness : Completeness
    f_score : FScore
    """

    surface_accuracy: SurfaceAccuracy
    completeness: Completeness
    f_score: FScore


@guided("a point file or a folder of them, and a mesh or points that it should lie on")
def evaluate(
    source: PathLike | Iterable[PathLike],
    reference: Mesh | npt.ArrayLike,
    *,
    reference_normals: npt.ArrayLike | None = None,
    tau: float | Sequence[float] = (0.005, 0.010, 0.020),
    memory: int | str | None = None,
) -> SurfaceEvaluation:
    """
    Measure a cloud that may be larger than memory against a reference surface that is not.

    As :func:`nacre.evaluation.surface_accuracy`, :func:`nacre.evaluation.completeness` and
    :func:`nacre.evaluation.f_score`.

    Parameters
    ----------
    source : path-like, or iterable of path-like
        As in :func:`nacre.out_of_core.consolidate`.
    reference, reference_normals, tau
        As in :func:`nacre.evaluation.f_score`.
    memory : int or str, optional
        As in :func:`nacre.out_of_core.consolidate`; the reference comes on top.

    Returns
    -------
    SurfaceEvaluation

    Raises
    ------
    TypeError, ValueError, FileFormatError, OSError, ImportError
        As :func:`nacre.out_of_core.consolidate` does.

    Examples
    --------
    >>> evaluate("scans", nacre.read_mesh("hall.ply"), tau=0.01).f_score  # doctest: +SKIP
    """
    thresholds = as_thresholds(tau)
    files = Source.of(source)
    files.check_memory(as_bytes("memory", memory))
    if isinstance(reference, Mesh):
        samples = sample_surface(reference.vertices, reference.triangles).points
    else:
        samples = as_points("reference", reference).astype(np.float64)
        samples = samples[np.isfinite(samples).all(axis=1)]
    of = survey(files, _ROWS_AT_ONCE)
    sums = np.zeros(4)  # of distances, their squares, their signs, and points
    within = np.zeros(len(thresholds), np.int64)
    largest = 0.0
    nearest = np.full(len(samples), np.inf)
    ranks = {q: LowestHashes(max(1, math.ceil(q * of.num_points))) for q in (0.5, 0.95)}
    with tempfile.TemporaryFile() as stream:
        for rows in finite_rows(files, of, _ROWS_AT_ONCE):
            points = rows["points"].astype(np.float64)
            part = surface_accuracy(points, reference, reference_normals=reference_normals)
            if not len(points):
                continue
            count = len(points)
            sums += [part.mean * count, part.rms**2 * count, part.bias * count, count]
            largest = max(largest, part.max)
            within += [(part.distances <= t).sum() for t in thresholds]
            nearest = np.minimum(nearest, KdTree(points).query(samples, 1)[0])
            part.distances.tofile(stream)
            for rank in ranks.values():
                rank.count(part.distances.view(np.uint64))
        for distances in _read_again(stream):
            for rank in ranks.values():
                rank.keep(distances.view(np.uint64))
    median, p95 = (float(np.uint64(rank.highest()).view(np.float64)) for rank in ranks.values())
    mean, square, bias = sums[:3] / sums[3]
    covered = completeness_of(nearest, thresholds)
    precision = tuple((within / sums[3]).tolist())
    return SurfaceEvaluation(
        SurfaceAccuracy(
            math.sqrt(square), float(mean), median, p95, largest, float(bias), of.num_points, np.zeros(0)
        ),
        covered,
        f_score_of(precision, covered),
    )


def _read_again(stream: BinaryIO | Any) -> Iterator[npt.NDArray[np.float64]]:
    """Yield the numbers of a file; the bits of those that are not negative have the same order as they."""
    stream.seek(0)
    while len(numbers := np.fromfile(stream, np.float64, _ROWS_AT_ONCE)):
        yield numbers
