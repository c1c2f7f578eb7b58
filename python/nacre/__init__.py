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

__all__ = [
    "Camera",
    "DepthParameters",
    "DepthReport",
    "NoiseModel",
    "__version__",
    "back_project",
    "depth_normals",
    "estimate_noise",
    "preprocess_depth",
]
