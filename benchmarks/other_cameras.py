#!/usr/bin/env python
"""
Run simulated cameras of four kinds through scenes and at speeds that no number in nacre was fitted to.

The errors are those of `nacre.simulate_depth`'s sensors, which `sensors.py` compares with real ones. A flat
is walked through with the camera in the hand, at so many frames a second; the camera passes a wall with
boxes on it, all of whose faces look one way, in steps of so many millimetres; cartons in a corner are walked
around, in steps of so many degrees; a figure as tall as a person, and a cow of 0.8 m, turn before the camera,
alone; two people stand before a desk for two seconds, and then walk about, while somebody holds the camera.

    python benchmarks/other_cameras.py
    python benchmarks/other_cameras.py cartons stereo
"""

from __future__ import annotations

import argparse
import math
from concurrent.futures import ProcessPoolExecutor
from typing import Any

import cases
import numpy as np
import numpy.typing as npt
from flat import RADIUS, flat_mesh
from simulated import box, merged

import nacre

Array = npt.NDArray[Any]

SENSORS = ("structured_light", "time_of_flight", "stereo", "phone_lidar")
# Of each scene: frames a second, or millimetres or degrees from frame to frame, and the number of frames.
SCENES = {
    "flat": ((30, 60), (10, 60), (5, 60), (3, 60)),
    "wall": ((10, 60), (40, 30)),
    "cartons": ((5, 60), (10, 36), (20, 17)),
    "homer": ((7, 52), (15, 24)),
    "spot": ((7, 52),),
    "people": ((30, 108), (10, 36)),
}
UNITS = {"flat": "frames a second", "wall": "mm", "people": "frames a second"}
HEIGHTS = {"homer": 1.7, "spot": 0.8}  # [m]
DISTANCES = {"homer": 2.2, "spot": 1.2, "cartons": 2.0}  # [m]


def looking(position: Array, ahead: Array, roll: float = 0.0) -> Array:
    """Return the pose of a camera that looks ahead; y points down."""
    ahead = ahead / np.linalg.norm(ahead)
    right = np.cross([0.0, 1.0, 0.0], ahead)
    right /= np.linalg.norm(right)
    turn = np.array([[math.cos(roll), -math.sin(roll), 0], [math.sin(roll), math.cos(roll), 0], [0, 0, 1]])
    pose = np.eye(4)
    pose[:3, :3] = np.stack([right, np.cross(ahead, right), ahead], axis=1) @ turn
    pose[:3, 3] = position
    return pose


def trembling(rng: np.random.Generator, count: int, size: float) -> Array:
    """Return the tremor of a hand: smooth over some ten frames of a 30th of a second."""
    window = np.hanning(9)
    steps = rng.normal(size=(count + 8, 3))
    smooth = np.stack([np.convolve(steps[:, i], window, "valid") for i in range(3)], axis=1)
    return np.asarray(size * smooth / smooth.std())


def walk(rate: int, count: int) -> list[Array]:
    """Return poses of a walk of 0.4 m/s through the flat, that sways by some 20 degrees a second."""
    total = count * 30 // rate
    rng = np.random.default_rng(7)
    starts = rng.uniform(0, 6, 3)
    shakes, wobbles = trembling(rng, total, 0.01), trembling(rng, total, math.radians(0.8))
    poses = []
    for k in range(0, total, 30 // rate):
        t = k / 30
        angle = 0.4 * t / RADIUS + starts[0]
        heading = angle + math.pi / 5 + 0.35 * math.sin(0.9 * t + starts[1]) + wobbles[k, 1]
        pitch = 0.2 * math.sin(0.7 * t + starts[2]) + wobbles[k, 0]
        position = np.array([RADIUS * math.cos(angle), 0.1 * math.sin(t), RADIUS * math.sin(angle)])
        level = math.cos(pitch)
        ahead = np.array([level * math.cos(heading), math.sin(pitch), level * math.sin(heading)])
        poses.append(looking(position + shakes[k], ahead, wobbles[k, 2]))
    return poses[:count]


def around(step: float, count: int, distance: float, height: float, middle: Array) -> list[Array]:
    """Return poses around something, in steps of so many degrees, by hand."""
    rng = np.random.default_rng(3)
    poses = []
    for k in range(count):
        angle = math.radians(step * k)
        offset = np.array([distance * math.sin(angle), height, -distance * math.cos(angle)])
        place = middle + offset + rng.normal(scale=[0.03, 0.03, 0.0])
        poses.append(looking(place, middle + rng.normal(scale=0.04, size=3) - place))
    return poses


def cartons() -> nacre.Mesh:
    """Return seven cartons on a floor between two walls."""
    rng = np.random.default_rng(11)
    parts = [
        box([0, 1.05, 0], [8, 0.1, 8], 0),
        box([0, -0.6, 3.5], [8, 3.4, 0.1], 0),
        box([3.8, -0.6, 0], [0.1, 3.4, 8], 0.1),
    ]
    for _ in range(7):
        size = rng.uniform(0.25, 0.7, 3)
        x, z = rng.uniform(-0.7, 0.7, 2)
        parts.append(box([x, 1 - size[1] / 2, z], size, rng.uniform(0, 3)))
    return merged(parts)


def wall() -> nacre.Mesh:
    """Return a wall two metres from the camera's way, with boxes before it."""
    rng = np.random.default_rng(5)
    parts = [box([0, 0, 2.05], [9, 6, 0.1], 0)]
    for x in np.arange(-3, 3, 0.55):
        place = [x + rng.uniform(-0.1, 0.1), rng.uniform(-0.7, 0.7), 2]
        parts.append(box(place, rng.uniform([0.3, 0.3, 0.6], [0.5, 0.5, 0.7]), 0))
    return merged(parts)


def passing(step: int, count: int) -> list[Array]:
    """Return poses that pass the wall, in steps of so many millimetres."""
    poses = np.tile(np.eye(4), (count, 1, 1))
    poses[:, 0, 3] = 0.001 * step * (np.arange(count) - count / 2)
    return list(poses)


def figure(name: str) -> nacre.Mesh:
    """Return a mesh at the size of a person or an animal, its head up, where y points down."""
    mesh = nacre.read_mesh(cases.DATA / "meshes" / f"{name}.obj")
    vertices = np.asarray(mesh.vertices, float) * [1, -1, -1]
    vertices -= (vertices.max(axis=0) + vertices.min(axis=0)) / 2
    return nacre.Mesh(vertices * HEIGHTS[name] / np.ptp(vertices, axis=0).max(), mesh.triangles)


def office() -> list[tuple[Array, Array]]:
    """Return the parts of a room four metres deep: a desk, things on it, shelves, and boxes at its end."""
    rng = np.random.default_rng(21)
    parts = [
        box([0, 1.05, 2], [8, 0.1, 8], 0),
        box([0, -0.3, 4.5], [8, 3.4, 0.1], 0),
        box([2.1, -0.3, 2], [0.1, 3.4, 8], 0.05),
        box([-2.3, 0.2, 3], [0.5, 1.9, 1], 0),
        box([1.75, 0.2, 3.4], [0.5, 1.6, 0.8], 0),
        box([0, 0.4, 2.6], [1.6, 0.05, 0.8], 0),
    ]
    for _ in range(8):
        place = [rng.uniform(-0.7, 0.7), 0.4 - rng.uniform(0.05, 0.2), 2.6 + rng.uniform(-0.3, 0.3)]
        parts.append(box(place, rng.uniform(0.08, 0.35, 3), rng.uniform(0, 3)))
    for _ in range(5):
        place = [rng.uniform(-2.5, 2.8), 0.6, 4.2]
        parts.append(box(place, rng.uniform(0.3, 0.9, 3), rng.uniform(-0.2, 0.2)))
    return parts


def people(rate: int, count: int) -> tuple[list[nacre.Mesh], list[Array]]:
    """Return an office with two people at so many frames a second, and poses of a camera in the hand."""
    person = figure("homer")
    body: Array = np.asarray(person.vertices, float) * [0.7, 1, 0.8]
    total = count * 30 // rate
    rng = np.random.default_rng(5)
    shakes, wobbles = trembling(rng, total, 0.006), trembling(rng, total, math.radians(0.4))
    parts, meshes, poses = office(), [], []
    for k in range(0, total, 30 // rate):
        t = max(0.0, k / 30 - 2)
        both = []
        for x, z, turn in (
            (-0.5 + math.sin(0.9 * t), 1.9 - 0.3 * math.sin(0.5 * t), 0.5 * t),
            (0.65 - 1.3 * math.sin(0.7 * t), 2.1 + 0.2 * math.sin(t), -0.4 * t),
        ):
            cos, sin = math.cos(turn), math.sin(turn)
            turned = body @ np.array([[cos, 0, -sin], [0, 1, 0], [sin, 0, cos]])
            both.append((turned + np.array([x, 0.15, z]), np.asarray(person.triangles)))
        meshes.append(merged(parts + both))
        ahead = np.array([math.sin(wobbles[k, 1]), 0.08 + wobbles[k, 0], 1])
        poses.append(looking(shakes[k], ahead, wobbles[k, 2]))
    return meshes, poses


def make(scene: str, sensor: str, speed: int, count: int) -> cases.Case:
    """Return a recording."""
    if scene == "people":
        meshes, poses = people(speed, count)
    elif scene == "flat":
        meshes, poses = [flat_mesh()] * count, walk(speed, count)
    elif scene == "wall":
        meshes, poses = [wall()] * count, passing(speed, count)
    elif scene == "cartons":
        meshes, poses = (
            [cartons()] * count,
            around(speed, count, DISTANCES[scene], -0.2, np.array([0, 0.5, 0])),
        )
    else:
        meshes, poses = [figure(scene)] * count, around(speed, count, DISTANCES[scene], 0.0, np.zeros(3))
    camera = cases.SENSORS[sensor]
    kind: Any = sensor
    depths = [
        mesh.simulate_depth(camera, pose, sensor=kind, seed=k, num_threads=1)
        for k, (mesh, pose) in enumerate(zip(meshes, poses, strict=True))
    ]
    return cases.Case(f"{scene} {sensor} {speed}", camera, depths, [None] * count, list(poses))


def run(recording: tuple[str, str, int, int]) -> str:
    """Run a recording, and return its cell: right / claimed / far off of all, and the trajectory's error."""
    case = make(*recording)
    figures, model = cases.run(case)
    far_off = cases.count_far_off(case, model)
    return f"{figures.right} / {figures.claimed} / {far_off} of {figures.frames}, {figures.ate:.0f} mm"


def main() -> None:
    """Run the scenes and sensors that are named, or all, and print a table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("names", nargs="*", choices=[[], *SCENES, *SENSORS], default=[], metavar="NAME")
    parser.add_argument("--processes", type=int, default=2)
    arguments = parser.parse_args()
    scenes = [name for name in SCENES if name in arguments.names] or list(SCENES)
    sensors = [name for name in SENSORS if name in arguments.names] or list(SENSORS)
    rows = [(scene, *speed) for scene in scenes for speed in SCENES[scene]]
    print(f"| scene | {' | '.join(sensors)} |")
    print(f"| --- | {' | '.join('---' for _ in sensors)} |")
    with ProcessPoolExecutor(arguments.processes) as pool:
        todo = [(scene, sensor, speed, count) for scene, speed, count in rows for sensor in sensors]
        cells = pool.map(run, todo)
        for scene, speed, _ in rows:
            name = f"{scene}, {speed} {UNITS.get(scene, 'degrees')}"
            print(f"| {name} | {' | '.join(next(cells) for _ in sensors)} |", flush=True)


if __name__ == "__main__":
    main()
