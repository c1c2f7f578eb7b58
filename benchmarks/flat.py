"""
A camera goes round and round through the four rooms of a flat: what that takes, and how well it closes.

    python benchmarks/flat.py                                # 10 000 frames, eight rounds
    python benchmarks/flat.py --frames 1250 --laps 1         # one round, as fast
    python benchmarks/flat.py --max-points 300000            # what a model that is full does
    python benchmarks/flat.py --max-points 300000 --points-folder parked  # points leave memory instead

Prints a line for each part of the recording: frames that were tracked and loops that were closed in it,
processor time of a frame on one thread, and at its end points, spacing and memory of the process, and the
error of the newest pose. The last line has the errors of all poses as they are at the end; the first is
given.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from suite.scenes import box, joined

import nacre

CAMERA = nacre.Camera(width=320, height=240, fx=262, fy=262, cx=159.5, cy=119.5)
HALF_FLAT, CEILING, FLOOR, LINTEL = 4.0, -1.5, 1.1, -0.9  # [m], y down; the camera's height is 0
HALF_WALL, HALF_DOOR, RADIUS = 0.06, 0.6, 2.5  # [m]; the camera's circle leads through the doors
PIECES_OF_FURNITURE = 160

Array = NDArray[np.float64]


def flat_mesh() -> nacre.Mesh:
    """Return a flat of 8 x 8 m: two walls that cross, each with two doors, and furniture around."""
    low, high = np.array([-HALF_FLAT, CEILING, -HALF_FLAT]), np.array([HALF_FLAT, FLOOR, HALF_FLAT])
    parts = box(low, high)
    for axes in ([0, 1, 2], [2, 1, 0]):
        doors = np.array([-RADIUS - HALF_DOOR, -RADIUS + HALF_DOOR])
        for start, end in [(-HALF_FLAT, doors[0]), (doors[1], -doors[1]), (-doors[0], HALF_FLAT)]:
            wall = np.array([[-HALF_WALL, CEILING, start], [HALF_WALL, FLOOR, end]])[:, axes]
            parts += box(wall[0], wall[1])
        for middle in (-RADIUS, RADIUS):
            over = [[-HALF_WALL, CEILING, middle - HALF_DOOR], [HALF_WALL, LINTEL, middle + HALF_DOOR]]
            parts += box(*np.array(over)[:, axes])
    rng = np.random.default_rng(5)
    for _ in range(PIECES_OF_FURNITURE):
        size = rng.uniform([0.15, 0.1, 0.1], [0.9, 1.0, 0.5])
        along, side = rng.uniform(-HALF_FLAT, HALF_FLAT - size[0]), rng.integers(4)
        bottom = FLOOR if rng.random() < 0.5 else rng.uniform(CEILING + size[1], FLOOR)
        corners = np.array(
            [[along, bottom - size[1], HALF_FLAT - size[2]], [along + size[0], bottom, HALF_FLAT]]
        )
        turned = [corners, -corners, corners[:, ::-1], -corners[:, ::-1]][side]
        turned[:, 1] = corners[:, 1]
        parts += box(turned.min(axis=0), turned.max(axis=0))
    return joined(parts)


def path(frames: int, laps: int) -> Array:
    """Return the poses (frames, 4, 4) of a camera on a circle, that looks ahead and outwards, and sways."""
    angles = 2 * np.pi * laps * np.arange(frames) / frames
    heading = angles + np.pi / 5 + 0.15 * np.sin(5 * angles)  # from outwards towards ahead
    pitch = 0.12 * np.sin(7 * angles + 0.5)
    ahead = np.stack(
        [np.cos(pitch) * np.cos(heading), np.sin(pitch), np.cos(pitch) * np.sin(heading)], axis=-1
    )
    right = np.cross([0.0, 1.0, 0.0], ahead)
    right /= np.linalg.norm(right, axis=-1, keepdims=True)
    poses = np.tile(np.eye(4), (frames, 1, 1))
    poses[:, :3, :3] = np.stack([right, np.cross(ahead, right), ahead], axis=-1)
    poses[:, :3, 3] = np.stack(
        [RADIUS * np.cos(angles), 0.08 * np.sin(3 * angles), RADIUS * np.sin(angles)], axis=-1
    )
    return poses


def errors(poses: Array, truth: Array) -> tuple[Array, Array]:
    """Return how far poses are from the truth [mm], and turned [degrees]."""
    apart = np.linalg.inv(truth) @ poses
    sine = np.linalg.norm(apart[:, :3, :3] - np.swapaxes(apart[:, :3, :3], 1, 2), axis=(1, 2)) / np.sqrt(8)
    cosine = (np.trace(apart[:, :3, :3], axis1=1, axis2=2) - 1) / 2
    return 1000 * np.linalg.norm(apart[:, :3, 3], axis=1), np.degrees(np.arctan2(sine, cosine))


def memory_mb() -> float:
    """Return the resident memory of this process; NaN where the system does not tell it so."""
    status = Path("/proc/self/status")
    if not status.exists():
        return float("nan")
    (line,) = (line for line in status.read_text().splitlines() if line.startswith("VmRSS:"))
    return int(line.split()[1]) / 1024


def run(
    frames: int,
    laps: int,
    only: int | None,
    part: int,
    spacing: float,
    max_points: int,
    points_folder: str | None,
) -> None:
    """Grow the model of the flat, and print what it takes."""
    mesh, truth = flat_mesh(), path(frames, laps)[:only]
    model = nacre.Model(
        CAMERA, num_threads=1, spacing=spacing, max_points=max_points, points_folder=points_folder
    )
    tracked, loops, seconds = 0, 0, 0.0
    for k in range(len(truth)):
        depth = mesh.simulate_depth(CAMERA, truth[k], noise="kinect", seed=k)
        start = time.process_time()
        report = model.add_frame(depth, guess=truth[0], keep_guess=True) if k == 0 else model.add_frame(depth)
        seconds += time.process_time() - start
        tracked += report.tracked
        loops += report.loop_frame is not None
        if (k + 1) % part == 0 or k + 1 == len(truth):
            count = k % part + 1
            error, turn = errors(report.world_from_camera[None], truth[k : k + 1])
            print(
                f"frame {k + 1:6d}: {tracked}/{count} tracked, {loops} loops,",
                f"{1000 * seconds / count:.1f} ms, {len(model)} points,",
                f"spacing {1000 * model.spacing:.2f} mm, {memory_mb():.0f} MB,",
                f"off by {error[0]:.1f} mm and {turn[0]:.3f} degrees",
                flush=True,
            )
            tracked, loops, seconds = 0, 0, 0.0
    error, turn = errors(np.asarray(model.poses), truth)
    worst = f"worst {error.max():.1f} mm and {turn.max():.3f} degrees"
    print(f"all poses: median {np.median(error):.1f} mm, {worst}")


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--frames", type=int, default=10_000, help="default 10000")
    parser.add_argument("--laps", type=int, default=8, help="rounds through the flat; default 8")
    parser.add_argument("--only", type=int, help="so many frames, of its beginning")
    parser.add_argument("--part", type=int, default=1000, help="frames of a line; default 1000")
    parser.add_argument(
        "--spacing", type=float, default=0.0, help="of points [m]; by default the model's own"
    )
    parser.add_argument("--max-points", type=int, default=20_000_000, help="of the model; default 20 million")
    parser.add_argument(
        "--points-folder", help="where points go beyond --max-points that are far from the camera"
    )
    run(**vars(parser.parse_args()))


if __name__ == "__main__":
    main()
