#!/usr/bin/env python
"""
Turn painted things far on a table, whose shape tells little of it: a carton and a can.

Simulated cameras that stand still see each turn seven times by 5 degrees, then four times by 30, 45, 60
or 90.
Prints of the far turns how many are found, right within 5 degrees, and wrong.

    python benchmarks/painted_turns.py
"""

from __future__ import annotations

import math
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from itertools import product
from typing import Any

import numpy as np
import numpy.typing as npt
from cases import angle_between
from simulated import box, merged, turn_about_y
from turned_on_plane import camera_pose

import nacre

Array = npt.NDArray[Any]
CAMERA = nacre.Camera(640, 480, 900, 900, 319.5, 239.5)
AROUND = (box([0, -0.01, 0], [1.2, 0.02, 1.0], 0.0), box([0, 0.3, -0.45], [1.6, 1.0, 0.02], 0.0))
SQUARE = 0.012
"""[m] Of the paint."""
NEAR, NUM_NEAR, NUM_FAR = 5.0, 8, 4
FAR = (30.0, 45.0, 60.0, 90.0)
LARGEST_TURN = 5.0
"""[degrees]"""
SENSORS = ("stereo", "structured_light")


def can(radius: float = 0.04, height: float = 0.13, sides: int = 64) -> tuple[Array, Array]:
    """Return the vertices and triangles of a can on the plane y = 0."""
    angles = np.arange(sides) * 2 * math.pi / sides
    ring = radius * np.column_stack([np.cos(angles), np.zeros(sides), np.sin(angles)])
    top = np.array([0, height, 0])
    vertices = np.concatenate([ring, ring + top, [0 * top, top]])
    triangles = []
    for i, j in zip(range(sides), np.roll(np.arange(sides), -1), strict=True):
        triangles += [[i, sides + i, j], [j, sides + i, sides + j]]
        triangles += [[2 * sides, i, j], [2 * sides + 1, sides + j, sides + i]]
    return vertices, np.array(triangles)


THINGS = {"carton": box([0, 0.08, 0], [0.11, 0.16, 0.07], 0.0), "can": can()}


def seen(thing: tuple[Array, Array], turn: Array, sensor: Any, seed: int) -> tuple[Array, Array]:
    """Return depth and colours of a thing that turned; its paint turns with it."""
    world, random = camera_pose(), np.random.default_rng(seed)
    turned = (np.asarray(thing[0]) @ turn[:3, :3].T, thing[1])
    scene = merged([turned, *AROUND])
    v, u = np.indices((CAMERA.height, CAMERA.width))
    rays = np.stack([(u - CAMERA.cx) / CAMERA.fx, (v - CAMERA.cy) / CAMERA.fy, np.ones(u.shape)], axis=-1)
    rays = rays.reshape(-1, 3) @ world[:3, :3].T
    origins = np.broadcast_to(world[:3, 3], rays.shape)
    depth = scene.cast(origins, rays).distances
    points = origins + np.where(np.isfinite(depth), depth, 0.0)[:, None] * rays
    is_thing = np.abs(nacre.Mesh(*turned).cast(origins, rays).distances - depth) < 1e-4
    points[is_thing] = points[is_thing] @ turn[:3, :3]
    paint = np.random.default_rng(1).integers(0, 256, (64, 64, 64))
    square = np.floor((points + 1e-6) / SQUARE).astype(int) % 64
    brightness = paint[square[:, 0], square[:, 1], square[:, 2]].reshape(u.shape)
    brightness = np.clip(brightness + random.normal(0, 4, u.shape), 0, 255).astype(np.uint8)
    image = scene.simulate_depth(CAMERA, world, sensor=sensor, seed=seed)
    return image, np.repeat(brightness[..., None], 3, axis=2)


def run(job: tuple[str, float, str, bool]) -> tuple[str, bool, Counter[str]]:
    """Turn a thing before a camera."""
    name, far, sensor, is_colored = job
    model, world, found = nacre.Model(CAMERA, region={"object": True}), camera_pose(), Counter[str]()
    for i in range(NUM_NEAR + NUM_FAR):
        angle = NEAR * min(i, NUM_NEAR - 1) + far * max(0, i - NUM_NEAR + 1)
        turn = turn_about_y(math.radians(angle))
        depth, color = seen(THINGS[name], turn, sensor, i)
        report = model.add_frame(depth, color=color if is_colored else None)
        if i < NUM_NEAR or report.status not in ("TRACKED", "RELOCALISED"):
            continue
        off = np.linalg.inv(world) @ turn @ world @ report.world_from_camera  # the identity where it is right
        found["right" if angle_between(np.eye(3), off[:3, :3]) < LARGEST_TURN else "wrong"] += 1
    return name, is_colored, found


def main() -> None:
    """Print a table."""
    total: dict[tuple[str, bool], Counter[str]] = {}
    with ProcessPoolExecutor(2) as pool:
        for name, is_colored, found in pool.map(run, product(THINGS, FAR, SENSORS, (True, False))):
            total.setdefault((name, is_colored), Counter()).update(found)
    print("| thing | far turns | found right / wrong | without colours |\n| --- | --- | --- | --- |")
    for name in THINGS:
        colored, bare = total[name, True], total[name, False]
        figures = f"{colored['right']} / {colored['wrong']} | {bare['right']} / {bare['wrong']}"
        print(f"| {name} | {len(FAR) * len(SENSORS) * NUM_FAR} | {figures} |")


if __name__ == "__main__":
    main()
