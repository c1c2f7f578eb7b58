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
from nacre.errors import FileFormatError
from nacre.io.cloud import Cloud
from nacre.io.meshes import read_mesh, write_mesh
from nacre.io.points import read_points, write_points
from nacre.model import FrameReport, Model, ModelParameters
from nacre.registration import AlignResult, RegistrationParameters, align

__all__ = [
    "AlignResult",
    "Camera",
    "Cloud",
    "DepthParameters",
    "DepthReport",
    "FileFormatError",
    "FrameReport",
    "Model",
    "ModelParameters",
    "NoiseModel",
    "RegistrationParameters",
    "__version__",
    "align",
    "back_project",
    "depth_normals",
    "estimate_noise",
    "preprocess_depth",
    "read_mesh",
    "read_points",
    "write_mesh",
    "write_points",
]
