"""Scenes whose every figure is known."""

from __future__ import annotations

import numpy as np

import nacre
from nacre.report import ReportedFrame
from nacre.viewer import Snapshot, Timeline

SPACING = 0.01
SIDE = 21
CAMERA = nacre.Camera(100, 100, 100, 100, 49.5, 49.5)


def plane(depth: float = 1.0) -> Snapshot:
    """Return a square of 21 x 21 points, 10 mm apart, that faces a camera at the origin."""
    steps = SPACING * (np.arange(SIDE) - SIDE // 2)
    x, y = np.meshgrid(steps, steps)
    points = np.column_stack([x.ravel(), y.ravel(), np.full(x.size, depth)]).astype(np.float32)
    normals = np.broadcast_to(np.array([0, 0, -1], np.float32), points.shape)
    colors = np.full(points.shape, (200, 40, 40), np.uint8)
    confidence = np.arange(1, len(points) + 1, dtype=np.float32)
    return Snapshot(points, normals, SPACING, colors, confidence, np.zeros(len(points), np.int32))


def two_looks(cloud: Snapshot, title: str = "plane") -> Timeline:
    """Return a run whose first frame sees the plane's part with x < -0.045, and the second all of it."""
    timeline = Timeline(title, CAMERA)
    for index, x in enumerate((-0.545, 0.0)):
        pose = np.eye(4)
        pose[0, 3] = x
        timeline.add(ReportedFrame(index, "TRACKED", world_from_camera=pose, overlap=0.9))
    timeline.set_snapshot(cloud)
    return timeline
