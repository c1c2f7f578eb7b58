"""A cloud of survey coordinates, small enough to be known and large enough for several cells."""

from __future__ import annotations

import hashlib
from pathlib import Path

import numpy as np

import nacre

NUM_POINTS = 24_000
ORIGIN = np.array([4_000_000.0, 5_400_000.0, 120.0])
CELLS = {"points_per_cell": 6_000, "memory": "1GB"}


def sha256(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def hills(count: int = NUM_POINTS, seed: int = 0) -> nacre.Cloud:
    """Return points of hills in whole millimetres, with what a scanner tells of each."""
    random = np.random.default_rng(seed)
    xy = random.uniform(0, 20, (count, 2))
    z = np.sin(xy[:, 0]) * np.cos(xy[:, 1] / 2) + random.normal(0, 0.02, count)
    points = ORIGIN + np.round(np.column_stack([xy, z]), 3)
    attributes = {
        "intensity": random.integers(0, 60_000, count).astype(np.uint16),
        "classification": random.integers(0, 7, count).astype(np.uint8),
        "gps_time": random.uniform(0, 1e6, count),
    }
    return nacre.Cloud(points, None, random.integers(0, 256, (count, 3), dtype=np.uint8), attributes)


def write(path: Path, cloud: nacre.Cloud) -> Path:
    nacre.write_points(path, cloud)
    return path
