#!/usr/bin/env python3
"""
Compare simulated cameras with recordings of real ones: how depth errs on planes and at edges, and its holes.

Squares of pixels on which one plane explains depth are fitted in inverse depth. Prints, for each real
recording and for the sensor that imitates it in a simulated room:

- sd: standard deviation about the planes [mm], at the median depth of the squares [m];
- correlation of these residuals with those 1, 2, 4 and 8 pixels away, and with those of the next frame at the
  same pixels, and where the true motion has moved them;
- step: between neighbouring values of depth near the median depth [mm];
- holes: part of the pixels without depth;
- edge: how many pixels along rows are between the two surfaces of a step in depth, with depth; and without,
  where the nearer surface is on the right, and where it is on the left.

No recording of time of flight is at hand: its noise on walls is held against what Fankhauser et al. 2015 and
Nguyen et al. 2012 have published.

    python benchmarks/sensors.py
"""

from __future__ import annotations

import argparse
import itertools
import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from cases import DATA, SENSORS
from simulated import box, merged

import nacre

Array = npt.NDArray[Any]
SQUARE = 16
LAGS = (1, 2, 4, 8)
PLANE = 0.02
"""Of depth: how far a pixel of a square may be from its plane."""
EDGE = 0.2
"""Of depth: steps that count as edges."""
LEVEL = 0.015
"""Of depth: between neighbours on one surface."""
REACH = 6
"""[pixels] With depth, that an edge is at most wide."""

RECORDINGS = {
    "stereo": ("d435-t265-shelf",),
    "structured_light": ("tum-fr3-teddy", "tum-fr1-rpy"),
    "phone_lidar": ("iphone-lidar-office-a",),
}
ROOMS = {"stereo": 4.0, "structured_light": 4.0, "time_of_flight": 4.0, "phone_lidar": 7.0}
"""Their sizes [m]: those of the recordings' distances."""


WALLS = ((1.0, 0), (2.0, 0), (4.0, 0), (1.0, 30), (1.0, 60), (2.0, 60))
"""Their distances [m] and slants [degrees]: what time of flight, without a recording, is held against."""


@dataclass
class Frame:
    """A depth image [m] with the true pose."""

    depth: Array
    truth: Array


def plane_residuals(depth: Array, camera: nacre.Camera) -> Array:
    """Return by how much depth [m] is off the plane of its square; NaN where no plane explains the square."""
    left = np.full(depth.shape, np.nan)
    v, u = (axis.ravel() for axis in np.mgrid[0:SQUARE, 0:SQUARE] / SQUARE - 0.5)
    quadratic = np.stack([np.ones(u.shape), u, v, u * u, u * v, v * v], axis=1)
    for top, across in itertools.product(
        range(0, camera.height - SQUARE + 1, SQUARE), range(0, camera.width - SQUARE + 1, SQUARE)
    ):
        place = np.s_[top : top + SQUARE, across : across + SQUARE]
        z = depth[place].ravel().astype(float)
        valid = np.isfinite(z) & (z > 0)
        if valid.mean() < 0.9:
            continue
        terms, inverse = quadratic[valid], 1 / z[valid]
        flat = inverse - terms[:, :3] @ np.linalg.lstsq(terms[:, :3], inverse, rcond=None)[0]
        bent = inverse - terms @ np.linalg.lstsq(terms, inverse, rcond=None)[0]
        if np.quantile(np.abs(flat * z[valid]), 0.98) > PLANE or (flat**2).mean() > 1.5 * (bent**2).mean():
            continue
        residual = np.full(z.shape, np.nan)
        residual[valid] = -flat * z[valid] ** 2
        left[place] = residual.reshape(SQUARE, SQUARE)
    return left


def correlation(a: Array, b: Array) -> float:
    """Return the correlation of two images of residuals, where both have some."""
    both = np.isfinite(a) & np.isfinite(b)
    return float((a[both] * b[both]).mean() / math.sqrt((a[both] ** 2).mean() * (b[both] ** 2).mean()))


def neighbour_correlation(residual: Array, lag: int) -> float:
    """Return the correlation of pixels in a row, and in a column, within their squares."""
    pairs = []
    for image in (residual, residual.T):
        squares = image[: image.shape[0], : image.shape[1] // SQUARE * SQUARE]
        squares = squares.reshape(image.shape[0], -1, SQUARE)
        pairs.append((squares[..., lag:].ravel(), squares[..., :-lag].ravel()))
    return correlation(*(np.concatenate(side) for side in zip(*pairs, strict=True)))


def moved_residual(one: Frame, two: Frame, residual: Array, camera: nacre.Camera) -> Array:
    """Return the second frame's residuals at the pixels of the first that see the same point."""
    rows, columns = np.nonzero(np.isfinite(residual))
    z = one.depth[rows, columns].astype(float)
    rays = np.stack(
        [(columns - camera.cx) / camera.fx, (rows - camera.cy) / camera.fy, np.ones(len(z))], axis=1
    )
    motion = np.linalg.inv(two.truth) @ one.truth
    pixels = np.rint(camera.project((z[:, None] * rays) @ motion[:3, :3].T + motion[:3, 3]))
    inside = (np.isfinite(pixels) & (pixels >= 0) & (pixels < (camera.width, camera.height))).all(axis=1)
    u, v = pixels[inside].astype(int).T
    moved = np.full(residual.shape, np.nan)
    moved[rows[inside], columns[inside]] = plane_residuals(two.depth, camera)[v, u]
    return moved


def step_size(depth: Array) -> float:
    """Return the median gap between values of depth around the median."""
    z = np.unique(depth[np.isfinite(depth)])
    middle = np.searchsorted(z, np.nanmedian(depth))
    return float(np.median(np.diff(z[max(0, middle - 20) : middle + 20])))


def edges(depth: Array) -> tuple[float, float, float]:
    """
    Return how pixels are between the two surfaces of steps in depth, along rows.

    The mean number of those with depth, and the median number of those without where the nearer surface is on
    the right, and where it is on the left.
    """
    found: dict[bool, list[tuple[float, float]]] = {False: [], True: []}
    for row in depth[::2].astype(float):
        columns = np.flatnonzero(row > 0)
        z = row[columns]
        level = np.abs(np.diff(z)) < LEVEL * z[:-1]
        ends = [i for i in np.flatnonzero(level[:-1] & ~level[1:]) + 1 if i + 2 < len(z)]
        for i in ends:
            after = np.flatnonzero(level[i + 1 :][:REACH])
            if len(after) == 0:
                continue
            j = i + 1 + after[0]
            if abs(z[j] - z[i]) > EDGE * min(z[i], z[j]) and columns[j] - columns[i] < 10 * REACH:
                found[bool(z[j] < z[i])].append((j - i - 1, columns[j] - columns[i] - (j - i)))
    between = [filled for side in found.values() for filled, _ in side]
    holes = [float(np.median([hole for _, hole in found[side]] or [np.nan])) for side in (True, False)]
    return float(np.mean(between or [np.nan])), holes[0], holes[1]


def row_of(name: str, frames: list[tuple[Frame, Frame]], camera: nacre.Camera) -> str:
    """Return a line of the table."""
    rows = []
    for one, two in frames:
        residual = plane_residuals(one.depth, camera)
        on_plane = np.isfinite(residual)
        if on_plane.sum() < 5 * SQUARE**2:
            continue
        rows.append(
            [
                float(np.median(one.depth[on_plane])),
                1e3 * 1.4826 * float(np.nanmedian(np.abs(residual))),
                *(neighbour_correlation(residual, lag) for lag in LAGS),
                correlation(residual, plane_residuals(two.depth, camera)),
                correlation(residual, moved_residual(one, two, residual, camera)),
                1e3 * step_size(one.depth),
                100 * float(np.mean(~(one.depth > 0))),
                *edges(one.depth),
            ]
        )
    z, sd, *correlations, step, holes, edge, left, right = np.nanmedian(rows, axis=0)
    near = " | ".join(f"{c:.2f}" for c in correlations)
    sizes = f"{step:.2f} | {holes:.0f} % | {edge:.1f} | {left:.1f}, {right:.1f}"
    return f"| {name} | {z:.2f} | {sd:.2f} | {near} | {sizes} |"


def truth_of(frame: nacre.SequenceFrame) -> Array:
    """Return the true pose; NaN where it is not known."""
    return np.full((4, 4), np.nan) if frame.truth is None else frame.truth


def recorded(name: str, count: int) -> tuple[list[tuple[Frame, Frame]], nacre.Camera]:
    """Return some pairs of successive frames of a recording."""
    sequence = nacre.open_sequence(DATA / name).without_color()
    pairs = []
    for i in range(0, len(sequence) - 1, max(1, (len(sequence) - 1) // count)):
        one, two = sequence[i], sequence[i + 1]
        pairs.append((Frame(one.depth, truth_of(one)), Frame(two.depth, truth_of(two))))
    return pairs, sequence.camera


def room(size: float) -> nacre.Mesh:
    """Return a cube with a few boxes along its walls, about half its size away from its middle."""
    random = np.random.default_rng(2)
    parts = [box(np.zeros(3), [size, size, size], 0.0)]
    for i in range(14):
        angle = 2 * math.pi * (i + random.random()) / 14
        place = np.array([math.sin(angle), random.uniform(-0.6, 0.6), math.cos(angle)]) * 0.42 * size
        parts.append(box(place, size * random.uniform(0.1, 0.3, 3), random.uniform(0, math.pi)))
    return merged(parts)


def walk(angle: float) -> Array:
    """Return the pose of a camera in the middle of the room that looks around and moves a little."""
    pose = np.eye(4)
    cos, sin = math.cos(angle), math.sin(angle)
    pose[:3, :3] = np.array([[cos, 0.0, sin], [0.0, 1.0, 0.0], [-sin, 0.0, cos]])
    pose[:3, 3] = (0.1 * sin, 0.1 * math.sin(3 * angle), 0.1 * cos)
    return pose


def simulated(sensor: Any, count: int) -> tuple[list[tuple[Frame, Frame]], nacre.Camera]:
    """Return pairs of successive frames of a sensor in a room, between which it turns by 0.25 degrees."""
    scene, camera = room(ROOMS[sensor]), SENSORS[sensor]
    pairs = []
    for i in range(count):
        poses = [walk(2 * math.pi * i / count + turn) for turn in (0.0, math.radians(0.25))]
        one, two = (
            Frame(scene.simulate_depth(camera, pose, sensor=sensor, seed=2 * i + k), pose)
            for k, pose in enumerate(poses)
        )
        pairs.append((one, two))
    return pairs, camera


def wall_noise() -> None:
    """Print the noise of a wall, seen by time of flight, beside what is published."""
    camera = SENSORS["time_of_flight"]
    print("| | " + " | ".join(f"{z:g} m, {slant} degrees" for z, slant in WALLS) + " |")
    print("| --- " * (len(WALLS) + 1) + "|")
    simulated_sd, published = [], []
    for z, slant in WALLS:
        tilt = math.radians(slant)
        side = np.array([math.cos(tilt), 0, math.sin(tilt)])
        corners = [(0, 0, z) + x * side + (0, y, 0) for x, y in ((-9, -9), (9, -9), (9, 9), (-9, 9))]
        scene = nacre.Mesh(np.array(corners), np.array([[0, 1, 2], [0, 2, 3]]))
        images = [
            scene.simulate_depth(camera, np.eye(4), sensor=sensor)[196:228, 240:272]
            for sensor in ("time_of_flight", "none")
        ]
        simulated_sd.append(1e3 * float(np.nanstd(images[0] - images[1])))
        steep = tilt / (math.pi / 2 - tilt)
        axial = np.hypot(nacre.NoiseModel.time_of_flight().sigma(z), 0.0001 * steep**2 / math.sqrt(z))
        lateral = (0.8 + 0.035 * steep) * z / camera.fx * math.tan(tilt)
        published.append(1e3 * float(np.hypot(axial, lateral)))
    for name, values in (("simulated", simulated_sd), ("published", published)):
        print(f"| {name}, sd [mm] | " + " | ".join(f"{value:.2f}" for value in values) + " |")


def main() -> None:
    """Print the table."""
    layout = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=layout)
    parser.add_argument("--pairs", type=int, default=8, help="of frames, of each camera")
    parser.add_argument("sensors", nargs="*", default=list(ROOMS))
    options = parser.parse_args()
    lags = " | ".join(f"{lag} px" for lag in LAGS)
    others = "next, pixel | next, point | step [mm] | holes | edge [px] | its holes [px]"
    print(f"| | z [m] | sd [mm] | {lags} | {others} |")
    print("| --- " * 13 + "|")
    for sensor in options.sensors:
        for name in RECORDINGS.get(sensor, ()):
            print(row_of(name, *recorded(name, options.pairs)), flush=True)
        print(row_of(f"`{sensor}`", *simulated(sensor, options.pairs)), flush=True)
    if "time_of_flight" in options.sensors:
        print()
        wall_noise()


if __name__ == "__main__":
    main()
