#!/usr/bin/env python3
"""
Hold how well points are said to be known (``point_sigma``) against the true surface.

Simulated cameras turn about objects and in a furnished room; of the ICL-NUIM living room the true surface is
that of its depth images at the true poses, of which every fourth is used. Prints what the standard deviations
make expected, if errors were normal and of noise alone, and what errors across the surface are, with the
poses that are found and with the true ones: what 68 % and 95 % of the points are within [mm]; which part is
within two standard deviations (expected: 95 %); and how far off poses are (RMSE of positions, [mm]).

    python benchmarks/accuracy_statement.py --only stereo icl
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from cases import DATA, SENSORS, SMALL, object_mesh
from simulated import furnished_room, turn_about_y

import nacre
from nacre.datasets import open_sequence

Array = npt.NDArray[Any]
Distance = Callable[[Array], Array]
"""Of points in the truth's frame (N, 3) from the true surface (N,), all in metres."""

OBJECTS = ("object", "bunny", *SMALL)
VIEWS, STEP = 24, math.radians(6)
AWAY = 0.5
"""[m] The camera from the middle of an object; as far as its sensor sees well."""


class Scene(NamedTuple):
    """A recording whose true surface is known."""

    name: str
    camera: nacre.Camera
    frames: list[tuple[Array, Any]]  #: depth (H, W) [m], true pose (4, 4)
    distance: Distance


def simulated_scenes(kind: str) -> Iterator[Scene]:
    """Yield what a kind of camera sees; "kinect": with independent noise."""
    camera = SENSORS[kind]
    sensor: dict[str, Any] = {"noise": "kinect"} if kind == "kinect" else {"sensor": kind}
    for name in (*OBJECTS, "room"):
        if name == "room":
            mesh = furnished_room()
            poses = [turn_about_y(i * STEP) for i in range(VIEWS)]
        else:
            mesh = object_mesh(name)
            poses = list(nacre.turntable_poses(mesh, VIEWS, STEP, camera=camera, distance=AWAY))
        frames = [(mesh.simulate_depth(camera, pose, seed=i, **sensor), pose) for i, pose in enumerate(poses)]
        yield Scene(f"{kind}, {name}", camera, frames, mesh.distance)


def recorded_scene() -> Scene:
    """Return the rendered living room; its surface has no noise."""
    recording = open_sequence(DATA / "icl-livingroom-loop-fast")
    frames = [(frame.depth, frame.truth) for frame in recording]
    surfaces = []
    for depth, pose in frames[::4]:
        clean = nacre.preprocess_depth(depth, recording.camera)
        normals = nacre.depth_normals(clean, recording.camera)[np.isfinite(clean)]
        kept = np.isfinite(normals).all(axis=1)
        points, normals = nacre.back_project(clean, recording.camera)[kept], normals[kept]
        assert pose is not None
        surfaces.append((points @ pose[:3, :3].T + pose[:3, 3], normals @ pose[:3, :3].T))
    points, normals = (np.concatenate(column) for column in zip(*surfaces, strict=True))
    tree = nacre.KdTree(points)

    def distance(asked: Array) -> Array:
        nearest = tree.query(asked, 1)[1].ravel()
        return np.asarray(np.abs(np.einsum("ij,ij->i", asked - points[nearest], normals[nearest])))

    return Scene("ICL living room", recording.camera, frames, distance)


def measured(scene: Scene, *, poses_are_given: bool) -> tuple[Array, Array, float]:
    """Return the points' standard deviations, their true errors, and the RMSE of positions (ATE), all [m]."""
    model = nacre.Model(scene.camera)
    for i, (depth, pose) in enumerate(scene.frames):
        known = poses_are_given or i == 0
        model.add_frame(depth, guess=pose if known else None, keep_guess=known)
    cloud = model.cloud()
    off = nacre.evaluation.absolute_trajectory_error(
        model.poses, np.array([pose for _, pose in scene.frames])
    )
    return cloud.attributes["sigma"].astype(float), scene.distance(cloud.points), off.rmse


def words(errors: Array) -> str:
    """Return what 68 % and 95 % are within [mm]."""
    return " / ".join(f"{value:.2g}" for value in 1e3 * np.quantile(np.abs(errors), (0.683, 0.95)))


def main() -> None:
    """Print a row for each scene."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--only", nargs="+", choices=(*SENSORS, "icl"), default=(*SENSORS, "icl"))
    kinds = parser.parse_args().only
    print("| scene | expected | true | within 2 sigma | true, poses given | ATE |")
    print("|---|---|---|---|---|---|")
    for kind in kinds:
        for scene in [recorded_scene()] if kind == "icl" else simulated_scenes(kind):
            sigma, errors, off = measured(scene, poses_are_given=False)
            expected = sigma * np.random.default_rng(0).standard_normal(len(sigma))
            within = f"{100 * np.mean(errors <= 2 * sigma):.0f} %"
            _, with_truth, _ = measured(scene, poses_are_given=True)
            figures = (words(expected), words(errors), within, words(with_truth), f"{1e3 * off:.2g}")
            print(f"| {scene.name} | {' | '.join(figures)} |", flush=True)


if __name__ == "__main__":
    main()
