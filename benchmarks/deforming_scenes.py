"""
Simulated recordings of things that bend and move while the camera goes round them, with the exact truth.

Their vertices keep their indices, so that every point of the surface can be followed: a triangle and a place
in it are a piece of the material, wherever it is.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt
from cases import SENSORS, Array, object_mesh
from scipy.ndimage import map_coordinates

import nacre

SPOTS = (0.016, 0.04)
"""Between spots of paint [m]."""


@dataclass(frozen=True, eq=False)
class Thing:
    """A surface that moves: ``shape(phase)`` are its vertices (V, 3) [m]; at phase 0 it rests."""

    shape: Callable[[float], Array]
    triangles: npt.NDArray[np.int32]
    turn: float  # the camera goes about it by this angle, there and back [rad]
    distance: float = 0.6  # of the camera from its centre [m]


@dataclass(frozen=True, eq=False)
class Recording:
    """Images of a thing, and where all of it was: vertices (V, 3) [m] in each camera's frame."""

    name: str
    camera: nacre.Camera
    depths: list[Array]
    vertices: list[Array]
    triangles: npt.NDArray[np.int32]
    rest: Array  # vertices at rest

    def mesh(self, index: int) -> nacre.Mesh:
        """Return the true surface at a frame, in its camera's frame."""
        return nacre.Mesh(self.vertices[index], self.triangles)


def record(
    name: str,
    num_frames: int,
    *,
    sensor: str = "kinect",
    seed: int = 0,
    is_rigid: bool = False,
    camera: nacre.Camera | None = None,
) -> Recording:
    """
    Film one of THINGS; ``is_rigid``: held still in the shape of the first frame, on the same path.

    The camera is the sensor's, where none is given.

    The thing goes from rest to its farthest shape and back, twice, while the camera goes about it and comes
    back.
    """
    thing = THINGS[name](np.random.default_rng(seed))
    camera = camera or SENSORS[sensor]
    errors: dict[str, Any] = (
        {"noise": "kinect", "edge_mixing": 1.0} if sensor == "kinect" else {"sensor": sensor}
    )
    depths, vertices = [], []
    for i in range(num_frames):
        time = i / num_frames
        shape = thing.shape(0.0 if is_rigid else math.sin(2 * math.pi * time) ** 2)
        angle = 0.5 * thing.turn * (1 - math.cos(2 * math.pi * time))
        centre = thing.shape(0.0).mean(axis=0)
        local = (shape - centre) @ about((0.0, 1.0, 0.0), angle).T
        seen = local * (1, -1, -1) + (0, 0, thing.distance)  # y up and z forward become y down and z away
        mesh = nacre.Mesh(seen, thing.triangles)
        depths.append(mesh.simulate_depth(camera, np.eye(4), seed=1000 * seed + i, **errors))
        vertices.append(seen)
    return Recording(name, camera, depths, vertices, thing.triangles, thing.shape(0.0))


def paint(recording: Recording) -> list[npt.NDArray[np.uint8]]:
    """Return what a colour camera sees: spots that stay on the material, lit from one side, and noise."""
    random = np.random.default_rng(7)
    grids = {size: random.integers(0, 110, (64, 64, 64)).astype(float) for size in SPOTS}
    camera = recording.camera
    v, u = np.indices((camera.height, camera.width))
    rays = np.stack([(u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, np.ones(u.shape)], -1)
    rays = rays.reshape(-1, 3)
    images = []
    for index in range(len(recording.depths)):
        hits = recording.mesh(index).cast(np.zeros_like(rays), rays)
        seen = np.isfinite(hits.distances)
        points = hits.distances[seen, None] * rays[seen]
        triangles = recording.triangles[hits.triangles[seen]]
        corners = recording.vertices[index][triangles]
        weights = np.linalg.solve(corners.transpose(0, 2, 1), points[..., None])
        material = (weights * recording.rest[triangles]).sum(axis=1)
        spots = [
            map_coordinates(grid, material.T / size, order=1, mode="grid-wrap")
            for size, grid in grids.items()
        ]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        light = 0.6 + 0.4 * np.abs(normals @ (0.3, -0.5, -0.81))
        brightness = np.zeros(len(rays))
        brightness[seen] = np.sum(spots, axis=0) * light + random.normal(0, 3, seen.sum())
        image = np.clip(brightness, 0, 255).reshape(camera.height, camera.width, 1)
        images.append(np.repeat(image, 3, axis=-1).astype(np.uint8))
    return images


def pipe(rng: np.random.Generator, *, around: int = 120, along: int = 200) -> Thing:
    """Return a pipe with bumps that bends to an arc and twists; 32 cm long and 9 cm thick."""
    length, radius = 0.32, 0.045
    s, angle = np.meshgrid(
        np.linspace(-length / 2, length / 2, along), 2 * math.pi * np.arange(around) / around, indexing="ij"
    )
    bumps = _bumps(rng, np.stack([s, radius * angle], -1), period=(math.inf, 2 * math.pi * radius), number=60)
    rounding = np.sqrt(np.clip(1 - ((np.abs(s) - length / 2 + radius) / radius).clip(0) ** 2, 0.01, 1))
    r = (radius + bumps) * rounding
    towards = rng.uniform(0, 2 * math.pi)
    bend, twist = rng.uniform(0.9, 1.2), rng.choice([-1, 1]) * rng.uniform(0.5, 0.7)  # [rad]

    def shape(phase: float) -> Array:
        turned = angle + phase * twist * s / length
        across, beside = r * np.cos(turned - towards), r * np.sin(turned - towards)
        curvature = max(phase * bend / length, 1e-6)  # nearly straight, so that there is a radius
        tangent = curvature * s
        height = (1 / curvature - across) * np.sin(tangent)
        out = 1 / curvature - (1 / curvature - across) * np.cos(tangent)
        x = out * math.cos(towards) - beside * math.sin(towards)
        z = out * math.sin(towards) + beside * math.cos(towards)
        return np.stack([x, height, z], -1).reshape(-1, 3)

    return Thing(shape, _grid(along, around, wraps=True), rng.choice([-1, 1]) * math.radians(120))


def cloth(rng: np.random.Generator, *, across: int = 120, along: int = 90) -> Thing:
    """Return a sheet with bumps, 40 by 30 cm, in which waves rise: it bends without being stretched."""
    x, y = np.meshgrid(np.linspace(-0.2, 0.2, across), np.linspace(-0.15, 0.15, along), indexing="ij")
    bumps = _bumps(rng, np.stack([x, y], -1), period=(math.inf, math.inf), number=40)
    way = rng.uniform(-0.5, 0.5)
    u, v = x * math.cos(way) + y * math.sin(way), y * math.cos(way) - x * math.sin(way)
    steps = np.linspace(-0.26, 0.26, 2001)
    wavelength, offset = rng.uniform(0.18, 0.24), rng.uniform(0, 2 * math.pi)

    def shape(phase: float) -> Array:
        slope = 0.7 * phase * np.sin(2 * math.pi * steps / wavelength + offset + 1.5 * phase)
        at = [np.cumsum(part) * (steps[1] - steps[0]) for part in (np.cos(slope), np.sin(slope))]
        p, q = (np.interp(u, steps, line - line.mean()) for line in at)
        tilt = np.interp(u, steps, slope)
        p, q = p - bumps * np.sin(tilt), q + bumps * np.cos(tilt)
        return np.stack(
            [p * math.cos(way) - v * math.sin(way), p * math.sin(way) + v * math.cos(way), q], -1
        ).reshape(-1, 3)

    return Thing(shape, _grid(across, along, wraps=False), rng.choice([-1, 1]) * math.radians(40))


@dataclass(frozen=True)
class Limb:
    """What swings about a joint: its tip, in parts of the bounding box, and its length and axis."""

    tip: tuple[float, float, float]
    length: float  # from the tip to the joint, along the surface [m]
    axis: tuple[float, float, float]
    angle: float  # [rad]


_SIDEWAYS, _UP, _FORWARD = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
_LIMBS = {
    "homer": (
        0.5,
        Limb((0.0, 0.62, 0.5), 0.12, _FORWARD, 0.7),
        Limb((1.0, 0.62, 0.5), 0.12, _FORWARD, 0.6),
        Limb((0.3, 0.0, 0.5), 0.17, _SIDEWAYS, 0.5),
        Limb((0.7, 0.0, 0.5), 0.17, _SIDEWAYS, -0.4),
        Limb((0.5, 1.0, 0.5), 0.14, _FORWARD, 0.3),
    ),
    "spot": (
        0.2,
        Limb((0.5, 0.8, 1.0), 0.17, _UP, 0.5),
        Limb((0.1, 0.0, 0.2), 0.11, _SIDEWAYS, 0.5),
        Limb((0.9, 0.0, 0.2), 0.11, _SIDEWAYS, -0.5),
        Limb((0.1, 0.0, 0.6), 0.11, _SIDEWAYS, -0.5),
        Limb((0.9, 0.0, 0.6), 0.11, _SIDEWAYS, 0.5),
    ),
}


def creature(name: str, rng: np.random.Generator) -> Thing:
    """Return homer or spot (shared/data/meshes) with limbs that swing, by linear blend skinning."""
    scale, *limbs = _LIMBS[name]
    mesh = object_mesh(name)
    size = np.ptp(mesh.vertices, axis=0)
    factor = scale * {"homer": 0.8404, "spot": 1.718}[name] / float(size.max())
    rest = factor * np.asarray(mesh.vertices, np.float64)
    lower, size = rest.min(axis=0), np.ptp(rest, axis=0)
    swings = [(limb, rng.uniform(0.7, 1.0) * rng.choice([-1, 1])) for limb in limbs]
    weights, joints = [], []
    for limb, _ in swings:
        tip = int(np.argmin(np.linalg.norm(rest - lower - limb.tip * size, axis=1)))
        far = _along_surface(rest, mesh.triangles, tip)
        width = 0.35 * limb.length
        weights.append(_smooth(0.5 + (limb.length - far) / (2 * width)))
        joints.append(rest[np.abs(far - limb.length) < 0.5 * width].mean(axis=0))

    def shape(phase: float) -> Array:
        moved = rest.copy()
        for (limb, swing), weight, joint in zip(swings, weights, joints, strict=True):
            rotation = about(limb.axis, phase * swing * limb.angle)
            moved += weight[:, None] * ((rest - joint) @ rotation.T + joint - rest)
        return moved

    return Thing(shape, mesh.triangles, rng.choice([-1, 1]) * math.radians(120))


THINGS: dict[str, Callable[[np.random.Generator], Thing]] = {
    "pipe": pipe,
    "cloth": cloth,
    "homer": partial(creature, "homer"),
    "spot": partial(creature, "spot"),
}


def about(axis: tuple[float, float, float], angle: float) -> Array:
    """Return the rotation about a unit axis (Rodrigues)."""
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.asarray(np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross)


def _bumps(rng: np.random.Generator, places: Array, *, period: tuple[float, float], number: int) -> Array:
    """Return a relief over a surface whose places (..., 2) are in metres: round bumps and dents."""
    middles = rng.uniform(places.min(axis=(0, 1)), places.max(axis=(0, 1)), (number, 2))
    heights = rng.choice([-1, 1], number) * rng.uniform(0.002, 0.005, number)
    widths = rng.uniform(0.007, 0.014, number)
    relief = np.zeros(places.shape[:-1])
    for middle, height, width in zip(middles, heights, widths, strict=True):
        apart = np.abs(places - middle)
        apart = np.minimum(apart, np.array(period) - apart)
        relief += height * np.exp(-0.5 * (apart**2).sum(axis=-1) / width**2)
    return np.asarray(relief)


def _grid(rows: int, columns: int, *, wraps: bool) -> npt.NDArray[np.int32]:
    """Return the triangles of a grid of vertices; the last column may join the first."""
    row, column = np.meshgrid(np.arange(rows - 1), np.arange(columns - (not wraps)), indexing="ij")
    a, b = row * columns + column, row * columns + (column + 1) % columns
    quads = np.stack([a, b, b + columns, a, b + columns, a + columns], -1)
    return quads.reshape(-1, 3).astype(np.int32)


def _along_surface(vertices: Array, triangles: npt.NDArray[np.int32], start: int) -> Array:
    """Return how far each vertex is from one along edges (Dijkstra) [m]."""
    pairs = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    pairs = np.unique(np.sort(pairs, axis=1), axis=0)
    lengths = np.linalg.norm(vertices[pairs[:, 0]] - vertices[pairs[:, 1]], axis=1)
    links: list[list[tuple[int, float]]] = [[] for _ in vertices]
    for (a, b), length in zip(pairs.tolist(), lengths.tolist(), strict=True):
        links[a].append((b, length))
        links[b].append((a, length))
    far = [math.inf] * len(vertices)
    far[start], queue = 0.0, [(0.0, start)]
    while queue:
        here, a = heapq.heappop(queue)
        for b, length in links[a] if here <= far[a] else []:
            if here + length < far[b]:
                far[b] = here + length
                heapq.heappush(queue, (far[b], b))
    return np.array(far)


def _smooth(x: Array) -> Array:
    """Return a step from 0 at 0 to 1 at 1 (Perlin's, whose first two derivatives are continuous)."""
    t = np.clip(x, 0, 1)
    return np.asarray(t**3 * (t * (6 * t - 15) + 10))
