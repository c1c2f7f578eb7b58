"""How far model points are from a reference surface, and how much of the surface they cover."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from nacre._internal.arrays import as_array, as_count, as_matching_points, as_points, as_real
from nacre._internal.guided import guided
from nacre.evaluation.result import Array, Count, ManyFractions, ManyMetres, Metres, Result
from nacre.mesh import Mesh


class SurfaceSamples(NamedTuple):
    """Points on a mesh, with the normal and the index of the triangle that each lies on."""

    points: Array
    normals: Array
    triangles: npt.NDArray[np.intp]


@dataclass(frozen=True, eq=False, repr=False)
class SurfaceAccuracy(Result):
    """Distances from model points to the reference surface; made by :func:`surface_accuracy`."""

    rms: Metres
    mean: Metres
    median: Metres
    p95: Metres
    max: Metres
    bias: Metres  #: mean signed distance, positive outside; NaN without normals
    num_points: Count  #: points that are finite
    distances: Array = field(repr=False)  #: one per point [m], NaN where the point is not finite


@dataclass(frozen=True, eq=False, repr=False)
class Completeness(Result):
    """How much of the reference surface the model covers; made by :func:`completeness`."""

    tau: ManyMetres  #: how near a model point must be
    fraction: ManyFractions  #: part of the surface that is covered, for each tau
    mean: Metres  #: distance from the surface to the nearest model point
    p95: Metres
    p99: Metres  #: the coverage radius
    num_samples: Count  #: surface samples that were asked for and seen


@dataclass(frozen=True, eq=False, repr=False)
class FScore(Result):
    """Precision, recall and their harmonic mean for each threshold; made by :func:`f_score`."""

    tau: ManyMetres
    precision: ManyFractions  #: part of the model within tau of the reference
    recall: ManyFractions  #: part of the reference within tau of a model point
    f_score: ManyFractions


_MOST_SAMPLES = 10_000_000  # what memory surely holds


@guided("it is sample_surface(mesh.vertices, mesh.triangles, num_samples)")
@np.errstate(over="ignore", invalid="ignore")
def sample_surface(
    vertices: npt.ArrayLike, triangles: npt.ArrayLike, num_samples: int = 100_000, *, seed: int = 0
) -> SurfaceSamples:
    """
    Throw points on a triangle mesh, uniformly over its area.

    Parameters
    ----------
    vertices : array_like, shape (V, 3)
        Corners [m].
    triangles : array_like of int, shape (T, 3)
        Rows of ``vertices``; counter-clockwise seen from outside.
    num_samples : int, optional
        How many points. Areas are stratified: each part of the surface gets its share to within one point.
    seed : int, optional
        The same seed gives the same points.

    Returns
    -------
    SurfaceSamples
        ``points`` (num_samples, 3), unit ``normals`` (num_samples, 3), ``triangles`` (num_samples,).

    Raises
    ------
    ValueError
        When a triangle names a vertex that is not there, or the mesh has no area.
    """
    corners = as_points("vertices", vertices).astype(np.float64)
    faces = as_array("triangles", triangles)
    if faces.ndim != 2 or faces.shape[1] != 3 or faces.dtype.kind not in "ui":
        raise ValueError(f"triangles must be whole numbers of shape (T, 3), got {faces.dtype} {faces.shape}")
    if len(faces) and not (faces.min() >= 0 and faces.max() < len(corners)):
        raise ValueError(
            f"triangles must name rows of vertices (0 to {len(corners) - 1}), "
            f"got {faces.min()} to {faces.max()}"
        )
    num_samples, seed = as_count("num_samples", num_samples, minimum=1), as_count("seed", seed)
    if num_samples > _MOST_SAMPLES:
        raise ValueError(f"num_samples must be at most {_MOST_SAMPLES}, got {num_samples}")
    a, b, c = (corners[faces[:, i]] for i in range(3))
    cross = np.cross(b - a, c - a)
    doubled_area = np.linalg.norm(cross, axis=1)
    cumulative = np.cumsum(doubled_area)
    if not len(cumulative) or not (np.isfinite(cumulative[-1]) and cumulative[-1] > 0):
        area = 0.5 * cumulative[-1] if len(cumulative) else 0.0
        raise ValueError(f"triangles must have finite vertices and an area, got one of {area}")
    random = np.random.default_rng(seed)
    strata = (np.arange(num_samples) + random.random(num_samples)) / num_samples
    chosen = np.minimum(np.searchsorted(cumulative, strata * cumulative[-1], side="right"), len(faces) - 1)
    u, v = random.random((2, num_samples, 1))
    u = np.sqrt(u)  # Osada et al. 2002, eq. 1: uniform over the triangle
    points = (1 - u) * a[chosen] + u * (1 - v) * b[chosen] + u * v * c[chosen]
    return SurfaceSamples(points, cross[chosen] / doubled_area[chosen, None], chosen)


@guided()
@np.errstate(over="ignore", invalid="ignore")
def surface_accuracy(
    points: npt.ArrayLike, reference: Mesh | npt.ArrayLike, *, reference_normals: npt.ArrayLike | None = None
) -> SurfaceAccuracy:
    """
    Measure how far model points are from a reference surface.

    Parameters
    ----------
    points : array_like, shape (N, 3)
        The model [m]; rows that are not finite are ignored.
    reference : Mesh or array_like, shape (M, 3)
        A mesh (exact distances), or a dense cloud of surface points [m].
    reference_normals : array_like, shape (M, 3), optional
        Outward unit normals of a reference cloud. Each of its points then stands for a small disk instead of
        a point, so that the distance does not contain the spacing of the cloud.

    Returns
    -------
    SurfaceAccuracy
        NaN where no point is finite.

    Notes
    -----
    ``bias`` is the mean of the distances with their sign, so that it shows a model that has shrunk or grown
    while noise averages out. The sign is the side of the nearest triangle (or disk) on which the point lies.
    """
    array = as_points("points", points).astype(np.float64)
    finite = np.isfinite(array).all(axis=1)
    used = array[finite]
    distances = np.full(len(array), np.nan)
    if not len(used):
        return SurfaceAccuracy(np.nan, np.nan, np.nan, np.nan, np.nan, np.nan, 0, distances)
    if isinstance(reference, Mesh):
        if reference_normals is not None:
            raise ValueError("reference_normals must not be given for a mesh, which has its own")
        closest = reference.closest(used)
        heights = np.einsum("ij,ij->i", used - closest.points, closest.normals)
        distances[finite], signed = closest.distances, np.copysign(closest.distances, heights)
    else:
        cloud, normals = _as_reference(reference, reference_normals)
        if normals is None:
            distances[finite] = _nearest(cloud, used)[0]
            signed = np.full(len(used), np.nan)
        else:
            distances[finite], heights = _to_disks(used, cloud, normals)
            signed = np.copysign(distances[finite], heights)
    known = distances[finite]
    return SurfaceAccuracy(
        rms=float(np.sqrt((known**2).mean())),
        mean=float(known.mean()),
        median=float(np.median(known)),
        p95=float(np.percentile(known, 95)),
        max=float(known.max()),
        bias=float(signed.mean()),
        num_points=len(used),
        distances=distances,
    )


@guided()
@np.errstate(over="ignore", invalid="ignore")
def completeness(
    points: npt.ArrayLike,
    reference: Mesh | npt.ArrayLike,
    *,
    tau: float | Sequence[float] = (0.005, 0.010, 0.020),
    seen: npt.ArrayLike | None = None,
    num_samples: int = 100_000,
    seed: int = 0,
) -> Completeness:
    """
    Measure how much of a reference surface the model covers.

    Parameters
    ----------
    points : array_like, shape (N, 3)
        The model [m]; rows that are not finite are ignored.
    reference : Mesh or array_like, shape (M, 3)
        A mesh, of which ``num_samples`` points are drawn with :func:`sample_surface`, or surface samples [m].
    tau : float or sequence of float, optional
        A surface sample is covered when a model point is as near as this [m].
    seen : array_like of bool, shape (M,) or (num_samples,), optional
        Samples that a camera saw; the others do not count.
    num_samples, seed : int, optional
        As in :func:`sample_surface`; for a mesh.

    Returns
    -------
    Completeness
        With an empty model every fraction is 0 and every distance infinite.
    """
    thresholds = as_thresholds(tau)
    if isinstance(reference, Mesh):
        samples = sample_surface(reference.vertices, reference.triangles, num_samples, seed=seed).points
    else:
        samples = as_points("reference", reference).astype(np.float64)
    if seen is not None:
        mask = as_real("seen", seen)
        if mask.shape != (len(samples),):
            raise ValueError(f"seen must have one entry per sample ({len(samples)}), got shape {mask.shape}")
        samples = samples[mask.astype(bool)]
    samples = samples[np.isfinite(samples).all(axis=1)]
    if not len(samples):
        return Completeness(thresholds, (np.nan,) * len(thresholds), np.nan, np.nan, np.nan, num_samples=0)
    model = as_points("points", points).astype(np.float64)
    model = model[np.isfinite(model).all(axis=1)]
    return completeness_of(
        _nearest(model, samples)[0] if len(model) else np.full(len(samples), np.inf), thresholds
    )


def completeness_of(distances: Array, tau: tuple[float, ...]) -> Completeness:
    """Return the figures of surface samples that are so far from the model; infinite where it is empty."""
    p95, p99 = np.percentile(distances, (95, 99)) if np.isfinite(distances).all() else (np.inf, np.inf)
    return Completeness(
        tau=tau,
        fraction=tuple(float((distances <= threshold).mean()) for threshold in tau),
        mean=float(distances.mean()),
        p95=float(p95),
        p99=float(p99),
        num_samples=len(distances),
    )


@guided()
@np.errstate(over="ignore", invalid="ignore")
def f_score(
    points: npt.ArrayLike,
    reference: Mesh | npt.ArrayLike,
    *,
    tau: float | Sequence[float] = (0.005, 0.010, 0.020),
    reference_normals: npt.ArrayLike | None = None,
    seen: npt.ArrayLike | None = None,
    num_samples: int = 100_000,
    seed: int = 0,
) -> FScore:
    """
    Measure precision, recall and F-score of a model (Knapitsch et al., Tanks and Temples, 2017).

    Precision is the part of the model within ``tau`` of the reference, recall the part of the reference
    within ``tau`` of the model (:func:`completeness`), F their harmonic mean.

    Parameters
    ----------
    points, reference, reference_normals
        As in :func:`surface_accuracy`.
    tau, seen, num_samples, seed
        As in :func:`completeness`.

    Returns
    -------
    FScore
    """
    thresholds = as_thresholds(tau)
    distances = surface_accuracy(points, reference, reference_normals=reference_normals).distances
    distances = distances[~np.isnan(distances)]
    precision = tuple(float((distances <= t).mean()) if len(distances) else 0.0 for t in thresholds)
    covered = completeness(points, reference, tau=thresholds, seen=seen, num_samples=num_samples, seed=seed)
    return f_score_of(precision, covered)


def f_score_of(precision: tuple[float, ...], covered: Completeness) -> FScore:
    """Return the F-scores of precisions and recalls."""
    f_scores = tuple(map(_harmonic_mean, precision, covered.fraction))
    return FScore(covered.tau, precision, covered.fraction, f_scores)


def _harmonic_mean(a: float, b: float) -> float:
    return a + b if a + b == 0 else 2 * a * b / (a + b)


def as_thresholds(tau: float | Sequence[float]) -> tuple[float, ...]:
    """Return positive distances, one or more."""
    given = np.atleast_1d(as_real("tau", tau))
    thresholds = tuple(float(t) for t in given.reshape(-1))
    if given.ndim > 1 or not thresholds or not all(np.isfinite(t) and t > 0 for t in thresholds):
        raise ValueError(f"tau must be one or more positive distances, got {tau!r}")
    return thresholds


def _as_reference(reference: Any, reference_normals: npt.ArrayLike | None) -> tuple[Array, Array | None]:
    cloud = as_points("reference", reference).astype(np.float64)
    usable = np.isfinite(cloud).all(axis=1)
    normals: Array | None = None
    if reference_normals is not None:
        given = as_matching_points("reference_normals", reference_normals, "reference", len(cloud))
        usable &= np.isfinite(given).all(axis=1)
        normals = given[usable].astype(np.float64)
    if not usable.any():
        rows = "" if reference_normals is None else " with a finite row of reference_normals"
        raise ValueError(
            f"reference must have at least one finite point{rows}, got {len(cloud)} that are not"
        )
    return cloud[usable], normals


def _nearest(cloud: Array, queries: Array) -> tuple[Array, npt.NDArray[np.int64]]:
    from nacre.kdtree import KdTree

    distances, indices = KdTree(cloud).query(queries, k=1)
    return np.asarray(distances, dtype=np.float64), np.asarray(indices, dtype=np.int64)


def _to_disks(points: Array, cloud: Array, normals: Array) -> tuple[Array, Array]:
    """
    Return the distance to the disk around the nearest cloud point, and the signed height above its plane.

    A disk reaches as far as the surface may be from its nearest cloud point: three times the median spacing.
    """
    from nacre.kdtree import KdTree

    radius = 0.0
    if len(cloud) > 1:
        probes = cloud[:: max(len(cloud) // 10_000, 1)]
        radius = 3 * float(np.median(np.asarray(KdTree(cloud).query(probes, k=2)[0])[:, 1]))
    distances, indices = _nearest(cloud, points)
    heights = np.einsum("ij,ij->i", points - cloud[indices], normals[indices])
    offsets = np.sqrt(np.maximum(distances**2 - heights**2, 0))
    return np.hypot(heights, np.maximum(offsets - radius, 0)), heights
