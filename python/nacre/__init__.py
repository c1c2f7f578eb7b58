"""nacre grows a 3D model from depth-camera images, layer by layer."""

import importlib
import importlib.util
import logging
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from nacre import evaluation
    from nacre._core import __version__
    from nacre.camera import Camera
    from nacre.consolidation import Consolidated, consolidate, project_samples
    from nacre.datasets import Sequence, SequenceFrame, open_sequence, write_recording
    from nacre.depth import (
        PIXEL_LABELS,
        DepthReport,
        back_project,
        depth_normals,
        label_pixels,
        preprocess_depth,
    )
    from nacre.depth_calibration import DepthCalibration, calibrate_depth
    from nacre.downsampling import voxel_downsample
    from nacre.errors import CameraError, FileFormatError
    from nacre.frame_report import DeformationReport, FrameReport
    from nacre.global_registration import GlobalAlignResult, align_global
    from nacre.io.animations import write_animation
    from nacre.io.cameras import CameraFile, read_camera, write_camera
    from nacre.io.cloud import Cloud
    from nacre.io.meshes import read_mesh, write_mesh
    from nacre.io.points import read_points, write_points
    from nacre.io.trajectories import read_trajectory, write_trajectory
    from nacre.kdtree import KdTree, RadiusNeighbors
    from nacre.mesh import ClosestPoints, Mesh, RayHits, built_in_object
    from nacre.model import Model
    from nacre.noise import NoiseModel, calibrate_noise, estimate_noise
    from nacre.normals import estimate_normals
    from nacre.parameters import (
        DepthParameters,
        GlobalRegistrationParameters,
        ModelParameters,
        RegionParameters,
        RegistrationParameters,
    )
    from nacre.progress import Cancelled
    from nacre.reconstruction.batch.batch import batch
    from nacre.reconstruction.reconstruct import reconstruct
    from nacre.region import RegionReport, select_region
    from nacre.registration import AlignResult, align
    from nacre.simulation import default_camera, simulate_depth, turntable_poses
    from nacre.system import default_threads, instruction_set, parallel_backend
    from nacre.trajectory import Trajectory, associate

__all__ = [
    "PIXEL_LABELS",
    "AlignResult",
    "Camera",
    "CameraError",
    "CameraFile",
    "Cancelled",
    "ClosestPoints",
    "Cloud",
    "Consolidated",
    "DeformationReport",
    "DepthCalibration",
    "DepthParameters",
    "DepthReport",
    "FileFormatError",
    "FrameReport",
    "GlobalAlignResult",
    "GlobalRegistrationParameters",
    "KdTree",
    "Mesh",
    "Model",
    "ModelParameters",
    "NoiseModel",
    "RadiusNeighbors",
    "RayHits",
    "RegionParameters",
    "RegionReport",
    "RegistrationParameters",
    "Sequence",
    "SequenceFrame",
    "Trajectory",
    "__version__",
    "align",
    "align_global",
    "associate",
    "back_project",
    "batch",
    "built_in_object",
    "calibrate_depth",
    "calibrate_noise",
    "consolidate",
    "default_camera",
    "default_threads",
    "depth_normals",
    "estimate_noise",
    "estimate_normals",
    "evaluation",
    "instruction_set",
    "label_pixels",
    "open_sequence",
    "parallel_backend",
    "preprocess_depth",
    "project_samples",
    "read_camera",
    "read_mesh",
    "read_points",
    "read_trajectory",
    "reconstruct",
    "select_region",
    "simulate_depth",
    "turntable_poses",
    "voxel_downsample",
    "write_animation",
    "write_camera",
    "write_mesh",
    "write_points",
    "write_recording",
    "write_trajectory",
]

# What else there is for users, in modules of its own.
_PACKAGES = ("datasets", "io", "meshing", "out_of_core", "reconstruction", "report", "viewer")

# Where each name is, so that it is imported when it is first asked for: most programs need few of them.
_NAMES = {
    "_core": "__version__",
    "camera": "Camera",
    "consolidation": "Consolidated consolidate project_samples",
    "datasets": "Sequence SequenceFrame open_sequence write_recording",
    "depth": "PIXEL_LABELS DepthReport back_project depth_normals label_pixels preprocess_depth",
    "depth_calibration": "DepthCalibration calibrate_depth",
    "downsampling": "voxel_downsample",
    "errors": "CameraError FileFormatError",
    "frame_report": "DeformationReport FrameReport",
    "global_registration": "GlobalAlignResult align_global",
    "io.animations": "write_animation",
    "io.cameras": "CameraFile read_camera write_camera",
    "io.cloud": "Cloud",
    "io.meshes": "read_mesh write_mesh",
    "io.points": "read_points write_points",
    "io.trajectories": "read_trajectory write_trajectory",
    "trajectory": "Trajectory associate",
    "mesh": "ClosestPoints Mesh RayHits built_in_object",
    "model": "Model",
    "kdtree": "KdTree RadiusNeighbors",
    "noise": "NoiseModel calibrate_noise estimate_noise",
    "normals": "estimate_normals",
    "parameters": "DepthParameters GlobalRegistrationParameters ModelParameters RegionParameters "
    "RegistrationParameters",
    "progress": "Cancelled",
    "reconstruction.batch.batch": "batch",
    "reconstruction.reconstruct": "reconstruct",
    "region": "RegionReport select_region",
    "registration": "AlignResult align",
    "simulation": "default_camera simulate_depth turntable_poses",
    "system": "default_threads instruction_set parallel_backend",
}
_MODULES = {name: module for module, names in _NAMES.items() for name in names.split()}


logging.getLogger("nacre").addHandler(logging.NullHandler())


def __getattr__(name: str) -> Any:
    """Import a public name, or a module of the package, when it is first asked for."""
    if name in _MODULES:
        value = getattr(importlib.import_module(f"nacre.{_MODULES[name]}"), name)
        globals()[name] = value
        return value
    if not name.startswith("__") and importlib.util.find_spec(f"nacre.{name}") is not None:
        return importlib.import_module(f"nacre.{name}")
    if name.startswith("_"):
        raise AttributeError(f"module 'nacre' has no attribute {name!r}")
    from nacre._internal.guided import no_such_name
    from nacre._internal.names_elsewhere import OF_PACKAGE

    raise no_such_name("nacre", name, __all__, _names_of_packages() | OF_PACKAGE)


def _names_of_packages() -> dict[str, str]:
    """Return where those public names are that a package of nacre has, and nacre itself has not."""
    return {
        name: f"it is nacre.{package}.{name}"
        for package in ("evaluation", *_PACKAGES)
        for name in getattr(importlib.import_module(f"nacre.{package}"), "__all__", ())
    }


def __dir__() -> list[str]:
    return sorted([*__all__, *_PACKAGES])
