"""OpenCV's hashed TSDF: each image is registered to the ray-cast volume by depth odometry, and integrated."""

from __future__ import annotations

from typing import Any

import numpy as np

from track.peers import FAR, Array, cut, intrinsics
from track.peers.opencv_odometry import odometry


class TsdfLoop:
    """What OpenCV's large-scale KinectFusion composes of the same parts."""

    def __init__(self, camera: Any, voxel: float) -> None:
        import cv2

        settings = cv2.VolumeSettings(cv2.VolumeType_HashTSDF)
        matrix = intrinsics(camera).astype(np.float32)
        settings.setVoxelSize(voxel)
        settings.setTsdfTruncateDistance(7 * voxel)
        settings.setDepthFactor(1.0)
        settings.setMaxDepth(FAR)
        settings.setMaxWeight(64)
        for kind in ("Integrate", "Raycast"):
            getattr(settings, f"setCamera{kind}Intrinsics")(matrix)
            getattr(settings, f"set{kind}Width")(camera.width)
            getattr(settings, f"set{kind}Height")(camera.height)
        settings.setVolumePose(np.eye(4, dtype=np.float32))
        self.camera, self.pose = camera, np.eye(4)
        self.volume = cv2.Volume(cv2.VolumeType_HashTSDF, settings)
        self.odometry = odometry(camera)
        self.empty = True

    def add(self, depth: Array) -> Array | None:
        """Cast rays from the last pose, register, integrate."""
        image = np.nan_to_num(cut(self.camera, depth)).astype(np.float32)
        if not self.empty:
            points, _ = self.volume.raycast(self.pose.astype(np.float32))
            found, motion = self.odometry.compute(image, np.nan_to_num(points[..., 2]).astype(np.float32))
            if not found:
                return None
            self.pose = self.pose @ motion
        self.volume.integrate(image, self.pose.astype(np.float32))
        self.empty = False
        return self.pose.copy()

    def points(self) -> Array:
        """Return the points of the volume's surface."""
        points, _ = self.volume.fetchPointsNormals()
        return np.asarray(points).reshape(-1, np.asarray(points).shape[-1])[:, :3]


def make(camera: Any, voxel: float) -> TsdfLoop:
    """Return the loop."""
    return TsdfLoop(camera, voxel)
