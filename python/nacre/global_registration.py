"""Registration of two clouds without a first guess."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre import _core
from nacre._internal.arrays import FloatArray, as_points, as_unit_rows, as_vector, localize
from nacre._internal.core_options import mirrored, to_core
from nacre._internal.guided import guided
from nacre._internal.value_equality import Value
from nacre.parameters import GlobalRegistrationParameters


@dataclass(frozen=True, eq=False, repr=False)
class GlobalAlignResult(Value):
    """
    The outcome of :func:`align_global`.

    Attributes
    ----------
    target_from_source : (4, 4) float64
        The best rigid motion there is, whatever the status; the identity where there are too few points.
    status : str
        "found": this motion, and no other, explains both clouds. "ambiguous": other motions explain them
        about as well (symmetric or featureless shapes). "not_found": no motion does. "too_few_points".
    overlap : float
        Part of the points that agree with the other cloud, of the cloud where it is more; a point that is
        close counts more than one that barely agrees.
    consistency : float
        Agreeing points, as a part of those and the ones that contradict: that the other cloud's viewpoint
        sees through, or that face it and should be seen and are not. 1 where no viewpoint is known.
    rivalry : float
        Score of the best motion that differs from this one and is as close, as a part of this one's.
    tolerance : float
        Within which surfaces agree [m].
    rmse : float
        Of the inliers of the last registration, along the normals [m]; NaN where nothing matched.
    information : (6, 6) float64
        Inverse covariance of the pose, as of :class:`nacre.AlignResult`.
    weak_directions : (K, 6) float64
        Directions that the data does not determine, as of :class:`nacre.AlignResult`.
    center : (3,) float64
        Centroid of the inliers, in the target's frame [m].
    """

    target_from_source: npt.NDArray[np.float64]
    status: str
    overlap: float
    consistency: float
    rivalry: float
    tolerance: float
    rmse: float
    information: npt.NDArray[np.float64]
    weak_directions: npt.NDArray[np.float64]
    center: npt.NDArray[np.float64]

    @property
    def found(self) -> bool:
        """Whether the motion is to be believed."""
        return self.status == "found"

    def __repr__(self) -> str:
        return (
            f"GlobalAlignResult({self.status}, overlap={self.overlap:.3f}, "
            f"consistency={self.consistency:.3f}, rivalry={self.rivalry:.2f}, rmse={self.rmse:.3g} m)"
        )


def _cloud(
    name: str, points: npt.ArrayLike, normals: npt.ArrayLike | None, viewpoint: npt.ArrayLike | None
) -> tuple[FloatArray, npt.NDArray[np.float32], npt.NDArray[np.float64] | None]:
    points = as_points(name, points)
    rows = np.zeros((0, 3), np.float32)
    if normals is not None:
        rows = as_unit_rows(f"{name}_normals", normals, name, len(points))
    place = None if viewpoint is None else as_vector(f"{name}_viewpoint", viewpoint, 3)
    return points, rows, place


@guided(
    max_correspondence_distance="tolerance",
    distance_threshold="tolerance",
    source_feature="it needs no features: leave them out",
    target_feature="it needs no features: leave them out",
)
def align_global(
    source: npt.ArrayLike,
    target: npt.ArrayLike,
    *,
    source_normals: npt.ArrayLike | None = None,
    target_normals: npt.ArrayLike | None = None,
    source_viewpoint: npt.ArrayLike | None = None,
    target_viewpoint: npt.ArrayLike | None = None,
    num_rotations: int = 288,
    num_candidates: int = 16,
    tolerance: float = 0.0,
    max_angle: float = 0.5235988,
    outlines: bool = False,
    min_overlap: float = 0.15,
    min_consistency: float = 0.7,
    max_residual: float = 0.8,
    max_rivalry: float = 0.7,
    max_points: int = 10000,
    max_samples: int = 2000,
    coarse_samples: int = 250,
    seed: int = 0,
    num_threads: int = 0,
) -> GlobalAlignResult:
    """
    Find the rigid motion that brings one cloud onto another, wherever they are.

    Short registrations (:func:`nacre.align`) start from rotations spread over all [1]_, with few points. What
    agrees best, point for point in both directions, is refined with more. Then the best motion is
    accepted or not: does enough agree, does nothing contradict, and is no other motion nearly as good?

    Give viewpoints where the clouds were each seen from one place, as depth images are: what is known to be
    free space tells right from wrong where surfaces are smooth. (0, 0, 0) for points in a camera's frame.

    Parameters
    ----------
    source, target : (N, 3), (M, 3) real
        Points [m]. Rows that are not finite are ignored.
    source_normals, target_normals : (N, 3), (M, 3) real, optional
        Normals, on the side that the surface is seen from; a point whose normal is 0 or not finite is left
        out. Estimated where they are not given; without a viewpoint their sides are then ignored.
    source_viewpoint, target_viewpoint : (3,), optional
        From where each cloud was seen [m], in its own frame. Nothing is between it and the points.
    num_rotations, num_candidates : int
        Rotations to start from, and how many of the results are refined.
    tolerance : float
        Surfaces agree within it, along their normals [m]; 0: four standard deviations of the noise that is
        left after averaging neighbours, at least 0.3 % of the smaller cloud's diameter.
    max_angle : float
        And where their normals differ by less [rad].
    outlines : bool
        Nothing but the clouds was to be seen from their viewpoints (objects before an empty background), so
        that points beyond the other cloud's outline contradict. Leave it off for clouds that were cut out.
    min_overlap, min_consistency, max_rivalry : float
        Bounds on the result's figures of these names for "found".
    max_residual : float
        Bound on ``rmse``, as a part of ``tolerance``.
    max_points, max_samples, coarse_samples : int
        At most so many points of each cloud are looked at (0: all), matched, and matched in the search.
    seed : int
        Of the choice of points; equal seeds give equal results for any number of threads.
    num_threads : int
        0: all.

    Returns
    -------
    GlobalAlignResult
        Ask ``found`` before the motion is used.

    Raises
    ------
    TypeError, ValueError
        Naming the argument that is of the wrong type, shape or range.

    References
    ----------
    .. [1] M. Alexa: Super-Fibonacci spirals: fast, low-discrepancy sampling of SO(3). CVPR 2022.
    """
    parameters = GlobalRegistrationParameters(
        num_rotations=num_rotations,
        num_candidates=num_candidates,
        tolerance=tolerance,
        max_angle=max_angle,
        outlines=outlines,
        min_overlap=min_overlap,
        min_consistency=min_consistency,
        max_residual=max_residual,
        max_rivalry=max_rivalry,
        max_points=max_points,
        max_samples=max_samples,
        coarse_samples=coarse_samples,
        seed=seed,
        num_threads=num_threads,
    )
    source_points, source_rows, source_place = _cloud("source", source, source_normals, source_viewpoint)
    target_points, target_rows, target_place = _cloud("target", target, target_normals, target_viewpoint)
    local_source, source_origin = localize(source_points)
    local_target, target_origin = localize(target_points)
    result = _core.align_global(
        local_source,
        source_rows,
        None if source_place is None else source_place - source_origin,
        local_target,
        target_rows,
        None if target_place is None else target_place - target_origin,
        to_core(parameters, _core.GlobalAlignOptions()),
    )
    alignment: Any = result.alignment
    pose = alignment.target_from_source.copy()
    pose[:3, 3] += target_origin - pose[:3, :3] @ source_origin
    return mirrored(
        GlobalAlignResult,
        result,
        target_from_source=pose if result.status != "too_few_points" else np.eye(4),
        rmse=alignment.rmse,
        information=alignment.information,
        weak_directions=alignment.weak_directions,
        center=alignment.center + target_origin,
    )
