"""Open3D's dense SLAM: each image is registered to the ray-cast TSDF, and integrated."""

from __future__ import annotations

from typing import Any

import numpy as np

from track.peers import FAR, Array, intrinsics


class SlamLoop:
    """As in Open3D's example ``dense_slam.py``."""

    def __init__(self, camera: Any, voxel: float) -> None:
        from open3d import core, t

        device = core.Device("CPU:0")
        matrix = core.Tensor(intrinsics(camera))
        self.pose = core.Tensor(np.eye(4))
        self.model = t.pipelines.slam.Model(voxel, 16, 40000, self.pose, device)
        self.frame, self.cast = (
            t.pipelines.slam.Frame(camera.height, camera.width, matrix, device) for _ in range(2)
        )
        self.index = 0

    def add(self, depth: Array) -> Array:
        """Register, integrate, and cast rays for the next."""
        from open3d import core, t

        image = t.geometry.Image(core.Tensor.from_numpy(np.nan_to_num(depth)[..., None]))
        black = t.geometry.Image(core.Tensor.zeros((*depth.shape, 3), core.float32))
        self.frame.set_data_from_image("depth", image)
        self.frame.set_data_from_image("color", black)
        if self.index > 0:
            found = self.model.track_frame_to_model(self.frame, self.cast, 1.0, FAR, 0.07)
            self.pose = self.pose @ found.transformation
        self.model.update_frame_pose(self.index, self.pose)
        self.model.integrate(self.frame, 1.0, FAR, 8.0)
        self.model.synthesize_model_frame(self.cast, 1.0, 0.1, FAR, 8.0, False)
        self.index += 1
        return np.array(self.pose.numpy())

    def points(self) -> Array:
        """Return the points of the TSDF's surface."""
        return np.asarray(self.model.extract_pointcloud(3.0).point.positions.numpy())


def make(camera: Any, voxel: float) -> SlamLoop:
    """Return the loop."""
    return SlamLoop(camera, voxel)
