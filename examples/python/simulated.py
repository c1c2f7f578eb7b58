"""Frames of the built-in object, for examples that are started without a recording of yours."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

import nacre

THING = nacre.built_in_object()
CAMERA = nacre.Camera(width=320, height=240, fx=400, fy=400, cx=159.5, cy=119.5)


def turntable(num_views: int = 12) -> Iterator[nacre.SequenceFrame]:
    """Yield views of the object as it turns on a table, before a camera and a wall that stand still."""
    poses = nacre.turntable_poses(
        THING, num_views, 2 * math.pi / num_views, camera=CAMERA, distance=0.45, elevation=math.radians(30)
    )
    floor = float(THING.bounds[0, 1])
    corners = [(-1, floor, -1), (1, floor, -1), (1, floor, 1), (-1, floor, 1)]
    table = nacre.Mesh(np.array(corners, np.float32), [(0, 1, 2), (0, 2, 3)])
    behind = table.simulate_depth(CAMERA, poses[0], noise=0.0005)
    for index, pose in enumerate(poses):
        depth = THING.simulate_depth(CAMERA, pose, noise=0.0005, edge_mixing=True, seed=index)
        yield nacre.SequenceFrame(index, np.fmin(depth, behind), CAMERA, None, None, truth=pose)


def hand_held(num_views: int = 20) -> Iterator[nacre.SequenceFrame]:
    """Yield views on the way around the object and back, nearer and farther, with a Kinect's noise."""
    for index in range(num_views):
        way = math.sin(2 * math.pi * index / num_views)
        pose = nacre.turntable_poses(
            THING, 2, 1.2 * way, camera=CAMERA, distance=0.4 + 0.1 * abs(way), elevation=0.3 * way
        )[1]
        depth = THING.simulate_depth(CAMERA, pose, noise="kinect", edge_mixing=True, seed=index)
        yield nacre.SequenceFrame(index, depth, CAMERA, index / 30, None, truth=pose)


def scan(view: int = 0, num_points: int = 20000, noise: float = 0.0005) -> nacre.Cloud:
    """Return a noisy scan of the object's whole surface, each in a coordinate system of its own."""
    surface = nacre.evaluation.sample_surface(THING.vertices, THING.triangles, num_points, seed=view)
    points = surface.points + np.random.default_rng(view).normal(scale=noise, size=surface.points.shape)
    pose = nacre.turntable_poses(THING, view + 1, 2.0)[view]
    return nacre.Cloud((points - pose[:3, 3]) @ pose[:3, :3])
