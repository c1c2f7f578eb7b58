"""Open3D's point-to-plane ICP, from coarse to fine, to a voxel model that grows with every frame."""

from __future__ import annotations

from typing import Any

import numpy as np

from track.peers import Array, cut

GATES = (10, 5, 2)
"""Of the stages [voxels]."""


class IcpLoop:
    """Starts from the last pose."""

    def __init__(self, camera: Any, voxel: float) -> None:
        from open3d import geometry

        self.camera, self.voxel, self.pose = camera, voxel, np.eye(4)
        self.model = geometry.PointCloud()

    def add(self, depth: Array) -> Array:
        """Register the frame to the model and add its points."""
        from open3d import geometry, pipelines, utility

        import nacre

        registration = pipelines.registration
        points = nacre.back_project(cut(self.camera, depth), self.camera)
        cloud = geometry.PointCloud(utility.Vector3dVector(points)).voxel_down_sample(self.voxel)
        cloud.estimate_normals(geometry.KDTreeSearchParamKNN(16))
        towards = (0, 0, -1e3) if self.camera.model == "orthographic" else (0, 0, 0)
        cloud.orient_normals_towards_camera_location(np.array(towards, float))
        if len(self.model.points):
            source = cloud.voxel_down_sample(2 * self.voxel)
            for gate in GATES:
                self.pose = np.array(
                    registration.registration_icp(
                        source,
                        self.model,
                        gate * self.voxel,
                        self.pose,
                        registration.TransformationEstimationPointToPlane(),
                        registration.ICPConvergenceCriteria(1e-6, 1e-6, 30),
                    ).transformation
                )
        self.model = (self.model + cloud.transform(self.pose)).voxel_down_sample(self.voxel)
        return self.pose.copy()

    def points(self) -> Array:
        """Return the voxel model."""
        return np.asarray(self.model.points)


def make(camera: Any, voxel: float) -> IcpLoop:
    """Return the loop."""
    return IcpLoop(camera, voxel)
