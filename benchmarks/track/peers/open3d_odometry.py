"""Open3D's multi-scale odometry from image to image, by depth alone; it makes no model."""

from __future__ import annotations

from typing import Any

import numpy as np

from track.peers import FAR, Array, intrinsics


class OdometryLoop:
    """Chains the motions from each image to the one before."""

    def __init__(self, camera: Any) -> None:
        from open3d import core

        self.matrix = core.Tensor(intrinsics(camera))
        self.pose = np.eye(4)
        self.last: Any = None

    def add(self, depth: Array) -> Array:
        """Register the image to the last one."""
        from open3d import core, t

        image = t.geometry.Image(core.Tensor.from_numpy(np.nan_to_num(depth)[..., None]))
        black = t.geometry.Image(core.Tensor.zeros((*depth.shape, 3), core.float32))
        frame = t.geometry.RGBDImage(black, image)
        if self.last is not None:
            found = t.pipelines.odometry.rgbd_odometry_multi_scale(
                frame,
                self.last,
                self.matrix,
                depth_scale=1.0,
                depth_max=FAR,
                method=t.pipelines.odometry.Method.PointToPlane,
            )
            self.pose = self.pose @ found.transformation.numpy()
        self.last = frame
        return self.pose.copy()

    def points(self) -> Array:
        """Return no model."""
        return np.zeros((0, 3))


def make(camera: Any, voxel: float) -> OdometryLoop:
    """Return the loop."""
    return OdometryLoop(camera)
