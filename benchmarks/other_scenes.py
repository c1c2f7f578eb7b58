"""
Scenes and cameras' ways of `other_cameras.py`, which no number in nacre was fitted to.

Meshes in metres, y points down; ways are poses, ``world_from_camera``, frame by frame.
"""

from __future__ import annotations

import math
from typing import Any

import cases
import numpy as np
import numpy.typing as npt
from flat import RADIUS
from simulated import box, merged

import nacre

Array = npt.NDArray[Any]

HEIGHTS = {"homer": 1.7, "spot": 0.8}  # [m]


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


def floor() -> nacre.Mesh:
    """Return a bare floor 1.2 m below the camera."""
    return merged([box([0, 1.25, 0], [60, 0.1, 60], 0)])


def over(step: int, count: int) -> list[Array]:
    """Return poses on a circle of 1.2 m, looking out and down, in steps of so many millimetres."""
    turns = 0.001 * step / 1.2 * np.arange(count)
    outwards = [np.array([math.sin(turn), 0, math.cos(turn)]) for turn in turns]
    return [looking(1.2 * outward, outward + np.array([0, 0.7, 0])) for outward in outwards]


def upright(name: str, size: float) -> nacre.Mesh:
    """Return a mesh of a size about the origin, its head up, where y points down."""
    mesh = cases.object_mesh(name)
    vertices = np.asarray(mesh.vertices, float) * [1, -1, -1]
    vertices -= (vertices.max(axis=0) + vertices.min(axis=0)) / 2
    return nacre.Mesh(vertices * size / np.ptp(vertices, axis=0).max(), mesh.triangles)


def figure(name: str) -> nacre.Mesh:
    """Return a mesh at the size of a person or an animal."""
    return upright(name, HEIGHTS[name])


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


def standing(name: str, size: float, turn: float, place: list[float]) -> tuple[Array, Array]:
    """Return a mesh of a size, turned about the vertical, that stands at a place."""
    mesh = upright(name, size)
    vertices: Array = np.asarray(mesh.vertices, float)
    cos, sin = math.cos(turn), math.sin(turn)
    vertices = vertices @ np.array([[cos, 0, -sin], [0, 1, 0], [sin, 0, cos]]).T
    vertices[:, 1] -= vertices[:, 1].max()
    return vertices + np.array(place), np.asarray(mesh.triangles)


def table() -> nacre.Mesh:
    """Return a table with three figures and three boxes on it, in a corner of a room."""
    return merged(
        [
            box([0, 0.025, 0], [1.4, 0.05, 0.9], 0),
            box([0, 0.75, 0], [8, 0.1, 8], 0),
            box([0, -0.5, 3], [8, 3, 0.1], 0.1),
            box([-3, -0.5, 0], [0.1, 3, 8], 0),
            standing("homer", 0.25, 0.4, [-0.2, 0, 0.05]),
            standing("spot", 0.2, 2, [0.15, 0, 0.1]),
            standing("fandisk", 0.12, 1, [0.05, 0, -0.15]),
            box([0.3, -0.06, -0.1], [0.1, 0.12, 0.06], 0.5),
            box([-0.35, -0.04, -0.15], [0.18, 0.08, 0.1], 0.9),
            box([-0.05, -0.1, 0.25], [0.08, 0.2, 0.08], 0.2),
        ]
    )


def bust() -> nacre.Mesh:
    """Return the upper part of a figure 0.6 m high, whose head is the middle."""
    mesh = figure("homer")
    vertices: Array = 0.35 * np.asarray(mesh.vertices, float)
    return nacre.Mesh(vertices - [0, vertices[:, 1].min() + 0.13, 0], mesh.triangles)


def corridor() -> nacre.Mesh:
    """Return a corridor two metres wide, with door frames on either side and three cupboards."""
    rng = np.random.default_rng(9)
    parts = [
        box([0, 1.2, 6], [2.2, 0.1, 20], 0),
        box([0, -1.4, 6], [2.2, 0.1, 20], 0),
        box([-1.05, 0, 6], [0.1, 3, 20], 0),
        box([1.05, 0, 6], [0.1, 3, 20], 0),
        box([0, 0, 15], [3, 3, 0.1], 0),
    ]
    for z in np.arange(1, 15, 1.7):
        side = rng.choice([-1, 1])
        parts.append(box([side, 0.1, z + rng.uniform(-0.3, 0.3)], [0.1, 2.1, 0.1], 0))
        parts.append(box([side, 0.1, z + 0.9], [0.1, 2.1, 0.1], 0))
        parts.append(box([side, -0.95, z + 0.45], [0.1, 0.1, 1.0], 0))
    return merged(parts + [box([-0.8, 0.8, z], [0.35, 0.8, 0.5], 0) for z in (3.1, 8.2, 11)])


def shelf() -> nacre.Mesh:
    """Return a shelf of books before a wall."""
    rng = np.random.default_rng(13)
    parts = [box([0, 0, 1.35], [4, 3, 0.1], 0)]
    parts += [box([0, y, 1.2], [2.4, 0.02, 0.3], 0) for y in np.arange(-0.9, 1.0, 0.35)]
    for y in np.arange(-0.9, 0.9, 0.35):
        x = -1.2
        while x < 1.15:
            width, height, depth = rng.uniform(0.015, 0.06), rng.uniform(0.18, 0.3), rng.uniform(0.12, 0.24)
            if rng.random() < 0.85:
                place = [x + width / 2, y + 0.34 - height / 2, 1.34 - depth / 2]
                parts.append(box(place, [width, height, depth], 0))
            x += width + 0.002
    return merged(parts)


def room() -> nacre.Mesh:
    """Return the office, with walls and things on all sides."""
    parts = [
        box([0, -0.3, -2.5], [8, 3.4, 0.1], 0),
        box([-3.5, -0.3, 1], [0.1, 3.4, 8], 0),
        box([-1.5, 0.6, -2], [1, 0.9, 0.6], 0.1),
        box([1.2, 0.5, -2.1], [0.6, 1.1, 0.5], 0),
        box([-3.1, 0.2, 0.5], [0.5, 1.6, 1.2], 0),
        box([1.7, 0.7, 0], [0.6, 0.6, 0.6], 0.5),
    ]
    return merged(office() + parts)


def in_hand(step: float, count: int, distance: float, height: float, middle: list[float]) -> list[Array]:
    """Return poses of a camera that is carried around something, in steps of so many degrees."""
    rng = np.random.default_rng(3)
    shakes, wobbles = trembling(rng, count, 0.01), trembling(rng, count, 0.015)
    poses = []
    for k in range(count):
        angle = math.radians(step * k)
        offset = np.array([distance * math.sin(angle), -height, -distance * math.cos(angle)])
        place = np.array(middle) + offset + shakes[k]
        poses.append(looking(place, np.array(middle) + wobbles[k] - place))
    return poses


def twisting(step: float, count: int) -> list[Array]:
    """Return poses of a camera in the hand that turns about its axis by up to so many degrees a frame."""
    shakes = trembling(np.random.default_rng(2), count, 0.01)
    poses = []
    for k in range(count):
        ahead = np.array([0.25 * math.sin(k / 23), 0.15 * math.sin(k / 17), 1])
        place = shakes[k] + np.array([0.3 * math.sin(k / 40), 0.1 * math.sin(k / 31), 0])
        poses.append(looking(place, ahead, math.radians(30 * step) * math.sin(k / 30)))
    return poses


def turning(step: float, count: int) -> list[Array]:
    """Return poses of a camera that turns about itself, in steps of so many degrees."""
    rng = np.random.default_rng(6)
    shakes, wobbles = trembling(rng, count, 0.004), trembling(rng, count, math.radians(0.4))
    poses = []
    for k in range(count):
        angle = math.radians(step * k)
        ahead = np.array([math.sin(angle), 0.1 + wobbles[k, 0], math.cos(angle)])
        poses.append(looking(shakes[k] + np.array([0, 0, 0.6]), ahead, wobbles[k, 2]))
    return poses


def along(rate: int, count: int) -> list[Array]:
    """Return poses of a walk of 1 m/s along the corridor."""
    rng = np.random.default_rng(8)
    total = count * 30 // rate
    shakes, wobbles = trembling(rng, total, 0.015), trembling(rng, total, math.radians(1))
    poses = []
    for k in range(0, total, 30 // rate):
        place = np.array([0.2 * math.sin(k / 25), 0.03 * math.sin(k / 5), k / 30]) + shakes[k]
        ahead = np.array([0.3 * math.sin(k / 20) + wobbles[k, 1], 0.05 + wobbles[k, 0], 1])
        poses.append(looking(place, ahead, wobbles[k, 2]))
    return poses[:count]
