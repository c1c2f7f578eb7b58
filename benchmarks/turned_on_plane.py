#!/usr/bin/env python3
"""
Hold registration scores against the truth, of objects that turned far on their plane.

Simulated cameras that stand still see five objects on a table before a wall, each turned four times by 60, 75
and 90 degrees. Of the views that the search on the plane has found, prints by registration score how many are
right, within 5 degrees and a centimetre, and how many the curve that holds near a guess would expect; how
many of all are right, which is their ``probability``; and the logistic curve that fits them best.

    python benchmarks/turned_on_plane.py
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from typing import Any

import numpy as np
import numpy.typing as npt
from accuracy_statement import OBJECTS
from cases import object_mesh
from simulated import box, merged, turn_about_y

import nacre

Array = npt.NDArray[Any]
CAMERA = nacre.Camera(320, 240, 450, 450, 159.5, 119.5)
SIZE = 0.16
"""[m] The longest side of an object."""
SENSORS = ("stereo", "structured_light", "time_of_flight")
EVEN_ODDS, POWER = 0.092, 3.13  # of the curve near a guess: cpp/src/tracking/limits.hpp
BINS = (0.0, 0.03, 0.06, 0.12, 0.24, 0.5, math.inf)


def standing(name: str) -> nacre.Mesh:
    """Return an object on the plane y = 0, in the middle, y up."""
    mesh = object_mesh(name)
    vertices = mesh.vertices * (SIZE / np.ptp(mesh.vertices, axis=0).max())
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    middle = [(low[0] + high[0]) / 2, low[1], (low[2] + high[2]) / 2]
    return nacre.Mesh(vertices - middle, mesh.triangles)


def camera_pose() -> Array:
    """Return the pose of a camera that looks down on the object."""
    eye, target = np.array([0.05, 0.3, 0.55]), np.array([0.0, SIZE / 2, 0.0])
    forward = (target - eye) / np.linalg.norm(target - eye)
    right = np.cross(forward, [0, 1, 0])
    right /= np.linalg.norm(right)
    pose = np.eye(4)
    pose[:3] = np.column_stack([right, np.cross(forward, right), forward, eye])
    return pose


def found_on_plane(name: str, step: float, sensor: Any) -> Iterator[tuple[float, bool]]:
    """Yield the score of each view that the search has found, and whether its pose is right."""
    world, thing = camera_pose(), standing(name)
    around = [box([0, -0.01, 0], [1.2, 0.02, 1.0], 0.0), box([0, 0.3, -0.45], [1.6, 1.0, 0.02], 0.0)]
    middle = np.linalg.inv(world) @ [0, SIZE / 2, 0, 1]
    model = nacre.Model(CAMERA, region={"object": True})
    for i in range(4):
        turn = turn_about_y(i * step)
        scene = merged([(thing.vertices @ turn[:3, :3].T, thing.triangles), *around])
        depth = scene.simulate_depth(CAMERA, world, sensor=sensor, seed=i)
        report = model.add_frame(depth)
        if report.status == "LOST" or not report.corrects_earlier:
            continue
        off = np.linalg.inv(world) @ turn @ world @ report.world_from_camera  # the identity where it is right
        angle = math.acos(min(1.0, max(-1.0, (np.trace(off[:3, :3]) - 1) / 2)))
        shift = float(np.linalg.norm((off @ middle - middle)[:3]))
        yield report.score, angle < math.radians(5) and shift < 0.01


def fitted(scores: Array, right: Array) -> tuple[float, float]:
    """Return even odds and power of the likeliest curve, of a grid."""
    curves = itertools.product(np.geomspace(0.002, 0.2, 200), np.linspace(0.5, 6, 111))

    def log_likelihood(curve: tuple[float, float]) -> float:
        odds = (scores / curve[0]) ** curve[1]
        return float(np.log(np.where(right, odds, 1.0) / (1 + odds)).sum())

    return max(curves, key=log_likelihood)


def main() -> None:
    """Print the table and the curve."""
    told: list[tuple[float, bool]] = []
    for name, step, sensor in itertools.product(OBJECTS, (60, 75, 90), SENSORS):
        told += found_on_plane(name, math.radians(step), sensor)
    scores, right = np.array(told).T
    expected = 1 / (1 + (EVEN_ODDS / scores) ** POWER)
    print("| score | views | right | expected by the curve |")
    print("|---|---|---|---|")
    for low, high in itertools.pairwise(BINS):
        rows = (low <= scores) & (scores < high)
        print(
            f"| {low:g} to {high:g} | {rows.sum()} | {right[rows].sum():.0f} | {expected[rows].sum():.1f} |"
        )
    print(f"{right.sum():.0f} of {len(right)} are right")
    even, power = fitted(scores, right > 0)
    print(f"even odds at {even:.3g}, power {power:.3g}")


if __name__ == "__main__":
    main()
