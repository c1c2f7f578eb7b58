"""The model, the cameras and their path as things of a viser scene."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre import Camera
from nacre.report.reported_frame import ReportedFrame
from nacre.viewer.colors import STATUS_COLORS, point_colors
from nacre.viewer.timeline import Snapshot, Timeline

Array = npt.NDArray[np.float64]

_MAX_POINTS = 400_000
_MAX_FRUSTUMS = 24


class Scene:
    """
    Draws the states of a timeline.

    Parameters
    ----------
    scene : viser.SceneApi
        Where to draw.
    camera : Camera or None
        Gives the frusta their shape.
    """

    def __init__(self, scene: Any, camera: Camera | None) -> None:
        scene.set_up_direction("-y")  # the world is the first camera's frame: x right, y down, z forward
        self._scene = scene
        self._corners = frustum_corners(camera)
        self._drawn: dict[str, Any] = {}  # lines, by name

    def show_cloud(self, cloud: Snapshot, kind: str, point_size: float = 1.0) -> None:
        """Draw the model; the size of points is in spacings."""
        cloud = cloud.thinned(_MAX_POINTS)
        self._scene.add_point_cloud(
            "/model",
            cloud.points,
            point_colors(cloud, kind),
            point_size=point_size * cloud.spacing,
            point_shape="circle",
            point_shading="flat",
            precision="float32",
        )

    def show_cameras(self, timeline: Timeline, place: int, size: float) -> None:
        """Draw the path up to a frame, some of the cameras on it, the frame's own large, and the truth."""
        frames = timeline.frames[: place + 1]
        posed = [frame for frame in frames if frame.world_from_camera is not None]
        self._show_path("/path", posed, 2.5)
        chosen = posed[:: max(-(-len(posed) // _MAX_FRUSTUMS), 1)]
        self._lines(
            "/cameras",
            [self._frustum(m.world_from_camera, 0.35 * size) for m in chosen],
            [STATUS_COLORS[m.status] for m in chosen],
            1.5,
        )
        pose = timeline.pose_at(place)
        if frames and pose is not None:
            self._lines("/camera", [self._frustum(pose, size)], [STATUS_COLORS[frames[-1].status]], 3.0)
        truths = np.array([m.truth[:3, 3] for m in frames if m.truth is not None]).reshape(-1, 3)
        self._lines("/truth", [_chain(truths)], [(160, 160, 160)], 1.0)

    def show_points(self, points: npt.NDArray[np.float32], size: float, visible: bool) -> None:
        """Draw the points of one frame over the model."""
        self._scene.add_point_cloud(
            "/frame", points, (255, 200, 60), point_size=size, precision="float32", visible=visible
        )

    def _show_path(self, name: str, frames: Sequence[ReportedFrame], thickness: float) -> None:
        positions = np.array([m.world_from_camera[:3, 3] for m in frames if m.world_from_camera is not None])
        colors = [STATUS_COLORS[frame.status] for frame in frames[1:]]
        segments = _chain(positions.reshape(-1, 3))
        self._lines(name, list(segments[:, None]), colors, thickness)

    def _lines(
        self, name: str, parts: Sequence[Array], colors: Sequence[tuple[int, int, int]], thickness: float
    ) -> None:
        """Draw (S, 2, 3) segments, each part in its colour; the thickness is in pixels."""
        before = self._drawn.pop(name, None)
        if before is not None:
            before.remove()
        if not sum(len(part) for part in parts):
            return
        shades = [
            np.broadcast_to(np.array(color, np.uint8), (len(part), 2, 3))
            for part, color in zip(parts, colors, strict=True)
        ]
        self._drawn[name] = self._scene.add_line_segments(
            name,
            np.concatenate(parts).astype(np.float32),
            np.concatenate(shades),
            thickness=thickness,
            thickness_units="screen",
        )

    def _frustum(self, pose: Array | None, size: float) -> Array:
        assert pose is not None
        corners = size * self._corners @ pose[:3, :3].T + pose[:3, 3]
        ring = np.stack([corners, np.roll(corners, -1, axis=0)], axis=1)
        rays = np.stack([np.broadcast_to(pose[:3, 3], (4, 3)), corners], axis=1)
        return np.concatenate([ring, rays])


def frustum_corners(camera: Camera | None) -> Array:
    """Return the corners of the image, seen from the camera, on a plane at distance 1; (4, 3)."""
    x, y = 0.5, 0.375
    if camera is not None:
        focal = (camera.fx, camera.fy) if camera.model == "pinhole" else (camera.width, camera.width)
        x, y = camera.width / (2 * focal[0]), camera.height / (2 * focal[1])
    return np.array([(-x, -y, 1), (x, -y, 1), (x, y, 1), (-x, y, 1)], dtype=np.float64)


def extent(cloud: Snapshot) -> float:
    """Return a length that stands for the size of a model [m]."""
    low, high = np.percentile(core(cloud), (2, 98), axis=0)
    return float(np.linalg.norm(high - low))


def core(cloud: Snapshot) -> npt.NDArray[np.float32]:
    """Return the best known quarter of a model's points: of a room, what was looked at, not its far walls."""
    if cloud.confidence is None or len(cloud.points) < 4:
        return cloud.points
    known: npt.NDArray[np.float32] = cloud.points[cloud.confidence >= np.percentile(cloud.confidence, 75)]
    return known


def _chain(positions: Array) -> Array:
    """Return the segments (N - 1, 2, 3) between each position and the next."""
    return np.stack([positions[:-1], positions[1:]], axis=1).reshape(-1, 2, 3)
