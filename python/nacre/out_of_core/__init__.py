"""Clouds larger than memory: files in, files out, cell by cell, on one machine or a cluster."""

from nacre.out_of_core.cloud_work import CloudResult
from nacre.out_of_core.consolidation import consolidate
from nacre.out_of_core.downsampling import voxel_downsample
from nacre.out_of_core.evaluation import SurfaceEvaluation, evaluate
from nacre.out_of_core.normals import estimate_normals
from nacre.out_of_core.outliers import remove_outliers
from nacre.out_of_core.registration import align

__all__ = [
    "CloudResult",
    "SurfaceEvaluation",
    "align",
    "consolidate",
    "estimate_normals",
    "evaluate",
    "remove_outliers",
    "voxel_downsample",
]
