"""Clouds larger than memory: files in, files out, cell by cell, on one machine or a cluster."""

from nacre.out_of_core.cloud_work import CloudResult
from nacre.out_of_core.consolidation import consolidate
from nacre.out_of_core.normals import estimate_normals

__all__ = ["CloudResult", "consolidate", "estimate_normals"]
