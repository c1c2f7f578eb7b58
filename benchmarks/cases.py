#!/usr/bin/env python
"""
Run recordings in this process, in seconds: what to look at after a change.

Each case is a list of depth images with the true poses, where they are known. The table of `tracking.py`
has more of them, through the command line, beside peers.

    python benchmarks/cases.py bunny12 spot-kinect36 cabinet d435 every=3 most=60 spacing=0.01
"""

from __future__ import annotations

import json
import math
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

import nacre

Array = npt.NDArray[Any]
DATA = Path(__file__).resolve().parents[2] / "shared" / "data"

SMALL = {"homer": ("homer.obj", 0.2), "spot": ("spot.obj", 0.1), "fandisk": ("libigl_fandisk.off", 0.03)}
# Recordings, the step between their frames, and how many.
REAL = {
    "teddy": ("tum-fr3-teddy", 1, 200),
    "rpy": ("tum-fr1-rpy", 1, 100),
    "d435": ("d435-t265-shelf", 1, 300),
    "robot": ("realsense-robot-objects", 1, 48),
    "sr300": ("sr300-shelf", 1, 50),
    "apc": ("apc-shelf-f200", 1, 15),
    "iphone": ("iphone-lidar-office-a", 1, 300),
    "boxcan": ("truedepth-boxcan", 1, 40),
    "cabinet": ("tum-fr3-cabinet-kf", 1, 58),
    "icl": ("icl-livingroom-loop-fast", 1, 300),
    "door": ("record3d-door", 1, 300),
    "deform-pipe": ("deform-pipe", 1, 80),
    "scans": ("stanford-bunny/data", 1, 10),
    "teddy-5": ("tum-fr3-teddy", 5, 40),
    "rpy-5": ("tum-fr1-rpy", 5, 20),
    "d435-5": ("d435-t265-shelf", 5, 60),
    "icl-2": ("icl-livingroom-loop-fast", 2, 150),
}

SENSORS = {
    "kinect": nacre.Camera(320, 240, 262.5, 262.5, 159.5, 119.5),
    "stereo": nacre.Camera(640, 480, 615, 615, 319.5, 239.5),
    "structured_light": nacre.Camera(640, 480, 525, 525, 319.5, 239.5),
    "time_of_flight": nacre.Camera(512, 424, 365, 365, 255.5, 211.5),
    "phone_lidar": nacre.Camera(256, 192, 178, 178, 127.5, 95.5),
}
"""The cameras of simulated sensors; "kinect": with independent noise."""

RIGHT_SHIFT = 0.02
"""Of the median depth: a frame that is farther from the truth is wrong."""
RIGHT_TURN = 3.0
"""[degrees] Likewise."""


@dataclass
class Case:
    """Depth images [m] of one camera, in turn."""

    name: str
    camera: nacre.Camera
    depths: list[Array]
    colors: list[Array | None]
    truths: list[Array | None]  # world_from_camera
    mesh: nacre.Mesh | None = None  # in the frame of the truths


@dataclass(frozen=True)
class Figures:
    """
    What became of a case.

    A frame is right within 2 % of the median depth and 3 degrees of the truth, after the rigid motion that
    makes most frames right.
    """

    frames: int
    claimed: int  # tracked or relocalised
    right: int
    weak: int
    ate: float  # [mm] of the claimed, root mean square
    angle: float  # [degrees] greatest of the claimed
    rms: float  # [mm] of the model's points from the mesh
    points: int
    milliseconds: float  # of a frame, median

    def __str__(self) -> str:
        """One line."""
        return (
            f"{self.claimed:4d} of {self.frames:3d} right {self.right:3d} weak {self.weak:2d}"
            f"  ATE {self.ate:8.2f} mm  {self.angle:7.3f} deg  RMS {self.rms:6.3f} mm"
            f"  {self.points:7d} points  {self.milliseconds:6.1f} ms"
        )


def turntable(name: str, mesh: nacre.Mesh, views: int, *, sensor: str, seed: int) -> Case:
    """Return an object on a turntable, seen by one of SENSORS, or by an orthographic camera."""
    camera = SENSORS[sensor] if sensor else nacre.default_camera(mesh)
    place: dict[str, Any] = {"distance": 0.5} if sensor else {}
    poses = nacre.turntable_poses(mesh, views, 2 * math.pi / views, camera=camera, **place)
    errors: dict[str, Any] = {"noise": "kinect" if sensor else 0.0005, "edge_mixing": 1.0}
    if sensor not in ("", "kinect"):
        errors = {"sensor": sensor}
    depths = [
        mesh.simulate_depth(camera, pose, **errors, seed=1000 * seed + i) for i, pose in enumerate(poses)
    ]
    return Case(name, camera, depths, [None] * views, list(poses), mesh)


def photograph(
    mesh: nacre.Mesh,
    camera: nacre.Camera,
    pose: Array,
    waves: Array,
    phases: Array,
    exposure: float,
    rng: np.random.Generator,
) -> Array:
    """Return a colour image of surfaces that are printed with waves [rad/m], with a camera's noise."""
    v, u = np.mgrid[0 : camera.height, 0 : camera.width]
    rays = np.stack([(u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, np.ones(u.shape)], axis=-1)
    points = (mesh.simulate_depth(camera, pose)[..., None] * rays) @ pose[:3, :3].T + pose[:3, 3]
    shade = sum(np.sin(points @ w + p) for w, p in zip(waves, phases, strict=True))
    value = exposure * (120 + 10 * shade) + rng.normal(0, 3, u.shape)
    gray = np.clip(np.nan_to_num(value), 0, 255).astype(np.uint8)
    return np.repeat(gray[..., None], 3, axis=-1)


def poster(views: int, *, colored: bool, seed: int) -> Case:
    """Return a camera that moves along a printed wall, which leaves three directions to its colours."""
    rng = np.random.default_rng(seed)
    camera = nacre.Camera(320, 240, 262.5, 262.5, 159.5, 119.5)
    corners = np.array([[-4, -3, 0], [4, -3, 0], [4, 3, 0], [-4, 3, 0]], float)
    wall = nacre.Mesh(corners, np.array([[0, 2, 1], [0, 3, 2]]))
    waves = np.zeros((30, 3))
    waves[:, :2] = rng.normal(size=(30, 2)) * rng.uniform(10, 60, (30, 1))  # details of 5 to 30 cm
    phases = rng.uniform(0, 2 * math.pi, 30)
    depths: list[Array] = []
    colors: list[Array | None] = []
    truths: list[Array | None] = []
    for i in range(views):
        pose = np.eye(4)
        a, b = 0.1 * math.sin(i / 9), 0.15 * math.sin(i / 7)
        roll = np.array([[math.cos(a), -math.sin(a), 0], [math.sin(a), math.cos(a), 0], [0, 0, 1]])
        yaw = np.array([[math.cos(b), 0, math.sin(b)], [0, 1, 0], [-math.sin(b), 0, math.cos(b)]])
        pose[:3, :3] = yaw @ roll
        pose[:3, 3] = (0.012 * i, 0.1 * math.sin(i / 11), -1.0 + 0.1 * math.sin(i / 13))
        image = photograph(wall, camera, pose, waves, phases, 1 + 0.1 * math.sin(i / 5), rng)
        depths.append(wall.simulate_depth(camera, pose, noise="kinect", seed=1000 * seed + i))
        colors.append(image if colored else None)
        truths.append(pose)
    return Case("poster", camera, depths, colors, truths, wall)


def object_mesh(name: str) -> nacre.Mesh:
    """Return one of the meshes, at the size of an object."""
    if name == "object":
        return nacre.built_in_object()
    if name == "bunny":
        return nacre.read_mesh(DATA / "stanford-bunny" / "reconstruction" / "bun_zipper.ply")
    file, scale = SMALL[name]
    mesh = nacre.read_mesh(DATA / "meshes" / file)
    return nacre.Mesh(scale * mesh.vertices, mesh.triangles)


def recorded(name: str, *, every: int = 1, most: int | None = None) -> Case:
    """Return a real recording, or every so many of its frames."""
    folder, step, count = REAL[name]
    sequence = nacre.open_sequence(DATA / folder)
    indices = range(0, len(sequence), step)[:count][::every][:most]
    frames = [sequence[i] for i in indices]
    return Case(
        name,
        sequence.camera,
        [frame.depth for frame in frames],
        [frame.color for frame in frames],
        [frame.truth for frame in frames],
    )


def make(name: str, seed: int = 0, *, every: int = 1, most: int | None = None) -> Case:
    """
    Return a case by name.

    One of REAL, or bunny12, spot-kinect36, bunny-stereo24, poster60, poster60-gray and the like.
    """
    if name in REAL:
        return recorded(name, every=every, most=most)
    shape, _, rest = name.partition("-")
    if shape.startswith("poster"):
        return poster(int(shape.removeprefix("poster")), colored=rest != "gray", seed=seed)
    digits = "0123456789"
    sensor = rest.rstrip(digits) if rest.rstrip(digits) in SENSORS else ""
    views = int(name[len(name.rstrip(digits)) :])
    return turntable(name, object_mesh(shape.rstrip(digits)), views, sensor=sensor, seed=seed)


def angle_between(a: Array, b: Array) -> float:
    """Return the angle of the rotation between two [degrees]."""
    return math.degrees(math.acos(min(1.0, max(-1.0, (np.trace(a.T @ b) - 1) / 2))))


def best_fit(poses: Array, truths: Array, shift: float, turn: float) -> tuple[Array, Array, Array]:
    """Return the motion that makes most poses right; with it, their shifts and turns [degrees]."""
    best: tuple[int, float, Array] = (-1, math.inf, np.eye(4))

    def errors(motion: Array) -> tuple[Array, Array]:
        moved = motion @ poses
        shifts = np.linalg.norm(moved[:, :3, 3] - truths[:, :3, 3], axis=1)
        cosines = (np.einsum("nij,nij->n", moved[:, :3, :3], truths[:, :3, :3]) - 1) / 2
        return shifts, np.degrees(np.arccos(np.clip(cosines, -1, 1)))

    def consider(motion: Array) -> Array:
        nonlocal best
        shifts, turns = errors(motion)
        right = (shifts < shift) & (turns < turn)
        rank = (
            int(right.sum()),
            -float(np.mean(np.minimum(shifts / shift, 1) + np.minimum(turns / turn, 1))),
        )
        if rank > (best[0], -best[1]):
            best = (rank[0], -rank[1], motion)
        return right

    for k in range(0, len(poses), max(1, len(poses) // 60)):
        right = consider(truths[k] @ np.linalg.inv(poses[k]))
        for _ in range(3):
            if right.sum() < 3:
                break
            p, q = poses[right], truths[right]
            u, _, vt = np.linalg.svd(np.einsum("nij,nkj->ik", q[:, :3, :3], p[:, :3, :3]))
            motion = np.eye(4)
            motion[:3, :3] = u @ np.diag([1, 1, np.linalg.det(u @ vt)]) @ vt
            motion[:3, 3] = np.mean(q[:, :3, 3] - p[:, :3, 3] @ motion[:3, :3].T, axis=0)
            right = consider(motion)
    return best[2], *errors(best[2])


def run(case: Case, *, num_threads: int = 1, **options: Any) -> tuple[Figures, nacre.Model]:
    """Run a case; options as those of `nacre.Model`."""
    model = nacre.Model(case.camera, num_threads=num_threads, **options)
    for depth, color in zip(case.depths, case.colors, strict=True):
        model.add_frame(depth, color=color)
    return measure(case, model), model


def middle_depth(depths: list[Array]) -> float:
    """Return the median depth of some of the images [m]."""
    return float(np.median([np.nanmedian(image) for image in depths[:: max(1, len(depths) // 20)]]))


def measure(case: Case, model: Any) -> Figures:
    """Return the figures of a case that has been run; the model is nacre's, or has its frames and points."""
    status = [report.status for report in model.frames]
    claimed = [i for i, s in enumerate(status) if s in ("TRACKED", "RELOCALISED")]
    known = [i for i in claimed if case.truths[i] is not None]
    right, ate, angle, rms = 0, math.nan, math.nan, math.nan
    if known:
        poses = np.array([model.frames[i].world_from_camera for i in known])
        truths = np.array([case.truths[i] for i in known])
        largest = RIGHT_SHIFT * middle_depth(case.depths)
        motion, shifts, turns = best_fit(poses, truths, largest, RIGHT_TURN)
        right = int(np.sum((shifts < largest) & (turns < RIGHT_TURN)))
        ate, angle = 1e3 * float(np.sqrt(np.mean(shifts**2))), float(turns.max())
        if case.mesh is not None:
            points = np.asarray(model.points, float) @ motion[:3, :3].T + motion[:3, 3]
            rms = 1e3 * float(np.sqrt(np.mean(case.mesh.distance(points) ** 2)))
    times = float(np.median([report.milliseconds["total"] for report in model.frames]))
    return Figures(
        len(status), len(claimed), right, status.count("WEAK"), ate, angle, rms, len(model.points), times
    )


def count_far_off(case: Case, model: Any) -> int:
    """Return how many of the claimed frames are off by more than a tenth of the depth, or 10 degrees."""
    claimed = [i for i, report in enumerate(model.frames) if report.status in ("TRACKED", "RELOCALISED")]
    known = [i for i in claimed if case.truths[i] is not None]
    if not known:
        return 0
    poses = np.array([model.frames[i].world_from_camera for i in known])
    truths = np.array([case.truths[i] for i in known])
    depth = middle_depth(case.depths)
    _, shifts, turns = best_fit(poses, truths, RIGHT_SHIFT * depth, RIGHT_TURN)
    return int(np.sum((shifts > 0.1 * depth) | (turns > 10.0)))


def main() -> None:
    """Run the cases that are named, with settings: cases.py d435 robot spacing=0.01."""
    settings = dict(word.split("=") for word in sys.argv[1:] if "=" in word)
    names = [word for word in sys.argv[1:] if "=" not in word]
    options = {key: json.loads(value) for key, value in settings.items()}
    taken = {key: options.pop(key) for key in ("every", "most") if key in options}
    seed = options.pop("seed", 0)
    for name in names:
        figures, _ = run(make(name, seed, **taken), **options)
        print(f"{name:16}{figures}", flush=True)


if __name__ == "__main__":
    main()
