#!/usr/bin/env python
"""
Readings of Blackburn, Kubacki and Stratton 2010: which of them complete the turn, noiseless and noisy.

What the paper prints stands in capitals; what it leaves open are the fields of Reading. Each run is a turn
of twelve views; it succeeds where no pose is more than 5 degrees off and the model has the object's shape.
Noisy is 0.5 mm and mixed edges. Seed i draws the noise, the 5 % of the points and the samples of the model.

    python benchmarks/paper.py --preset --seeds 100 bun_zipper.ply object
    python benchmarks/paper.py --seeds 20 bun_zipper.ply homer.obj:0.4 theta=printed/theta=huang motion=0

The first runs nacre's preset "paper". The second runs readings, written here on one page: every combination
of the alternatives, the other fields as in the preset. A number behind a mesh's name scales it.
"""

from __future__ import annotations

import argparse
import dataclasses
import functools
import itertools
import math
import multiprocessing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import nacre

VIEWS, STEP = 12, math.radians(30)
NOISE = 0.0005  # [m]
FRACTION, GATE, ITERATIONS = 0.05, 0.005, 15  # part of the points; pairs are closer [m]
RADIUS, MU, PROJECTIONS = 0.008, 0.4, 10  # WLOP's h [m]
FIRST, KEPT, NEW, CAP = 0.5, 0.9, 0.2, 2000  # samples: parts of the first view and the model; at most


@dataclass(frozen=True)
class Reading:
    """What the paper leaves open."""

    theta: str = "printed"  # exp(-4 r^2 / h), or Huang's exp(-16 r^2 / h^2)
    motion: int = 1  # whether a view starts where the last motion goes on, or at the last pose
    across: int = 1  # whether the 5 mm are along the normal, or between the points
    angle: float = 0.6  # [rad] normals that differ more do not match
    k: int = 10  # neighbours of a normal
    epsilon: float = 0.010  # [m] within which they are
    rims: int = 1  # whether points with fewer have no normal, and match nothing
    best: str = "rmse"  # least RMSE of the pairs; mean of all, capped at the gate; most pairs; last
    fresh: int = 1  # whether each iteration draws its own 5 %
    cap_last: int = 0  # whether WLOP comes before the subsampling to 2000
    pixel: float = 0.001  # [m]
    edge: float = 0.005  # [m] depth step across a pixel that is a strong edge
    blur: int = 0  # passes of a 3 x 3 mean


@dataclass(frozen=True)
class Turn:
    """What became of one turn."""

    angle: float  # [degrees] of the worst pose
    rms: float  # [m] of the model's distances from the mesh
    completeness: float  # part of what was seen that has a model point within RADIUS

    @property
    def succeeds(self) -> bool:
        """Whether the poses are right and the shape is the object's."""
        return self.angle <= 5 and self.rms <= RADIUS / 4 and self.completeness >= 0.85


@functools.cache
def mesh_of(name: str) -> nacre.Mesh:
    """Return the mesh of 'file', 'file:scale' or 'object'."""
    path, _, scale = name.partition(":")
    mesh = nacre.built_in_object() if path == "object" else nacre.read_mesh(path)
    return nacre.Mesh(mesh.vertices * float(scale or 1), mesh.triangles)


@functools.cache
def scene(name: str, pixel: float) -> tuple[nacre.Camera, Any]:
    """Return the camera and its poses."""
    camera = nacre.default_camera(mesh_of(name))
    size = round(camera.width * camera.pixel_size / pixel)
    return nacre.Camera.orthographic(size, size, pixel), nacre.turntable_poses(mesh_of(name), VIEWS, STEP)


@functools.lru_cache(maxsize=64)
def clean_view(name: str, pixel: float, index: int) -> Any:
    """Return a noiseless depth image."""
    camera, poses = scene(name, pixel)
    return mesh_of(name).simulate_depth(camera, poses[index])


def view(name: str, pixel: float, index: int, sigma: float, seed: int) -> Any:
    """Return a depth image."""
    if sigma == 0:
        return clean_view(name, pixel, index)
    camera, poses = scene(name, pixel)
    return mesh_of(name).simulate_depth(
        camera, poses[index], noise=sigma, edge_mixing=1.0, seed=1000 * seed + index
    )


def judged(name: str, pixel: float, poses: Any, points: Any) -> Turn:
    """Return how good the poses and the model's points are."""
    camera, true = scene(name, pixel)
    relative = np.linalg.inv(true[0]) @ true
    off = (np.linalg.inv(relative) @ poses)[:, :3, :3]
    angles = np.degrees(np.arccos(np.clip((np.trace(off, axis1=1, axis2=2) - 1) / 2, -1, 1)))
    distances = mesh_of(name).distance(moved(points, true[0]))
    tree = nacre.KdTree(points)
    nearest = [
        tree.query(moved(nacre.back_project(clean_view(name, pixel, i), camera), relative[i]), k=1)[0]
        for i in range(0, VIEWS, 3)
    ]
    return Turn(
        float(np.nan_to_num(angles, nan=180.0).max()),
        float(np.sqrt(np.mean(distances**2))),
        float(np.mean(np.concatenate(nearest) < RADIUS)),
    )


def moved(points: Any, pose: Any) -> Any:
    """Return points after a motion."""
    return points @ pose[:3, :3].T + pose[:3, 3]


def blurred(depth: Any, passes: int) -> Any:
    """Return means over 3 x 3 known pixels."""
    for _ in range(passes):
        known = np.isfinite(depth)
        padded, ones = np.pad(np.where(known, depth, 0), 1), np.pad(known.astype(float), 1)
        cells = [np.s_[i : i + depth.shape[0], j : j + depth.shape[1]] for i in range(3) for j in range(3)]
        mean = sum(padded[c] for c in cells) / np.maximum(sum(ones[c] for c in cells), 1)
        depth = np.where(known, mean, np.nan)
    return depth


def points_of(depth: Any, camera: nacre.Camera, reading: Reading) -> tuple[Any, Any]:
    """Return the points of a depth image without its edges, and their normals."""
    clean = nacre.preprocess_depth(depth, camera, edge_test="gradient", gradient_threshold=reading.edge)
    clean = blurred(clean, reading.blur)
    normals = nacre.depth_normals(clean, camera)[np.isfinite(clean)]
    points = nacre.back_project(clean, camera)
    known = np.isfinite(normals).all(axis=1)
    return points[known].astype(float), normals[known].astype(float)


def exponential(twist: Any) -> Any:
    """Return the motion (4, 4) of a rotation vector and a translation, Rodrigues' formula."""
    angle = np.linalg.norm(twist[:3])
    pose = np.eye(4)
    if angle > 0:
        x, y, z = twist[:3] / angle
        cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        pose[:3, :3] += math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross
    pose[:3, 3] = twist[3:]
    return pose


def matches(
    drawn: tuple[Any, Any], model: tuple[Any, Any], tree: nacre.KdTree, pose: Any, reading: Reading
) -> Any:
    """Return the pairs: points of the view, of the model, and the model's normals."""
    points, normals = moved(drawn[0], pose), drawn[1] @ pose[:3, :3].T
    distance, index = tree.query(points, k=1)
    q, n = model[0][index], model[1][index]
    if reading.across:
        distance = np.abs(np.sum((points - q) * n, axis=1))
    good = (distance < GATE) & (np.sum(normals * n, axis=1) >= math.cos(reading.angle) - 1e-9)
    return points[good], q[good], n[good]


def register(view: tuple[Any, Any], model: tuple[Any, Any], start: Any, reading: Reading, random: Any) -> Any:
    """Return the best of fifteen iterations of point to plane."""
    tree = nacre.KdTree(model[0])
    pose, best, best_cost = start, start, math.inf
    count = max(6, round(FRACTION * len(view[0])))
    for iteration in range(ITERATIONS + 1):
        if iteration == 0 or reading.fresh:
            chosen = random.choice(len(view[0]), count, replace=False)
        p, q, n = matches((view[0][chosen], view[1][chosen]), model, tree, pose, reading)
        if len(p) < 6:
            break
        r = np.sum((p - q) * n, axis=1)
        cost = {
            "rmse": np.sqrt(np.mean(r**2)),
            "mean": np.sum(r**2) + GATE**2 * (count - len(p)),
            "pairs": -len(p),
            "last": -iteration,
        }[reading.best]
        if cost < best_cost:
            best, best_cost = pose, cost
        pose = step(p, r, n) @ pose
    return best


def step(points: Any, residuals: Any, normals: Any) -> Any:
    """Return the motion of least squares, linear in the angles."""
    center = points.mean(axis=0)
    extent = np.sqrt(np.mean(np.sum((points - center) ** 2, axis=1)))
    rows = np.hstack([np.cross((points - center) / extent, normals), normals])
    twist = np.linalg.lstsq(rows, -residuals, rcond=1e-3)[0]
    to, back = np.eye(4), np.eye(4)
    to[:3, 3], back[:3, 3] = center, -center
    return to @ exponential(np.concatenate([twist[:3] / extent, twist[3:]])) @ back


def some(points: Any, count: float, random: Any) -> Any:
    """Return so many of the points, or all."""
    return points[np.sort(random.permutation(len(points))[: round(count)])]


def consolidated(model: Any, points: Any, reading: Reading, random: Any) -> Any:
    """Return the samples after WLOP of the model and a view's points."""
    if len(model) == 0:
        samples = some(points, FIRST * len(points), random)
    else:
        kept, new = some(model, KEPT * len(model), random), some(points, NEW * len(model), random)
        samples = np.concatenate([kept, new])
    if not reading.cap_last:
        samples = some(samples, CAP, random)
    projected = nacre.project_samples(
        samples,
        np.concatenate([model, points]),
        radius=RADIUS,
        mu=MU,
        iterations=PROJECTIONS,
        theta=reading.theta,
        method="wlop",
    )
    return some(projected, CAP, random)


def model_normals(model: Any, known: tuple[Any, Any], reading: Reading) -> tuple[Any, Any]:
    """Return the normals, NaN where there is none; and these with that of the nearest point in its place."""
    normals = nacre.estimate_normals(model, k=reading.k, max_radius=reading.epsilon)
    if reading.rims:
        distance, _ = nacre.KdTree(model).query(model, k=reading.k)
        normals[~(distance[:, -1] <= reading.epsilon)] = np.nan
    reference = known[1][nacre.KdTree(known[0]).query(model, k=1)[1]]
    normals[np.sum(normals * reference, axis=1) < 0] *= -1
    return normals, np.where(np.isfinite(normals), normals, reference)


def turn(name: str, reading: Reading, sigma: float, seed: int) -> Turn:
    """Run a reading."""
    camera, _ = scene(name, reading.pixel)
    random = np.random.default_rng(seed)
    model = found = outwards = np.zeros((0, 3))
    poses = [np.eye(4)]
    for index in range(VIEWS):
        seen, normals = points_of(view(name, reading.pixel, index, sigma, seed), camera, reading)
        if index:
            goes_on = reading.motion and index > 1
            start = poses[-1] @ np.linalg.inv(poses[-2]) @ poses[-1] if goes_on else poses[-1]
            poses.append(register((seen, normals), (model, found), start, reading, random))
        world, world_normals = moved(seen, poses[-1]), normals @ poses[-1][:3, :3].T
        known = np.concatenate([model, world]), np.concatenate([outwards, world_normals])
        model = consolidated(model, world, reading, random)
        found, outwards = model_normals(model, known, reading)
    return judged(name, reading.pixel, np.array(poses), model)


def preset_turn(name: str, reading: Reading, sigma: float, seed: int) -> Turn:
    """Run nacre's preset."""
    camera, _ = scene(name, reading.pixel)
    preset = nacre.ModelParameters.preset("paper")
    parameters = dataclasses.replace(
        preset,
        registration=dataclasses.replace(preset.registration, seed=seed),
        wlop=dataclasses.replace(preset.wlop, seed=seed),
    )
    model = nacre.Model(camera, parameters=parameters)
    for index in range(VIEWS):
        model.add_frame(view(name, reading.pixel, index, sigma, seed))
    return judged(name, reading.pixel, model.poses, model.points.astype(float))


def parse(text: str) -> Reading:
    """Return a reading from 'name=value name=value'."""
    types: dict[str, Any] = {field.name: type(field.default) for field in dataclasses.fields(Reading)}
    pairs = [part.split("=") for part in text.split()]
    return Reading(**{name: types[name](value) for name, value in pairs})


def summary(turns: list[Turn]) -> str:
    """Return what the columns of a row say."""
    angles = np.array([turn.angle for turn in turns])
    rms = np.median([turn.rms for turn in turns])
    completeness = np.median([turn.completeness for turn in turns])
    count = f"{sum(turn.succeeds for turn in turns)} of {len(turns)}"
    words = f"{count:>10} {np.median(angles):6.1f} {np.quantile(angles, 0.95):6.1f}"
    return f"{words} {1e3 * rms:5.2f} {completeness:5.2f}"


def row(task: tuple[str, str, int, bool]) -> str:
    """Return a row of the table: a mesh, a reading, seeds, whether to run the preset."""
    name, text, seeds, preset = task
    run = preset_turn if preset else turn
    columns = [
        summary([run(name, parse(text), sigma, seed) for seed in range(seeds)]) for sigma in (0.0, NOISE)
    ]
    return f"{Path(name).name:24s} {'preset' if preset else text or '-':40s} | " + " | ".join(columns)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("arguments", nargs="+", metavar="MESH[:SCALE] or FIELD=VALUE[/FIELD=VALUE]")
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--preset", action="store_true", help="run nacre's preset instead")
    given = parser.parse_args()
    names = [text for text in given.arguments if "=" not in text]
    alternatives = [text.split("/") for text in given.arguments if "=" in text]
    texts = [" ".join(choice) for choice in itertools.product(*alternatives)]
    print("turns that succeed, median and 95 % of the worst poses [degrees], RMS [mm], completeness | noisy")
    tasks = [(name, text, given.seeds, given.preset) for name in names for text in texts]
    with multiprocessing.Pool() as pool:
        for line in pool.imap(row, tasks):
            print(line, flush=True)


if __name__ == "__main__":
    main()
