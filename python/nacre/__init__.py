"""nacre grows a 3D model from depth-camera images, layer by layer."""

from nacre._core import Camera, __version__
from nacre.consolidation import Consolidated, consolidate, project_samples
from nacre.depth import (
    DepthParameters,
    DepthReport,
    NoiseModel,
    back_project,
    depth_normals,
    estimate_noise,
    preprocess_depth,
)
from nacre.model import FrameReport, Model, ModelParameters
from nacre.neighbors import KdTree, RadiusNeighbors
from nacre.registration import AlignResult, RegistrationParameters, align

__all__ = [
    "AlignResult",
    "Camera",
    "Consolidated",
    "DepthParameters",
    "DepthReport",
    "FrameReport",
    "KdTree",
    "Model",
    "ModelParameters",
    "NoiseModel",
    "RadiusNeighbors",
    "RegistrationParameters",
    "__version__",
    "align",
    "back_project",
    "consolidate",
    "depth_normals",
    "estimate_noise",
    "preprocess_depth",
    "project_samples",
]
