"""Registration of two clouds by iterative closest point (ICP)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre import _core
from nacre._internal.arrays import (
    FloatArray,
    as_count,
    as_points,
    as_pose,
    as_real,
    as_rows,
    as_unit_rows,
    localize,
)
from nacre._internal.core_options import mirrored, to_core
from nacre._internal.guided import guided
from nacre._internal.value_equality import Value
from nacre.parameters import Method, RegistrationParameters


@dataclass(frozen=True, eq=False, repr=False)
class AlignResult(Value):
    """
    The outcome of :func:`align`.

    Attributes
    ----------
    target_from_source : (4, 4) float64
        The rigid motion that brings source onto target; the initial one where ``status`` is "too_few_pairs".
    status : str
        "converged": the last steps were below the accuracy of the data. "max_iterations": still moving.
        "too_few_pairs": nothing, or too little, matched.
    iterations : int
        Steps that were made.
    num_inliers : int
        Pairs inside the last gate, of the source points that were used.
    overlap : float
        ``num_inliers`` divided by the number of source points that were used.
    rmse : float
        Root mean square of the inliers' residuals along the normals (of their distances, for
        "point_to_point") [m]; NaN where nothing matched.
    information : (6, 6) float64
        Inverse covariance of the pose, for a twist (rotation [rad], translation [m]) about ``center`` in the
        target's frame. Residuals count as the independent ones that they are worth; what the target errs by
        is not in it.
    weak_directions : (K, 6) float64
        Unit twists about ``center``, rotations in units of the inliers' extent, that the data does not
        determine; the pose keeps its initial value along them. K is 0 for a well determined pose, 3 for a
        plane.
    center : (3,) float64
        Centroid of the inliers, in the target's frame [m].
    """

    target_from_source: npt.NDArray[np.float64]
    status: str
    iterations: int
    num_inliers: int
    overlap: float
    rmse: float
    information: npt.NDArray[np.float64]
    weak_directions: npt.NDArray[np.float64]
    center: npt.NDArray[np.float64]

    @property
    def converged(self) -> bool:
        """Whether the pose came to rest."""
        return self.status == "converged"

    def __repr__(self) -> str:
        return (
            f"AlignResult({self.status}, iterations={self.iterations}, num_inliers={self.num_inliers}, "
            f"overlap={self.overlap:.3f}, rmse={self.rmse:.3g} m, {len(self.weak_directions)} weak)"
        )


def _cloud(
    name: str, points: npt.ArrayLike, normals: npt.ArrayLike | None, sigma: npt.ArrayLike | None
) -> tuple[FloatArray, npt.NDArray[np.float32], npt.NDArray[np.float32]]:
    points = as_points(name, points)
    rows = np.zeros((0, 3), np.float32)
    if normals is not None:
        rows = as_unit_rows(f"{name}_normals", normals, name, len(points))
    values = np.zeros(0, np.float32)
    if sigma is not None:
        values = as_rows(as_real(f"{name}_sigma", sigma), np.float32)
        if values.shape != (len(points),):
            raise ValueError(
                f"{name}_sigma must have one value per point of {name} ({len(points)}), got {values.shape}"
            )
        if (values <= 0).any():
            raise ValueError(f"{name}_sigma must be positive (NaN: not used), got {values[values <= 0][0]}")
    return points, rows, values


def _brightness(name: str, colors: npt.ArrayLike | None, num_points: int) -> npt.NDArray[np.float32]:
    """Return one value a point (luma of ITU-R BT.601 for three), or none."""
    if colors is None:
        return np.zeros(0, np.float32)
    given = as_real(name, colors)
    if given.dtype.kind == "f" and given.size and np.nanmax(given, initial=0.0) <= 1:
        given = given * 255
    if given.shape not in ((num_points,), (num_points, 3)):
        raise ValueError(f"{name} must have shape ({num_points},) or ({num_points}, 3), got {given.shape}")
    luma = given @ np.array([0.299, 0.587, 0.114]) if given.ndim == 2 else given
    return as_rows(luma, np.float32)


def _shifted(
    pose: npt.NDArray[np.float64], source: npt.NDArray[Any], target: npt.NDArray[Any]
) -> npt.NDArray[np.float64]:
    """Return a motion between frames as one between frames about the given origins."""
    moved = pose.copy()
    moved[:3, 3] += pose[:3, :3] @ source - target
    return moved


@guided(
    max_correspondence_distance="max_distance",
    threshold="max_distance",
    init="initial",
    init_T_target_source="initial",
    registration_type="method",
    estimation_method="method",
    max_iteration="max_iterations",
)
def align(
    source: npt.ArrayLike,
    target: npt.ArrayLike,
    *,
    source_normals: npt.ArrayLike | None = None,
    target_normals: npt.ArrayLike | None = None,
    source_sigma: npt.ArrayLike | None = None,
    target_sigma: npt.ArrayLike | None = None,
    source_colors: npt.ArrayLike | None = None,
    target_colors: npt.ArrayLike | None = None,
    initial: npt.ArrayLike | None = None,
    method: Method = "symmetric",
    max_iterations: int = 40,
    max_distance: float = 0.0,
    final_distance: float = 0.0,
    gate_decay: float = 0.7,
    max_angle: float = 0.7853982,
    robust: bool = True,
    sample_fraction: float = 1.0,
    max_points: int = 10000,
    max_samples: int = 5000,
    coarse_samples: int = 600,
    keep_best: bool = False,
    weak_threshold: float = 0.002,
    seed: int = 0,
    num_threads: int = 0,
) -> AlignResult:
    """
    Find the rigid motion that brings one cloud onto another, from a first guess.

    Iterative closest point: each source point is paired with its nearest target point, pairs that are too far
    apart or whose normals disagree are dropped, the motion that reduces the residuals of the rest is applied,
    and again. The gate on distances starts wide and shrinks; the points become more as it does.

    Parameters
    ----------
    source, target : (N, 3), (M, 3) real
        Points [m]. Rows that are not finite are ignored. float32 and float64 arrays that are C-contiguous are
        not copied, but float64 is converted to float32 about its centre.
    source_normals, target_normals : (N, 3), (M, 3) real, optional
        Normals; a point whose normal is 0 or not finite is left out. Estimated from the 16 nearest neighbours
        where the method needs them and they are not given; then their sides are ignored.
    source_sigma, target_sigma : (N,), (M,) real, optional
        Standard deviation of each point along its normal [m]; pairs count by 1 / (sum of squares).
    source_colors, target_colors : (N,) or (N, 3), (M,) or (M, 3) real, optional
        Brightness, or red, green and blue, on a scale to 255, or floats from 0 to 1; NaN where unknown. Where
        both clouds have them, they decide the directions of the pose that the shapes leave open (a textured
        plane, a labelled bottle) and nothing else; gain and offset between the two clouds are found along the
        way.
    initial : (4, 4), optional
        First guess of ``target_from_source``; the identity by default.
    method : "symmetric", "point_to_plane", "point_to_point" or "paper"
        What a pair costs: Rusinkiewicz 2019; Chen and Medioni 1992; Besl and McKay 1992. ``"paper"`` is point
        to plane as Blackburn, Kubacki and Stratton 2010 iterate it: every iteration draws its own
        ``sample_fraction``, and ``max_distance`` is along the target's normal and stays; ``final_distance``,
        ``gate_decay``, ``robust``, ``max_points``, ``coarse_samples``, sigmas and colours are not used.
    max_iterations : int
        Largest number of steps on the shapes; what colours decide takes a few more.
    max_distance : float
        Gate on the distance of a pair in the first iteration [m]; 0: a quarter of the target's diameter.
    final_distance : float
        The gate shrinks to this [m]; 0: from the target's spacing and the residuals.
    gate_decay : float
        Factor on the gate at each iteration; 1 keeps it at ``max_distance``.
    max_angle : float
        Gate on the angle between the normals of a pair [rad].
    robust : bool
        Weights of Geman and McClure on the residuals.
    sample_fraction : float
        Part of the source points that is used.
    max_points : int
        At most so many points of each cloud are looked at, chosen at random and spread evenly over the rows,
        where ``final_distance`` is 0. 0: no limit.
    max_samples, coarse_samples : int
        At most so many source points are matched: in all, and while the gate shrinks. 0: no limit.
    keep_best : bool
        Return the iterate of least rmse instead of the last.
    weak_threshold : float
        Directions of the pose whose information per pair is smaller are weak, and held at the initial pose.
    seed : int
        Of the choice of samples; equal seeds give equal results for any number of threads.
    num_threads : int
        0: all.

    Returns
    -------
    AlignResult
        With ``converged`` False, and the initial motion, where the data allows no answer (empty, disjoint,
        NaN).

    Raises
    ------
    TypeError, ValueError
        Naming the argument that is of the wrong type, shape or range.

    Notes
    -----
    Brightness as in Park, Zhou and Koltun 2017, colored point cloud registration revisited, but only along
    directions that geometry leaves open.
    """
    parameters = RegistrationParameters(
        method=method,
        max_iterations=max_iterations,
        max_distance=max_distance,
        final_distance=final_distance,
        gate_decay=gate_decay,
        max_angle=max_angle,
        robust=robust,
        sample_fraction=sample_fraction,
        max_points=max_points,
        max_samples=max_samples,
        coarse_samples=coarse_samples,
        keep_best=keep_best,
        weak_threshold=weak_threshold,
        seed=seed,
    )
    options = to_core(parameters, _core.AlignOptions())
    options.num_threads = as_count("num_threads", num_threads)
    source_points, source_rows, source_values = _cloud("source", source, source_normals, source_sigma)
    target_points, target_rows, target_values = _cloud("target", target, target_normals, target_sigma)
    first = np.eye(4) if initial is None else as_pose("initial", initial)
    local_source, source_origin = localize(source_points)
    local_target, target_origin = localize(target_points)
    result = _core.align(
        local_source,
        source_rows,
        source_values,
        _brightness("source_colors", source_colors, len(source_points)),
        local_target,
        target_rows,
        target_values,
        _brightness("target_colors", target_colors, len(target_points)),
        _shifted(first, source_origin, target_origin),
        options,
    )
    return mirrored(
        AlignResult,
        result,
        target_from_source=_shifted(result.target_from_source, -source_origin, -target_origin),
        center=result.center + target_origin,
    )
