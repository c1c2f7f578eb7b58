"""KISS-ICP, made for rotating lasers, with its lengths scaled to the scene."""

from __future__ import annotations

from typing import Any

import numpy as np

import nacre
from track.peers import FAR, Array, cut


class KissLoop:
    """A map of voxels four times as wide as the points' grid; thresholds scaled alike from its defaults."""

    def __init__(self, camera: Any, voxel: float) -> None:
        from kiss_icp.config import KISSConfig
        from kiss_icp.kiss_icp import KissICP

        config = KISSConfig()
        wide = 4 * voxel
        far = 1e3 if camera.model == "orthographic" else FAR
        config.data.max_range, config.data.min_range, config.data.deskew = far, 0.0, False
        config.mapping.voxel_size = wide
        config.adaptive_threshold.initial_threshold = 2 * wide  # defaults: 2 m and 0.1 m for voxels of 1 m
        config.adaptive_threshold.min_motion_th = 0.1 * wide
        self.camera, self.odometry = camera, KissICP(config)

    def add(self, depth: Array) -> Array:
        """Register the frame to the map and add its points."""
        points = nacre.back_project(cut(self.camera, depth), self.camera).astype(np.float64)
        self.odometry.register_frame(points, np.zeros(0))
        return np.array(self.odometry.last_pose)

    def points(self) -> Array:
        """Return the points of the map."""
        return np.asarray(self.odometry.local_map.point_cloud())


def make(camera: Any, voxel: float) -> KissLoop:
    """Return the loop."""
    return KissLoop(camera, voxel)
