"""nacre grows a 3D model from depth-camera images, layer by layer."""

from nacre._core import Camera, __version__
from nacre.depth import (
    DepthParameters,
    DepthReport,
    NoiseModel,
    back_project,
    depth_normals,
    estimate_noise,
    preprocess_depth,
)
from nacre.neighbors import KdTree, RadiusNeighbors
from nacre.normals import estimate_normals

__all__ = [
    "Camera",
    "DepthParameters",
    "DepthReport",
    "KdTree",
    "NoiseModel",
    "RadiusNeighbors",
    "__version__",
    "back_project",
    "depth_normals",
    "estimate_noise",
    "estimate_normals",
    "preprocess_depth",
]
