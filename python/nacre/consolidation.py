"""Few, evenly spread, denoised points in place of many noisy ones (WLOP)."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from nacre import _core
from nacre._internal.array_of_points import ArrayOfPoints
from nacre._internal.arrays import (
    FloatArray,
    as_count,
    as_dtype,
    as_length,
    as_matching_points,
    as_points,
    as_real,
    as_rows,
)
from nacre._internal.core_options import as_choice
from nacre._internal.guided import guided
from nacre._internal.value_equality import Value
from nacre.kdtree import KdTree
from nacre.progress import as_progress

if TYPE_CHECKING:
    from nacre.io.cloud import Cloud

_DENSITY_NEIGHBORS = 17  # itself included
_DENSITY_PROBES = 5000
SPACINGS_PER_RADIUS = 2.5

_METHODS = {
    "wlop": _core.ConsolidationMethod.wlop,
    "wlop+": _core.ConsolidationMethod.wlop_plus,
    "cgal": _core.ConsolidationMethod.cgal,
}
_THETAS = {"huang": _core.Theta.huang, "printed": _core.Theta.printed}


@dataclass(frozen=True, eq=False, repr=False)
class Consolidated(ArrayOfPoints, Value):
    """
    A consolidated point set.

    Attributes
    ----------
    points : (K, 3) array
        In the dtype of the input, float64 where that was neither float32 nor float64.
    attributes : dict of str to (K,) or (K, A) array
        What was carried along, in the input's dtypes.
    sources : (K,) int64 array, ascending
        The row of the input that each point started from.
    radius : float
        The support radius: as given, or from the density of the points.
    iterations : int
        That were done.
    cancelled : bool
        Whether ``progress`` ended it before the last iteration: the points are where they had come to by
        then, the attributes those of their sources.
    """

    points: FloatArray
    attributes: dict[str, npt.NDArray[Any]]
    sources: npt.NDArray[np.int64]
    radius: float
    iterations: int
    cancelled: bool

    def cloud(self) -> Cloud:
        """
        Return the points with their normals, colours and other attributes where a file has them.

        Returns
        -------
        Cloud
        """
        from nacre.io.cloud import Cloud

        more = dict(self.attributes)
        return Cloud(self.points, more.pop("normals", None), more.pop("colors", None), more)

    def __len__(self) -> int:
        return len(self.points)

    def __repr__(self) -> str:
        carried = "".join(f", {name} {a.dtype}{list(a.shape)}" for name, a in self.attributes.items())
        ended = f", cancelled after {self.iterations} iterations" * self.cancelled
        return f"Consolidated({len(self.points)} points {self.points.dtype}{carried}{ended})"

    def _repr_png_(self) -> bytes | None:
        from nacre.pictures.notebook import picture_of_points

        normals, colors = self.attributes.get("normals"), self.attributes.get("colors")
        return picture_of_points(self.points, normals, colors)


@guided(
    neighbor_radius="radius",
    iter_number="iterations",
    select_percentage="give num_points",
    h="radius",
)
def consolidate(
    points: npt.ArrayLike,
    *,
    radius: float | None = None,
    num_points: int | None = 2000,
    iterations: int = 10,
    mu: float = 0.4,
    method: str = "wlop",
    theta: str = "huang",
    attributes: npt.ArrayLike | Mapping[str, npt.ArrayLike] | None = None,
    seed: int = 0,
    num_threads: int = 0,
    progress: Callable[[int, int], bool | None] | None = None,
) -> Consolidated:
    """
    Replace a noisy point set by fewer, evenly spread points near its local medians (WLOP).

    ``num_points`` of the input are chosen at random. In each iteration a chosen point moves to the weighted
    mean of the input points within ``radius`` h, with weights theta(r) / r over the density of the input, and
    ``mu`` times away from its chosen neighbours. On curved surfaces the result lies slightly inside.

    Parameters
    ----------
    points : (N, 3) array of any real dtype
        Not changed. Rows that are not finite are ignored.
    radius : float, optional
        Support radius h, in the unit of the points. The spacing of the result should be at most about h / 2:
        points without neighbours within h cannot spread evenly. By default 2.5 times that spacing, from the
        density of the points: h = 2.5 r sqrt(pi N / (k K)) for K of N points on a surface, where r is the
        median distance to the k-th nearest point (k = 17, itself included).
    num_points : int or None
        Size of the result, at most the number of finite rows. None takes them all: points move, none is lost.
        For one seed, the points chosen for a smaller result are among those chosen for a larger one.
    iterations : int
        0 gives the random choice itself.
    mu : float
        Weight of the repulsion, 0 to 0.5.
    method : {"wlop", "wlop+", "cgal"}
        ``"wlop"`` is Huang et al. 2009, literally, with density weights for both sets. ``"wlop+"`` repels
        along the surface only, less where there are no near neighbours, and steps at most h / 4: less noise,
        no drift at the rims, better for anything but comparison with the paper. ``"cgal"`` is what CGAL's
        ``wlop_simplify_and_regularize_point_set`` computes by default: theta is exp(-4 r^2 / h^2), the
        weights are theta, the repulsion's theta / r^2 (there ``mu`` is 0.45 and ``iterations`` 35).
    theta : {"huang", "printed"}
        exp(-16 r^2 / h^2), or exp(-4 r^2 / h) as a later paper prints it, which depends on the unit of length
        and hardly falls within h when h is small. ``"cgal"`` uses neither.
    attributes : mapping of str to (N,) or (N, A) array, or one such array
        Values to carry along: normals, colours, intensities. Each result has the mean over the input points
        within h, with the weights that the last iteration drew it by. Values that are not finite are left
        out; where none remains, the value of the source stays. ``"normals"`` come back with unit length,
        integers rounded. Each column is averaged in float32 about its mean. A single array comes back as
        ``"attributes"``.
    seed : int
        Of the random choice, not negative.
    num_threads : int
        0 uses all. The result has the same bits for any number.
    progress : callable, optional
        Called after each iteration with how many are done and how many there are; what has been reached is
        the result where it returns False. What it raises comes out of ``consolidate``, as does Ctrl-C within
        an iteration.

    Returns
    -------
    Consolidated
        Points, attributes and sources.

    Raises
    ------
    TypeError, ValueError
        Naming the argument, what was expected and what came.

    References
    ----------
    Huang, Li, Zhang, Ascher, Cohen-Or: Consolidation of unorganized point clouds for surface reconstruction.
    ACM TOG 28(5), 2009. Lipman, Cohen-Or, Levin, Tal-Ezer: Parameterization-free projection for geometry
    reconstruction. ACM TOG 26(3), 2007.

    Examples
    --------
    >>> thin = nacre.consolidate(points, radius=0.008, attributes={"normals": normals, "colors": colors})
    >>> thin.points, thin.attributes["normals"]
    """
    array = as_points("points", points)
    options = _options(iterations, mu, method, theta, num_threads)
    wanted = len(array) if num_points is None else as_count("num_points", num_points, minimum=1)
    options.num_points = max(1, min(wanted, len(array)))
    options.seed = as_count("seed", seed)
    cargo = _Cargo(attributes, len(array))
    options.radius = _radius(radius, array, options.num_points)
    told = None if progress is None else as_progress("progress", progress)
    moved, carried, sources, done = _core.consolidate(array, options, cargo.columns, told)
    attributes = cargo.unpack(carried, sources)
    return Consolidated(moved, attributes, sources, options.radius, done, done < options.iterations)


@guided()
def project_samples(
    samples: npt.ArrayLike,
    points: npt.ArrayLike,
    *,
    radius: float | None = None,
    iterations: int = 10,
    mu: float = 0.4,
    method: str = "wlop",
    theta: str = "huang",
    point_weights: npt.ArrayLike | None = None,
    sample_normals: npt.ArrayLike | None = None,
    frozen: npt.ArrayLike | None = None,
    num_threads: int = 0,
) -> FloatArray:
    """
    Move samples by WLOP iterations among points that stay: :func:`consolidate` from samples of your own.

    Parameters
    ----------
    samples : (K, 3) array of any real dtype
        Not changed. A sample with no points within ``radius`` stays where it is.
    points : (N, 3) array of any real dtype
        What the samples are drawn to. Rows that are not finite are ignored.
    radius, iterations, mu, method, theta, num_threads
        As in :func:`consolidate`; the default radius is that of as many of its points as there are samples.
    point_weights : (N,) array, optional, method "wlop+" only
        How many observations each point stands for: a point of weight 2 counts as two points at its place.
    sample_normals : (K, 3) array, optional, method "wlop+" only
        Of the surface at the samples, of any length and sign: the samples repel each other in its tangent
        planes. Rows that are zero or not finite are estimated from the points, as all are without this.
    frozen : (K,) array, optional, method "wlop+" only
        Samples that stay where they are, and still repel the others, are not 0.

    Returns
    -------
    (K, 3) array in the dtype of the samples
        The moved samples.

    Raises
    ------
    TypeError, ValueError
        Naming the argument, what was expected and what came.
    """
    sample_array = as_points("samples", samples)
    point_array = as_points("points", points)
    options = _options(iterations, mu, method, theta, num_threads)
    hints = _core.ProjectionHints()
    if point_weights is not None:
        hints.point_weights = as_rows(
            _as_column("point_weights", point_weights, len(point_array)), np.float32
        )
    if sample_normals is not None:
        normals = as_matching_points("sample_normals", sample_normals, "samples", len(sample_array))
        hints.sample_normals = as_rows(normals, np.float32)
    if frozen is not None:
        hints.frozen = (_as_column("frozen", frozen, len(sample_array)) != 0).astype(np.uint8)
    options.radius = _radius(radius, point_array, max(len(sample_array), 1))
    common = np.promote_types(sample_array.dtype, point_array.dtype)
    moved = _core.project_samples(
        sample_array.astype(common, copy=False), point_array.astype(common, copy=False), options, hints
    )
    return moved.astype(np.float32) if sample_array.dtype == np.float32 else moved


def _options(
    iterations: int, mu: float, method: str, theta: str, num_threads: int
) -> _core.ConsolidateOptions:
    options = _core.ConsolidateOptions()
    options.iterations = as_count("iterations", iterations)
    options.mu = as_length("mu", mu)
    options.method = as_choice("method", method, _METHODS)
    options.theta = as_choice("theta", theta, _THETAS)
    options.num_threads = as_count("num_threads", num_threads)
    return options


def _radius(given: float | None, points: FloatArray, num_samples: int) -> float:
    """Return a support radius: the given one, or from how far apart so many of the points would be."""
    if given is not None:
        return as_length("radius", given)
    cloud = points[np.isfinite(points).all(axis=1)]
    if len(cloud) < 2:
        return 1.0  # nothing moves
    k = min(_DENSITY_NEIGHBORS, len(cloud))
    probes = cloud[:: max(len(cloud) // _DENSITY_PROBES, 1)]
    reach = float(np.median(KdTree(cloud).query(probes, k)[0][:, -1]))
    if not 0 < reach < math.inf:
        where = "on top of each other" if reach == 0 else "too far from each other"
        raise ValueError(f"radius must be given, got None: the points lie {where}")
    per_area = k * min(num_samples / len(cloud), 1.0) / math.pi  # [1 / reach^2]
    return SPACINGS_PER_RADIUS * reach / math.sqrt(per_area)


def _as_column(name: str, value: npt.ArrayLike, size: int) -> npt.NDArray[Any]:
    array = as_real(name, value)
    if array.shape != (size,):
        raise ValueError(f"{name} must have shape ({size},), got {array.shape}")
    return array


class _Cargo:
    """Attributes of any dtype as float32 columns about their means, and back."""

    def __init__(
        self, attributes: npt.ArrayLike | Mapping[str, npt.ArrayLike] | None, num_points: int
    ) -> None:
        if attributes is None:
            attributes = {}
        elif not isinstance(attributes, Mapping):
            attributes = {"attributes": attributes}
        self._arrays: dict[str, npt.NDArray[Any]] = {}
        self._means: dict[str, npt.NDArray[np.float64]] = {}
        blocks = [np.zeros((num_points, 0), dtype=np.float32)]
        for name, value in attributes.items():
            label = f"attributes[{name!r}]"
            array = as_real(label, value)
            if array.ndim not in (1, 2) or len(array) != num_points:
                expected = f"one row per point, ({num_points},) or ({num_points}, A)"
                raise ValueError(f"{label} must have {expected}, got shape {array.shape}")
            if name == "normals" and (array.dtype.kind != "f" or array.shape[1:] != (3,)):
                expected = f"floating-point of shape ({num_points}, 3)"
                raise ValueError(f"{label} must be {expected}, got {array.dtype} {array.shape}")
            rows = array.reshape(num_points, math.prod(array.shape[1:])).astype(np.float64, order="C")
            finite = np.isfinite(rows)
            mean = np.where(finite, rows, 0.0).sum(axis=0) / np.maximum(finite.sum(axis=0), 1)
            self._arrays[name] = array
            self._means[name] = mean
            with np.errstate(over="ignore"):
                blocks.append((rows - mean).astype(np.float32))
        self.columns = np.ascontiguousarray(np.hstack(blocks))

    def unpack(
        self, carried: npt.NDArray[np.float32], sources: npt.NDArray[np.int64]
    ) -> dict[str, npt.NDArray[Any]]:
        result: dict[str, npt.NDArray[Any]] = {}
        start = 0
        for name, array in self._arrays.items():
            mean = self._means[name]
            values = (carried[:, start : start + len(mean)] + mean).reshape(len(sources), *array.shape[1:])
            start += len(mean)
            if name == "normals":
                lengths = np.linalg.norm(values, axis=1, keepdims=True)
                values = np.divide(values, lengths, out=array[sources].astype(np.float64), where=lengths > 0)
            result[name] = as_dtype(values, array.dtype)
        return result
