"""How good a trajectory and a model are: errors in metres and radians, as the literature defines them."""

from nacre.evaluation.normals import NormalError, normal_error
from nacre.evaluation.pose import PoseError, pose_error
from nacre.evaluation.surface import (
    Completeness,
    FScore,
    SurfaceAccuracy,
    SurfaceSamples,
    completeness,
    f_score,
    sample_surface,
    surface_accuracy,
)
from nacre.evaluation.trajectory import (
    AbsoluteTrajectoryError,
    RelativePoseError,
    absolute_trajectory_error,
    relative_pose_error,
)
from nacre.evaluation.uniformity import Uniformity, uniformity
from nacre.evaluation.visibility import seen_samples

__all__ = [
    "AbsoluteTrajectoryError",
    "Completeness",
    "FScore",
    "NormalError",
    "PoseError",
    "RelativePoseError",
    "SurfaceAccuracy",
    "SurfaceSamples",
    "Uniformity",
    "absolute_trajectory_error",
    "completeness",
    "f_score",
    "normal_error",
    "pose_error",
    "relative_pose_error",
    "sample_surface",
    "seen_samples",
    "surface_accuracy",
    "uniformity",
]
