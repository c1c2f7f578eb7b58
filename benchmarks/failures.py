#!/usr/bin/env python3
"""
Measure what frames that cannot be right do to a model, and how it goes on.

The scenes are simulated, 160 x 120 pixels.

unrelated: a model of one scene gets a frame of another; what is taken for tracked is a false success.
related: a model of one view of a scene gets another, from 25 to 60 degrees further; is it tracked, and
rightly?
recovery: 30 frames of a moving camera are lost (covered), then it comes back within 10 cm and 10 degrees of
where it was; is the first frame tracked, and rightly?
kidnap: the camera jumps to a side of the object that the model does not have; lost, or right, within 3
frames?
garbage: one frame in a hundred is garbage; what does it do to poses and points, beside the same run
without?
"""

from __future__ import annotations

import argparse
import math
import sys
import time
from collections import Counter
from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

import nacre

Array = npt.NDArray[Any]

CAMERA = nacre.Camera(160, 120, 190, 190, 79.5, 59.5)
SIGMA = 0.0005  # of the depth [m]


def blob(rng: np.random.Generator) -> nacre.Mesh:
    """Return a closed surface with random bumps."""
    theta, phi = np.meshgrid(
        np.linspace(0, np.pi, 41), np.linspace(0, 2 * np.pi, 80, endpoint=False), indexing="ij"
    )
    ways = np.stack([np.sin(theta) * np.cos(phi), np.cos(theta), np.sin(theta) * np.sin(phi)], axis=-1)
    radius = np.ones(theta.shape)
    for size in rng.uniform(0.05, 0.25, 12):
        radius += size * np.exp(-np.sum((ways - _unit(rng)) ** 2, axis=-1) / rng.uniform(0.05, 0.5))
    vertices = (0.06 * rng.uniform(0.6, 1.4, 3) * radius[..., None] * ways).reshape(-1, 3)
    return nacre.Mesh(vertices, _grid_triangles(41, 80, closed=True))


def boxes(rng: np.random.Generator) -> nacre.Mesh:
    """Return a heap of boxes."""
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = np.array([t for a, b, c, d in sides for t in ((a, b, c), (a, c, d))])
    count = int(rng.integers(3, 9))
    vertices = [
        corners * rng.uniform(0.01, 0.05, 3) @ random_rotation(rng) + rng.uniform(-0.06, 0.06, 3)
        for _ in range(count)
    ]
    return nacre.Mesh(np.concatenate(vertices), np.concatenate([faces + 8 * i for i in range(count)]))


def relief(rng: np.random.Generator) -> nacre.Mesh:
    """Return a surface that fills the image."""
    x, y = np.meshgrid(np.linspace(-0.3, 0.3, 90), np.linspace(-0.25, 0.25, 80), indexing="ij")
    z = np.zeros(x.shape)
    for _ in range(6):
        kx, ky = rng.normal(0, 40, 2)
        z += rng.uniform(0.002, 0.02) * np.sin(kx * x + ky * y + rng.uniform(0, 6))
    return nacre.Mesh(np.stack([x, y, z], axis=-1).reshape(-1, 3), _grid_triangles(90, 80, closed=False))


def _unit(rng: np.random.Generator) -> Array:
    way = rng.normal(size=3)
    return way / np.linalg.norm(way)


def random_rotation(rng: np.random.Generator) -> Array:
    """Return a random rotation."""
    q, r = np.linalg.qr(rng.normal(size=(3, 3)))
    q *= np.sign(np.diag(r))
    return q if np.linalg.det(q) > 0 else -q


def _grid_triangles(rows: int, columns: int, *, closed: bool) -> Array:
    i, j = np.meshgrid(np.arange(rows - 1), np.arange(columns if closed else columns - 1), indexing="ij")
    a, b = i * columns + j, i * columns + (j + 1) % columns
    c, d = a + columns, b + columns
    return np.concatenate([np.stack([a, b, c], -1).reshape(-1, 3), np.stack([b, d, c], -1).reshape(-1, 3)])


def turned(axis: Array, angle: float) -> Array:
    """Return the rotation by an angle about an axis."""
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    rotation: Array = np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross
    return rotation


def look(mesh: nacre.Mesh, angle: float, *, distance: float = 0.3, elevation: float = 0.3) -> Array:
    """Return the pose of a camera that looks at an object from a direction."""
    poses = nacre.turntable_poses(mesh, 2, angle, camera=CAMERA, distance=distance, elevation=elevation)
    pose: Array = poses[1]
    return pose


def view(mesh: nacre.Mesh, pose: Array, seed: int) -> Array:
    """Return a noisy depth image."""
    return mesh.simulate_depth(CAMERA, pose, noise=SIGMA, edge_mixing=1.0, seed=seed, num_threads=1)


def error(report: nacre.FrameReport, first: Array, pose: Array) -> tuple[float, float]:
    """Return how far a pose is off [m, degrees]; the first frame's is the world."""
    off = np.linalg.inv(np.linalg.inv(first) @ pose) @ report.world_from_camera
    turn = math.degrees(math.acos(min(1.0, max(-1.0, (np.trace(off[:3, :3]) - 1) / 2))))
    return float(np.linalg.norm(off[:3, 3])), turn


def different_scenes(count: int, rng: np.random.Generator) -> list[Array]:
    """Return a view of each of so many scenes: in turn round shapes, boxes and reliefs."""
    makers = (blob, boxes, relief)
    views = []
    for i in range(count):
        mesh = makers[i % 3](rng)
        if makers[i % 3] is relief:
            pose = np.eye(4)
            pose[:3, 3] = (*rng.uniform(-0.05, 0.05, 2), -rng.uniform(0.3, 0.45))
        else:
            pose = look(
                mesh, rng.uniform(0, 6), distance=rng.uniform(0.25, 0.4), elevation=rng.uniform(-0.5, 1.0)
            )
        views.append(view(mesh, pose, i))
    return views


def unrelated(count: int, seed: int) -> dict[str, Any]:
    """Count what is taken for tracked of pairs of views of different scenes."""
    rng = np.random.default_rng(seed)
    views = different_scenes(max(6, min(150, count // 10)), rng)
    told: Counter[str] = Counter()
    for _ in range(count):
        a, b = rng.choice(len(views), 2, replace=False)
        model = nacre.Model(CAMERA, num_threads=1)
        model.add_frame(views[a])
        told[model.add_frame(views[b]).status] += 1
    return {"pairs": count, **told, "false_success": (told["TRACKED"] + told["RELOCALISED"]) / count}


def related(count: int, seed: int) -> dict[str, Any]:
    """Give a model of one view another view of the same object."""
    rng = np.random.default_rng(seed)
    told: Counter[str] = Counter()
    for trial in range(count):
        mesh = (blob, boxes)[trial % 2](rng)
        angle, distance, elevation = rng.uniform(0, 6), rng.uniform(0.25, 0.4), rng.uniform(-0.3, 0.8)
        further = rng.choice([-1, 1]) * math.radians(rng.uniform(25, 60))
        poses = [
            look(mesh, angle, distance=distance, elevation=elevation),
            look(
                mesh,
                angle + further,
                distance=distance * rng.uniform(0.9, 1.1),
                elevation=elevation + rng.uniform(-0.1, 0.1),
            ),
        ]
        model = nacre.Model(CAMERA, num_threads=1)
        model.add_frame(view(mesh, poses[0], 2 * trial))
        report = model.add_frame(view(mesh, poses[1], 2 * trial + 1))
        metres, degrees = error(report, *poses)
        is_right = metres < 0.005 and degrees < 1.5
        is_folded_in = report.status in {"TRACKED", "RELOCALISED"}
        told[report.status if not is_folded_in else "right" if is_right else "wrong"] += 1
    return {"pairs": count, **told}


def starts(count: int, seed: int) -> dict[str, Any]:
    """Give a model three views far apart of one object, or one of another scene before two of it."""
    rng = np.random.default_rng(seed)
    told: Counter[str] = Counter()
    for trial in range(count):
        others = [(blob, boxes)[trial % 2](rng) for _ in range(2)]
        meshes = [others[0 if trial % 4 < 2 else 1], others[0], others[0]]
        angle, distance, elevation = rng.uniform(0, 6), rng.uniform(0.25, 0.4), rng.uniform(-0.3, 0.8)
        further = rng.choice([-1, 1]) * math.radians(rng.uniform(25, 60))
        steps = (0.0, further, 2.0 * further if trial % 4 < 2 else further + math.radians(3))
        poses = [
            look(mesh, angle + step, distance=distance, elevation=elevation)
            for mesh, step in zip(meshes, steps, strict=True)
        ]
        model = nacre.Model(CAMERA, num_threads=1)
        for i, (mesh, pose) in enumerate(zip(meshes, poses, strict=True)):
            model.add_frame(view(mesh, pose, 3 * trial + i))
        claimed = [i for i, frame in enumerate(model.frames) if frame.status in {"TRACKED", "RELOCALISED"}]
        for i in claimed[1:]:
            metres, degrees = error(model.frames[i], poses[claimed[0]], poses[i])
            is_right = metres < 0.005 and degrees < 1.5 and meshes[claimed[0]] is meshes[i]
            told["right" if is_right else "wrong"] += 1
        kind = "one object" if trial % 4 < 2 else "another before"
        told[f"{kind}, {len(claimed)} claimed"] += 1
    return {"triples": count, **told}


def recovery(count: int, seed: int) -> dict[str, Any]:
    """Cover the camera for 30 frames, and let it come back nearby."""
    mesh = nacre.built_in_object()
    told: Counter[str] = Counter()
    for trial in range(count):
        rng = np.random.default_rng([seed, trial])
        start, step = rng.uniform(0, 2 * math.pi), math.radians(3)
        poses = [look(mesh, start + i * step, elevation=0.3) for i in range(8)]
        model = nacre.Model(CAMERA, num_threads=1)
        for i, pose in enumerate(poses):
            model.add_frame(view(mesh, pose, 100 * trial + i))
        for _ in range(30):
            model.add_frame(np.zeros((CAMERA.height, CAMERA.width), np.float32))
        back = poses[-1].copy()
        # About the object, so that it stays in view; both within 10 degrees and 10 cm of the last known pose.
        center = mesh.bounds.mean(axis=0)
        turn = turned(_unit(rng), math.radians(rng.uniform(0, 10)))
        back[:3, :3] = turn @ back[:3, :3]
        back[:3, 3] = center + turn @ (back[:3, 3] - center)
        toward = (center - back[:3, 3]) / np.linalg.norm(center - back[:3, 3])
        back[:3, 3] += toward * rng.uniform(-0.06, 0.06)
        report = model.add_frame(view(mesh, back, 100 * trial + 99))
        metres, degrees = error(report, poses[0], back)
        is_right = metres < 0.005 and degrees < 1.5
        told["lost" if not report.tracked else "right" if is_right else "wrong"] += 1
    return {"trials": count, **told, "recovered": told["right"] / count}


def kidnap(count: int, seed: int) -> dict[str, Any]:
    """Let the camera jump to a side of the object that the model does not have."""
    mesh = nacre.built_in_object()
    told: Counter[str] = Counter()
    for trial in range(count):
        rng = np.random.default_rng([seed, trial])
        start = rng.uniform(0, 2 * math.pi)
        poses = [look(mesh, start + math.radians(3 * i)) for i in range(6)]
        model = nacre.Model(CAMERA, num_threads=1)
        for i, pose in enumerate(poses):
            model.add_frame(view(mesh, pose, 100 * trial + i))
        jump = start + math.radians(rng.uniform(120, 240))
        outcome = "wrong"
        for i in range(3):
            pose = look(mesh, jump + math.radians(3 * i), elevation=rng.uniform(0.2, 0.5))
            report = model.add_frame(view(mesh, pose, 100 * trial + 50 + i))
            metres, degrees = error(report, poses[0], pose)
            outcome = "lost" if not report.tracked else "right" if metres < 0.005 and degrees < 2 else "wrong"
            if outcome == "wrong" and report.status != "WEAK":
                told["fused wrongly"] += 1
        told[outcome] += 1
    return {"trials": count, **told}


def rubbish(rng: np.random.Generator) -> Array:
    """Return a frame that shows nothing of the scene."""
    shape = (CAMERA.height, CAMERA.width)
    v, u = np.indices(shape)
    kinds: list[Callable[[], Array]] = [
        lambda: rng.uniform(0.1, 1.0, shape),
        lambda: np.kron(rng.uniform(0.2, 0.4, (12, 16)), np.ones((10, 10))),
        lambda: rng.uniform(0.2, 0.5) + rng.normal(0, 3e-4) * u + rng.normal(0, 3e-4) * v,
        lambda: view(boxes(rng), look(mesh_of_all(), 0.0), int(rng.integers(1000))),
        lambda: np.full(shape, 0.06) + rng.normal(0, 0.002, shape),
    ]
    return kinds[rng.integers(len(kinds))]().astype(np.float32)


def mesh_of_all() -> nacre.Mesh:
    """Return a mesh as large as the scenes are."""
    return nacre.Mesh(np.array([[-0.08] * 3, [0.08] * 3, [0.08, -0.08, 0.0]]), np.array([[0, 1, 2]]))


def garbage(count: int, seed: int, every: int = 100) -> dict[str, Any]:
    """Put garbage in the place of one frame in a hundred, and hold the run against the same without."""
    mesh = nacre.built_in_object()
    rng = np.random.default_rng(seed)
    poses = [look(mesh, math.radians(1.5 * i)) for i in range(count)]
    frames = [view(mesh, pose, i) for i, pose in enumerate(poses)]
    clean, dirty = nacre.Model(CAMERA, num_threads=1), nacre.Model(CAMERA, num_threads=1)
    statuses: Counter[str] = Counter()
    for i, frame in enumerate(frames):
        clean.add_frame(frame)
        if i % every == every // 2:
            statuses[dirty.add_frame(rubbish(rng)).status] += 1
        else:
            dirty.add_frame(frame)
    known = np.array([r.tracked for r in dirty.frames]) & np.array([r.tracked for r in clean.frames])
    shifts = np.linalg.norm(dirty.poses[known, :3, 3] - clean.poses[known, :3, 3], axis=1)
    outliers = [
        float(np.mean(mesh.distance(m.points @ poses[0][:3, :3].T + poses[0][:3, 3]) > 0.003))
        for m in (clean, dirty)
    ]
    return {
        "frames": count,
        "garbage": dict(statuses),
        "tracked": int(known.sum()),
        "largest_shift_mm": 1e3 * float(shifts.max()),
        "sigma_mm": 1e3 * SIGMA,
        "outliers_without": outliers[0],
        "outliers_with": outliers[1],
    }


EXPERIMENTS = {
    "unrelated": unrelated,
    "related": related,
    "starts": starts,
    "recovery": recovery,
    "kidnap": kidnap,
    "garbage": garbage,
}
COUNTS = {
    "unrelated": 10000,
    "related": 1000,
    "starts": 1000,
    "recovery": 200,
    "kidnap": 200,
    "garbage": 1000,
}


def main() -> int:
    """Run the experiments, and print a line for each."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("names", nargs="*", choices=[[], *EXPERIMENTS], help="these only")
    parser.add_argument("--count", type=int, help="pairs, trials or frames")
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    for name in options.names or EXPERIMENTS:
        start = time.process_time()
        result = EXPERIMENTS[name](options.count or COUNTS[name], options.seed)
        print(f"{name}: {result}, {time.process_time() - start:.0f} s of CPU time", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
