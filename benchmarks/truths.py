#!/usr/bin/env python
"""
How true the true poses of real recordings are: by which poses the depth images agree better, theirs or ours.

Points of all claimed frames are placed by both. Where frames meet that are a fifth of the recording apart
or more, the thickness of what should be one surface is measured: the root mean square distance from their
plane of points within 4 % of the median depth (mean plane variance; Razlaw et al. 2015). A frame that is
called wrong, yet lies in a thinner map where we place it than where its true pose does, is wrong by less
than the truth is.

Turns from frame to frame show images that are older than their true poses: the lag is where both agree
best.

    python benchmarks/truths.py rpy d435
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import cases
import numpy as np
import numpy.typing as npt

import nacre

Array = npt.NDArray[Any]
NAMES = ["teddy", "rpy", "d435", "iphone", "icl", "cabinet", "robot", "sr300", "boxcan", "door"]
POINTS_OF_FRAME = 1500
QUERIES = 20_000
RADIUS = 0.04
"""Of the median depth."""


@dataclass
class Placed:
    """Points of the claimed frames in the cameras' frames, and both poses of each."""

    indices: Array  # of the frames
    points: list[Array]
    ours: Array
    truths: Array
    right: npt.NDArray[np.bool_]
    apart: int  # frames from which on it is another visit
    depth: float


def placed(case: cases.Case) -> Placed:
    """Run a recording."""
    _, model = cases.run(case, num_threads=0)
    claimed = [
        i
        for i, report in enumerate(model.frames)
        if report.status in ("TRACKED", "RELOCALISED") and case.truths[i] is not None
    ]
    ours = np.array([model.frames[i].world_from_camera for i in claimed])
    truths = np.array([case.truths[i] for i in claimed])
    depth = cases.middle_depth(case.depths)
    largest = cases.RIGHT_SHIFT * depth
    _, shifts, turns = cases.best_fit(ours, truths, largest, cases.RIGHT_TURN)
    rng = np.random.default_rng(0)
    points = []
    for i in claimed:
        seen = nacre.back_project(case.depths[i], case.camera).reshape(-1, 3)
        seen = seen[np.isfinite(seen).all(axis=-1) & (seen[:, 2] < 2.5 * depth)]
        points.append(rng.permutation(seen)[:POINTS_OF_FRAME])
    right = (shifts < largest) & (turns < cases.RIGHT_TURN)
    return Placed(np.array(claimed), points, ours, truths, right, len(case.depths) // 5, depth)


def thickness(found: Placed, poses: Array, queries: Array, owners: Array) -> Array:
    """Return the thickness of the surface around some points [m]; NaN where no visits meet."""
    world = np.concatenate(
        [p @ pose[:3, :3].T + pose[:3, 3] for p, pose in zip(found.points, poses, strict=True)]
    )
    distances, indices = nacre.KdTree(world).query(world[queries], k=64)
    near = distances < RADIUS * found.depth
    seen = found.indices[owners[indices]]
    visits = np.where(near, seen, -1).max(1) - np.where(near, seen, 10**9).min(1)
    result = np.full(len(queries), np.nan)
    for i in np.flatnonzero((near.sum(1) >= 12) & (visits >= found.apart)):
        neighbours = world[indices[i, near[i]]]
        result[i] = np.sqrt(max(0.0, np.linalg.eigvalsh(np.cov(neighbours.T, bias=True))[0]))
    return result


def earlier(truths: Array, lag: float) -> Array:
    """Return each true pose as it was some frames ago, at most one, but for the first and the last."""
    step = 1 if lag < 0 else -1
    beside = truths[1 + step : len(truths) - 1 + step]
    mixed = (1 - abs(lag)) * truths[1:-1] + abs(lag) * beside
    u, _, vt = np.linalg.svd(mixed[:, :3, :3])
    mixed[:, :3, :3] = u @ vt
    return mixed


def lag_of(found: Placed) -> float:
    """Return how many frames the images are older than their poses: where turns agree best."""

    def turns(poses: Array) -> Array:
        steps: Array = np.swapaxes(poses[:-1, :3, :3], 1, 2) @ poses[1:, :3, :3]
        return steps

    lags = np.linspace(-1, 1, 9)
    ours = turns(found.ours[1:-1])
    cosines = [(np.einsum("nij,nij->n", turns(earlier(found.truths, lag)), ours) - 1) / 2 for lag in lags]
    errors = np.mean(np.arccos(np.clip(cosines, -1, 1)) ** 2, axis=1)
    square, slope, _ = np.polyfit(lags, errors, 2)
    return float(np.clip(-slope / (2 * square), -1, 1))


def right_without(found: Placed, lag: float) -> str:
    """Return how many frames are right with true poses of the time of the images."""
    largest = cases.RIGHT_SHIFT * found.depth
    _, shifts, turns = cases.best_fit(found.ours[1:-1], earlier(found.truths, lag), largest, cases.RIGHT_TURN)
    return f"{np.sum((shifts < largest) & (turns < cases.RIGHT_TURN))} / {len(shifts)}"


def rows(names: list[str]) -> Iterator[list[str]]:
    """Return a row of the table for each recording."""
    for name in names:
        found = placed(cases.make(name))
        owners = np.repeat(np.arange(len(found.points)), [len(p) for p in found.points])
        queries = np.random.default_rng(1).permutation(len(owners))[:QUERIES]
        ours, theirs = (thickness(found, poses, queries, owners) for poses in (found.ours, found.truths))
        both = np.isfinite(ours) & np.isfinite(theirs)
        cells = [name, f"{found.right.sum()} / {len(found.right)}"]
        for some in (both, both & ~found.right[owners[queries]]):
            pair = (
                [1e3 * np.sqrt(np.mean(values[some] ** 2)) for values in (ours, theirs)] if some.any() else []
            )
            cells.append(" / ".join(f"{value:.2f}" for value in pair))
        lag = lag_of(found)
        yield [*cells, f"{lag:+.2f}", right_without(found, lag)]


def main() -> None:
    """Print the table."""
    heads = ["recording", "right / claimed", "thickness by our poses / the true ones [mm]"]
    heads += ["of wrong frames", "images older by [frames]", "right, without"]
    print(f"| {' | '.join(heads)} |\n|{'---|' * len(heads)}")
    for cells in rows(sys.argv[1:] or NAMES):
        print(f"| {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main()
