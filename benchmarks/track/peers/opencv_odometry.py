"""OpenCV's depth odometry from image to image; it makes no model."""

from __future__ import annotations

from typing import Any

import numpy as np

from track.peers import FAR, Array, intrinsics


def odometry(camera: Any) -> Any:
    """Return an odometry with its default settings, for a camera."""
    import cv2

    settings = cv2.OdometrySettings()
    settings.setCameraMatrix(intrinsics(camera).astype(np.float32))
    settings.setMaxDepth(FAR)
    return cv2.Odometry(cv2.OdometryType_DEPTH, settings, cv2.OdometryAlgoType_COMMON)


class OdometryLoop:
    """Chains the motions from each image to the one before."""

    def __init__(self, camera: Any) -> None:
        self.odometry = odometry(camera)
        self.pose = np.eye(4)
        self.last: Array | None = None

    def add(self, depth: Array) -> Array | None:
        """Register the image to the last one; where that fails, the next is registered to the older one."""
        image = np.nan_to_num(depth)
        if self.last is not None:
            found, motion = self.odometry.compute(image, self.last)
            if not found:
                return None
            self.pose = self.pose @ motion
        self.last = image
        return self.pose.copy()

    def points(self) -> Array:
        """Return no model."""
        return np.zeros((0, 3))


def make(camera: Any, voxel: float) -> OdometryLoop:
    """Return the loop."""
    return OdometryLoop(camera)
