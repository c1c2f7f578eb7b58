"""Simulated recordings of any length, for the programs that measure reliability: as small as they may be."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

import nacre

Array = npt.NDArray[Any]

SCENES = ("static", "turning", "object")


def box(center: Any, size: Any, turn: float) -> tuple[Array, Array]:
    """Return the vertices and the triangles of a box that is turned about y."""
    corners: Array = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
    corners = corners * size
    cos, sin = math.cos(turn), math.sin(turn)
    quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    triangles = [t for a, b, c, d in quads for t in ([a, b, c], [a, c, d])]
    rotation = np.array([[cos, 0, sin], [0, 1, 0], [-sin, 0, cos]])
    return corners @ rotation.T + center, np.array(triangles)


def merged(parts: list[tuple[Array, Array]]) -> nacre.Mesh:
    """Return one mesh of several."""
    firsts = np.cumsum([0] + [len(vertices) for vertices, _ in parts])[:-1]
    triangles = [triangles + first for (_, triangles), first in zip(parts, firsts, strict=True)]
    return nacre.Mesh(np.concatenate([vertices for vertices, _ in parts]), np.concatenate(triangles))


def furnished_room() -> nacre.Mesh:
    """Return a room with boxes along its walls, which are about a metre from its middle."""
    random = np.random.default_rng(3)
    parts = [box(np.zeros(3), [2.2, 1.6, 2.2], 0.0)]
    for i in range(60):
        angle = 2 * math.pi * (i + random.random()) / 60
        way = np.array([math.sin(angle), 0, math.cos(angle)])
        place = (1.1 / abs(way).max() - 0.15 * random.random()) * way
        place = place + np.array([0, random.uniform(-0.7, 0.7), 0])
        parts.append(box(place, random.uniform(0.1, [0.35, 0.4, 0.35]), random.uniform(0, math.pi)))
    return merged(parts)


def turn_about_y(angle: float) -> Array:
    """Return the pose of a camera at the origin that looks along z, turned."""
    pose = np.eye(4)
    cos, sin = math.cos(angle), math.sin(angle)
    pose[:3, :3] = np.array([[cos, 0.0, sin], [0.0, 1.0, 0.0], [-sin, 0.0, cos]])
    return pose


def depth_of_a_table(camera: nacre.Camera, angles: list[float]) -> list[Array]:
    """Return images of the built-in object, turned by each of some angles on a table, seen from above."""
    thing = nacre.built_in_object()
    table = merged([box([0, -0.01, 0], [0.7, 0.02, 0.7], 0.0)])
    pose = nacre.turntable_poses(thing, 1, distance=0.3, elevation=math.radians(35))[0]
    behind = table.simulate_depth(camera, pose, num_threads=1)
    # To turn the thing one way is to turn the camera the other way about it.
    return [
        np.fmin(thing.simulate_depth(camera, turn_about_y(-angle) @ pose, num_threads=1), behind)
        for angle in angles
    ]


class Scene:
    """
    Depth and colour images with new noise in every frame.

    "static": a camera that stands in a furnished room; "turning": one that turns in it, again and again;
    "object": a thing that turns on a table before a camera that stands. The images of a turn are made once.
    """

    def __init__(self, name: str, width: int, *, views: int = 180, sigma: float = 0.002) -> None:
        height = width * 3 // 4
        focal = 0.82 * width
        self.name = name
        self.camera = nacre.Camera(width, height, focal, focal, (width - 1) / 2, (height - 1) / 2)
        self.sigma = sigma if name != "object" else sigma / 4
        self.views = 1 if name == "static" else views
        angles = [2 * math.pi * view / self.views for view in range(self.views)]
        if name == "object":
            self._exact = depth_of_a_table(self.camera, angles)
        else:
            room = furnished_room()
            self._exact = [
                room.simulate_depth(self.camera, turn_about_y(angle), num_threads=1) for angle in angles
            ]

    def depth(self, index: int) -> Array:
        """Return the depth image of a frame [m]."""
        exact = self._exact[index % self.views]
        noise = np.random.default_rng(index).standard_normal(exact.shape, np.float32)
        noisy: Array = exact + np.float32(self.sigma) * noise
        return noisy

    def color(self, index: int) -> Array:
        """Return its colour image: bands of depth."""
        exact = np.nan_to_num(self._exact[index % self.views])
        levels = np.stack([exact * 400, exact * 900, exact * 2000], axis=-1)
        return levels.astype(np.int64).astype(np.uint8)

    def truth(self, index: int) -> Array:
        """Return the camera's pose in the frame of the first camera."""
        return turn_about_y(2 * math.pi * (index % self.views) / self.views)
