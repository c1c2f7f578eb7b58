r"""
A camera goes round and round through the outer rooms of a flat: what that takes, and how well it closes.

    python benchmarks/flat.py                                # 10 000 frames, eight rounds
    python benchmarks/flat.py --frames 1250 --laps 1         # one round, as fast
    python benchmarks/flat.py --max-points 300000            # what a model that is full does
    python benchmarks/flat.py --max-points 300000 --points-folder parked  # points leave memory instead
    python benchmarks/flat.py --rooms 11 --laps 1.02 --spacing 0.004 --max-points 800000 \
        --points-folder parked                               # 40 rooms, once around: five million points

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
ROOM, CEILING, FLOOR, LINTEL = 4.0, -1.5, 1.1, -0.9  # [m], y down; the camera's height is 0
HALF_WALL, HALF_DOOR, RADIUS = 0.06, 0.6, 2.5  # [m]; the camera's way leads through the doors
PIECES_OF_FURNITURE = 80  # of two rooms, one at each end of the flat

Array = NDArray[np.float64]


def way_from_middle(rooms: int) -> float:
    """Return how far from the middle of a flat the camera walks along its outer walls [m]."""
    return RADIUS + (rooms - 2) * ROOM / 2


def flat_mesh(rooms: int = 2) -> nacre.Mesh:
    """Return a flat of rooms in a square: walls that cross, doors in the outer rooms, furniture around."""
    half, way = rooms * ROOM / 2, way_from_middle(rooms)
    parts = box(np.array([-half, CEILING, -half]), np.array([half, FLOOR, half]))
    doors = np.array([-way - HALF_DOOR, -way + HALF_DOOR])
    for axes in ([0, 1, 2], [2, 1, 0]):
        for place in ROOM * np.arange(1, rooms) - half:
            for start, end in [(-half, doors[0]), (doors[1], -doors[1]), (-doors[0], half)]:
                wall = [[place - HALF_WALL, CEILING, start], [place + HALF_WALL, FLOOR, end]]
                parts += box(*np.array(wall)[:, axes])
            for middle in (-way, way):
                over = [
                    [place - HALF_WALL, CEILING, middle - HALF_DOOR],
                    [place + HALF_WALL, LINTEL, middle + HALF_DOOR],
                ]
                parts += box(*np.array(over)[:, axes])
    rng = np.random.default_rng(5)
    for _ in range(PIECES_OF_FURNITURE * rooms):
        size = rng.uniform([0.15, 0.1, 0.1], [0.9, 1.0, 0.5])
        along, side = rng.uniform(-half, half - size[0]), rng.integers(4)
        bottom = FLOOR if rng.random() < 0.5 else rng.uniform(CEILING + size[1], FLOOR)
        corners = np.array([[along, bottom - size[1], half - size[2]], [along + size[0], bottom, half]])
        turned = [corners, -corners, corners[:, ::-1], -corners[:, ::-1]][side]
        turned[:, 1] = corners[:, 1]
        parts += box(turned.min(axis=0), turned.max(axis=0))
    return joined(parts)


def around(walked: Array, straight: float) -> tuple[NDArray[np.complex128], Array]:
    """Return places x + iz on a square with round corners, and the angles of what is outwards there."""
    corner, along = np.divmod(walked + straight / 2, straight + RADIUS * np.pi / 2)
    side = corner * np.pi / 2
    outwards = side + np.maximum(along - straight, 0) / RADIUS
    on_side = straight / 2 + 1j * (np.minimum(along, straight) - straight / 2)
    return np.exp(1j * side) * on_side + RADIUS * np.exp(1j * outwards), outwards


def path(frames: int, laps: float, rooms: int) -> Array:
    """Return the poses (frames, 4, 4) of a camera that goes around, looks ahead and outwards, and sways."""
    straight = 2 * (way_from_middle(rooms) - RADIUS)
    walked = laps * (4 * straight + 2 * np.pi * RADIUS) * np.arange(frames) / frames
    places, outwards = around(walked, straight)
    sway = walked / RADIUS
    heading = outwards + np.pi / 5 + 0.15 * np.sin(5 * sway)  # from outwards towards ahead
    pitch = 0.12 * np.sin(7 * sway + 0.5)
    ahead = np.stack(
        [np.cos(pitch) * np.cos(heading), np.sin(pitch), np.cos(pitch) * np.sin(heading)], axis=-1
    )
    right = np.cross([0.0, 1.0, 0.0], ahead)
    right /= np.linalg.norm(right, axis=-1, keepdims=True)
    poses = np.tile(np.eye(4), (frames, 1, 1))
    poses[:, :3, :3] = np.stack([right, np.cross(ahead, right), ahead], axis=-1)
    poses[:, :3, 3] = np.stack([places.real, 0.08 * np.sin(3 * sway), places.imag], axis=-1)
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
    laps: float,
    rooms: int,
    only: int | None,
    part: int,
    spacing: float,
    max_points: int,
    points_folder: str | None,
) -> None:
    """Grow the model of the flat, and print what it takes."""
    mesh, truth = flat_mesh(rooms), path(frames, laps, rooms)[:only]
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
    worst = f"worst {np.nanmax(error):.1f} mm and {np.nanmax(turn):.3f} degrees"
    print(f"all poses but of lost frames: median {np.nanmedian(error):.1f} mm, {worst}")


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--frames", type=int, default=10_000, help="default 10000")
    parser.add_argument("--laps", type=float, default=8, help="rounds through the flat; default 8")
    parser.add_argument("--rooms", type=int, default=2, help="in a row, and rows of them; default 2")
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
