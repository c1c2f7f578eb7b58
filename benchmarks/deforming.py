#!/usr/bin/env python3
"""
Measure models of things that bend, and what a rigid loop makes of them, against the exact truth.

    python benchmarks/deforming.py                                  # every scene, sensor and contender
    python benchmarks/deforming.py pipe homer sensor=stereo seeds=3 frames=80
    python benchmarks/deforming.py deform-pipe pictures=FOLDER      # a real pipe that two hands bend

At every frame the model is compared with the true surface, in the camera's frame: all of its points, and
those on what the camera saw; and points are followed, from the first frame that saw them, as pieces of the
material. Beside it the rigid loop on the same frames, both on those of the thing held still, and Open3D's
TSDF, where it is installed.
"""

from __future__ import annotations

import importlib.util
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
from cases import Array, recorded
from deforming_scenes import THINGS, Recording, paint, record
from track import peers

import nacre
from nacre.evaluation import completeness, surface_accuracy
from nacre.rendering import View, render_points

NEAR = 0.005
"""Of the surface a part is covered that a point of the model is as near to [m]."""
GHOST = 0.01
"""A point of the model that stands so far before what its pixel measured is not there [m]."""
SHOWN = (0, 20, 40, 60, 79)
"""Frames of `deform-pipe` that are pictured."""


@dataclass(frozen=True)
class Run:
    """What a loop made of a recording: the model at each frame, in its camera's frame; None where lost."""

    points_at: Callable[[int], Array | None]
    num_points: int
    milliseconds: float  # of a frame, median


@dataclass(frozen=True)
class Figures:
    """How far a run is from the truth: root mean squares over frames and points, in mm."""

    tracked: int
    frames: int
    rms: float  # [mm] of all points
    worst: float  # [mm] that of the worst frame
    seen: float  # [mm] of points on what the camera saw
    middle: float  # [mm] the median of those
    followed: float  # root mean square of how far points are from the material they began on [pixels]
    followed_p95: float
    complete: float  # part of what was seen up to the last tracked frame, then
    run: Run

    def __str__(self) -> str:
        """One line of a table."""
        return (
            f"{self.tracked:3d} of {self.frames} | {self.rms:6.2f} | {self.worst:6.2f} | {self.seen:6.2f} | "
            f"{self.middle:6.2f} | {self.followed:5.2f} | {self.followed_p95:5.2f} | {self.complete:6.1%} | "
            f"{self.run.num_points:6d} | {self.run.milliseconds:6.1f}"
        )


HEAD = (
    "| frames | loop | tracked | RMS [mm] | worst frame | seen | its median | followed [pixels] | 95 % "
    "| complete | points | ms |"
)


def run_nacre(
    camera: nacre.Camera,
    depths: Sequence[Array],
    *,
    deform: bool = False,
    colors: Sequence[npt.NDArray[np.uint8]] | None = None,
) -> tuple[nacre.Model, Run]:
    """Run the loop; the model at a frame is what is there at the end, as it was then where it deforms."""
    model = nacre.Model(camera, num_threads=2, deform=deform)
    for index, depth in enumerate(depths):
        model.add_frame(depth, None if colors is None else colors[index])

    def points_at(index: int) -> Array | None:
        report = model.frames[index]
        if not report.tracked:
            return None
        points = model.points_at(index) if deform else model.points
        return moved(np.linalg.inv(report.world_from_camera), points)

    spent = float(np.median([report.milliseconds["total"] for report in model.frames]))
    return model, Run(points_at, len(model), spent)


def run_peer(name: str, camera: nacre.Camera, depths: Sequence[Array]) -> Run:
    """Run a peer's rigid loop."""
    loop, poses, spent = peers.make(name, camera, depths[0]), [], []
    for depth in depths:
        start = time.perf_counter()
        try:
            poses.append(loop.add(depth))
        except RuntimeError:
            poses.append(None)
        spent.append(1e3 * (time.perf_counter() - start))
    points = loop.points()

    def points_at(index: int) -> Array | None:
        pose = poses[index]
        return None if pose is None else moved(np.linalg.inv(pose), points)

    return Run(points_at, len(points), float(np.median(spent)))


def moved(pose: Array, points: Array) -> Array:
    """Return points under a pose."""
    return np.asarray(points, np.float64) @ pose[:3, :3].T + pose[:3, 3]


def measure(recording: Recording, run: Run) -> Figures:
    """Compare a run with the truth of its recording."""
    squares, seen_squares, apart = [], [], []
    material = Material(recording.triangles, run.num_points)
    covered = np.zeros(len(recording.triangles), bool)
    last = None
    for index in range(len(recording.depths)):
        exact = recording.mesh(index)
        image = exact.simulate_depth(recording.camera, np.eye(4), num_threads=2)
        corners = np.asarray(exact.vertices)[exact.triangles]
        covered |= is_seen(recording.camera, image, corners.mean(axis=1))
        points = run.points_at(index)
        if points is None:
            continue
        last = index, points, exact
        found = exact.closest(points, num_threads=2)
        on_seen = is_seen(recording.camera, image, found.points)
        squares.append(found.distances**2)
        seen_squares.append(found.distances[on_seen] ** 2)
        apart.append(material.follow(points, found, on_seen, corners, recording.camera))
    if last is None:
        nothing = (float("nan"),) * 6
        return Figures(0, len(recording.depths), *nothing, 0.0, run)
    errors = np.concatenate(apart)
    _, points, exact = last
    samples = np.asarray(exact.vertices)[exact.triangles[covered]].mean(axis=1)
    return Figures(
        tracked=len(squares),
        frames=len(recording.depths),
        rms=1e3 * float(np.sqrt(np.concatenate(squares).mean())),
        worst=1e3 * float(np.sqrt(max(square.mean() for square in squares))),
        seen=1e3 * float(np.sqrt(np.concatenate(seen_squares).mean())),
        middle=1e3 * float(np.sqrt(np.median(np.concatenate(seen_squares)))),
        followed=float(np.sqrt((errors**2).mean())) if len(errors) else float("nan"),
        followed_p95=float(np.percentile(errors, 95)) if len(errors) else float("nan"),
        complete=completeness(points, samples, tau=NEAR).fraction[0],
        run=run,
    )


class Material:
    """Where on the surface each point of a model began: a triangle, and weights of its corners."""

    def __init__(self, triangles: npt.NDArray[np.int32], num_points: int) -> None:
        self._triangles = triangles
        self._of = np.full(num_points, -1)
        self._weights = np.zeros((num_points, 3))

    def follow(
        self,
        points: Array,
        found: nacre.ClosestPoints,
        on_seen: npt.NDArray[np.bool_],
        corners: Array,
        camera: nacre.Camera,
    ) -> Array:
        """Return how far points on what is seen are from where they began, in pixels; note new ones."""
        known = np.flatnonzero(on_seen & (self._of >= 0))
        places = np.einsum("nk,nki->ni", self._weights[known], corners[self._of[known]])
        apart = np.linalg.norm(points[known] - places, axis=1) * camera.fx / points[known, 2]
        new = np.flatnonzero(on_seen & (self._of < 0))
        self._of[new] = found.triangles[new]
        self._weights[new] = barycentric(found.points[new], corners[found.triangles[new]])
        return np.asarray(apart)


def barycentric(points: Array, corners: Array) -> Array:
    """Return weights of triangles' corners (N, 3, 3) of points on them."""
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    normals = np.cross(b - a, c - a)
    areas = np.maximum((normals**2).sum(axis=1), 1e-30)
    v = (np.cross(points - a, c - a) * normals).sum(axis=1) / areas
    w = (np.cross(b - a, points - a) * normals).sum(axis=1) / areas
    return np.stack([1 - v - w, v, w], axis=-1)


def is_seen(camera: nacre.Camera, depth: Array, points: Array) -> npt.NDArray[np.bool_]:
    """Return which points of a surface its exact depth image shows, but for three of its pixels."""
    measured = look_up(camera, depth, points)
    return np.asarray(np.abs(measured - points[:, 2]) < 3 * points[:, 2] / camera.fx)


def look_up(camera: nacre.Camera, depth: Array, points: Array) -> Array:
    """Return the depth at the pixel of each point; NaN outside of the image."""
    pixels = np.rint(camera.project(points)).astype(int)
    inside = ((pixels >= 0) & (pixels < (camera.width, camera.height))).all(axis=1) & (points[:, 2] > 0)
    found = np.full(len(points), np.nan)
    found[inside] = depth[pixels[inside, 1], pixels[inside, 0]]
    return found


def contest(name: str, sensor: str, seed: int, num_frames: int) -> None:
    """Print the rows of one recording."""
    bent, rigid = (
        record(name, num_frames, sensor=sensor, seed=seed, is_rigid=is_rigid) for is_rigid in (False, True)
    )
    title = f"{name}, {sensor}, seed {seed}"

    def row(loop: str, recording: Recording, run: Run) -> None:
        print(f"| {title} | {loop} | {measure(recording, run)} |", flush=True)

    row("nacre, deforming", bent, run_nacre(bent.camera, bent.depths, deform=True)[1])
    painted = run_nacre(bent.camera, bent.depths, deform=True, colors=paint(bent))[1]
    row("nacre, deforming, painted", bent, painted)
    row("nacre, deforming, held still", rigid, run_nacre(rigid.camera, rigid.depths, deform=True)[1])
    row("nacre", bent, run_nacre(bent.camera, bent.depths)[1])
    row("nacre, held still", rigid, run_nacre(rigid.camera, rigid.depths)[1])
    if importlib.util.find_spec("open3d") is not None:
        row("Open3D, TSDF", bent, run_peer("open3d_slam", bent.camera, bent.depths))


@dataclass(frozen=True)
class Residual:
    """How a model at a frame agrees with the depth image, in the sensor's standard deviations."""

    to_image: float  # of the model's points that should be seen, along the axis
    to_model: float  # of the image's points, to the model's surface
    unexplained: float  # part of the image's points farther from the model than GHOST
    ghosts: float  # part of the model's points that stand before the image by more than that


def residual(camera: nacre.Camera, depth: Array, noise: nacre.NoiseModel, run: Run, index: int) -> Residual:
    """Compare the model at a frame with its depth image, both ways."""
    points = run.points_at(index)
    if points is None:
        return Residual(*[float("nan")] * 4)
    gap = look_up(camera, depth, points) - points[:, 2]
    near = np.abs(gap) < GHOST
    image = np.asarray(nacre.back_project(depth, camera), np.float64)
    image = image[np.isfinite(image).all(axis=1)]
    spacing = 2 * float(np.median(image[:, 2])) / camera.fx
    normals = nacre.estimate_normals(points.astype(np.float32), viewpoint=(0, 0, 0))
    distances = surface_accuracy(image, points, reference_normals=normals).distances
    explained = distances < max(GHOST, 2 * spacing)
    return Residual(
        robust(gap[near] / noise.sigma(points[near, 2])),
        robust(distances[explained] / noise.sigma(image[explained, 2])),
        float(1 - explained.mean()),
        float((gap > GHOST).sum() / max(np.isfinite(gap).sum(), 1)),
    )


def robust(values: Array) -> float:
    """Return the standard deviation that the median of magnitudes tells (of normal errors)."""
    return 1.4826 * float(np.median(np.abs(values))) if len(values) else float("nan")


def real_pipe(pictures: Path | None) -> None:
    """Print residuals of the real pipe, and draw the model at some frames."""
    case = recorded("deform-pipe")
    print("| tracked | to image [sigma] | to model | unexplained | ghosts | points | ms |")
    model, run = run_nacre(case.camera, case.depths, deform=True)
    found = [residual(case.camera, depth, model.noise, run, index) for index, depth in enumerate(case.depths)]
    means = [
        float(np.nanmean([getattr(one, name) for one in found]))
        for name in ("to_image", "to_model", "unexplained", "ghosts")
    ]
    tracked = sum(report.tracked for report in model.frames)
    figures = f"{means[0]:.2f} | {means[1]:.2f} | {means[2]:.1%} | {means[3]:.1%}"
    print(
        f"| {tracked} of {len(found)} | {figures} | {run.num_points} | {run.milliseconds:.0f} |", flush=True
    )
    if pictures is not None:
        draw(case.camera, case.depths, run, pictures / "deform-pipe.png")


def draw(camera: nacre.Camera, depths: Sequence[Array], run: Run, path: Path) -> None:
    """Draw the image's points (above) and the model as it was then (below), from the same place."""
    from PIL import Image

    images = [np.asarray(nacre.back_project(depth, camera)) for depth in depths]
    every = np.concatenate([points[np.isfinite(points).all(axis=1)][::50] for points in images])
    view = View.fit(every, (0.3, -0.2, -1.0), size=(360, 300))
    columns = []
    for index in SHOWN:
        parts = [images[index][np.isfinite(images[index]).all(axis=1)], run.points_at(index)]
        columns.append([render_points(p if p is not None else np.zeros((0, 3)), view=view) for p in parts])
    path.parent.mkdir(parents=True, exist_ok=True)
    Image.fromarray(np.hstack([np.vstack(column) for column in columns])).save(path)
    print(path)


def main() -> None:
    """Measure what is named, with settings: sensor=stereo seeds=3 frames=80 pictures=FOLDER."""
    settings = dict(word.split("=") for word in sys.argv[1:] if "=" in word)
    names = [word for word in sys.argv[1:] if "=" not in word] or [*THINGS, "deform-pipe"]
    unknown = set(names) - {*THINGS, "deform-pipe"}
    if unknown:
        known = ", ".join([*THINGS, "deform-pipe"])
        raise SystemExit(f"no scene {', '.join(sorted(unknown))}; there are {known}")
    sensors = (
        settings["sensor"].split(",") if "sensor" in settings else ["kinect", "structured_light", "stereo"]
    )
    if set(names) & set(THINGS):
        print(HEAD)
        print("|---" * (HEAD.count("|") - 1) + "|")
    for name in names:
        if name == "deform-pipe":
            real_pipe(Path(settings["pictures"]) if "pictures" in settings else None)
            continue
        for sensor in sensors:
            for seed in range(int(settings.get("seeds", 2))):
                contest(name, sensor, seed, int(settings.get("frames", 80)))


if __name__ == "__main__":
    main()
