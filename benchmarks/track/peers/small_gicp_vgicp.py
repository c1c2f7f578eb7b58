"""small_gicp's voxelised GICP to a map of Gaussian voxels that grows with every frame."""

from __future__ import annotations

import os
from typing import Any

import numpy as np

import nacre
from track.peers import Array, cut


class VgicpLoop:
    """As in small_gicp's odometry example; the map's voxels are four times as wide as the points' grid."""

    def __init__(self, camera: Any, voxel: float) -> None:
        import small_gicp

        self.camera, self.voxel, self.pose = camera, voxel, np.eye(4)
        self.map = small_gicp.GaussianVoxelMap(4 * voxel)
        self.map.set_lru(horizon=1_000_000, clear_cycle=1_000_000)
        self.threads = len(os.sched_getaffinity(0))
        self.kept: list[Array] = []

    def add(self, depth: Array) -> Array:
        """Register the frame to the map and add its points."""
        import small_gicp

        points = nacre.back_project(cut(self.camera, depth), self.camera).astype(np.float64)
        cloud, _ = small_gicp.preprocess_points(
            points, downsampling_resolution=self.voxel, num_threads=self.threads
        )
        if self.kept:
            self.pose = small_gicp.align(
                self.map,
                cloud,
                init_T_target_source=self.pose,
                max_correspondence_distance=10 * self.voxel,
                num_threads=self.threads,
                max_iterations=30,
                translation_epsilon=1e-2 * self.voxel,
                rotation_epsilon=1e-4,
            ).T_target_source
        self.map.insert(cloud, self.pose)
        self.kept.append(cloud.points()[:, :3] @ self.pose[:3, :3].T + self.pose[:3, 3])
        return self.pose.copy()

    def points(self) -> Array:
        """Return the points of all frames, thinned to the grid."""
        import small_gicp

        thin = small_gicp.voxelgrid_sampling(np.concatenate(self.kept), self.voxel)
        return np.asarray(thin.points())[:, :3]


def make(camera: Any, voxel: float) -> VgicpLoop:
    """Return the loop."""
    return VgicpLoop(camera, voxel)
