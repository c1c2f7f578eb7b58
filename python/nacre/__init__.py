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
from nacre.mesh import ClosestPoints, Mesh, RayHits, built_in_object
from nacre.model import FrameReport, Model, ModelParameters
from nacre.neighbors import KdTree, RadiusNeighbors
from nacre.registration import AlignResult, RegistrationParameters, align
from nacre.simulation import default_camera, simulate_depth, turntable_poses

__all__ = [
    "AlignResult",
    "Camera",
    "ClosestPoints",
    "Consolidated",
    "DepthParameters",
    "DepthReport",
    "FrameReport",
    "KdTree",
    "Mesh",
    "Model",
    "ModelParameters",
    "NoiseModel",
    "RadiusNeighbors",
    "RayHits",
    "RegistrationParameters",
    "__version__",
    "align",
    "back_project",
    "built_in_object",
    "consolidate",
    "default_camera",
    "depth_normals",
    "estimate_noise",
    "preprocess_depth",
    "project_samples",
    "simulate_depth",
    "turntable_poses",
]
