#!/usr/bin/env python3
"""
Measure how well mixed pixels are found at the edges of depth images, beside simple ways of removing them.

A board before a wall, or a board alone, is seen by a simulated camera whose pixels mix at edges. A pixel is
mixed where its depth is off by more than a tenth of the step (and twice the noise) from both surfaces that
its neighbourhood shows. Prints, for each scene, the part of the mixed pixels that is removed and the part of
the true ones. Needs nacre; OpenCV, where it is installed, takes part with its bilateral filter's neighbour, a
median filter.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

import nacre

Array = npt.NDArray[Any]
Way = Callable[[Array, Any, float], Array]
"""Depth, camera and noise [m] to the pixels that stay."""


@dataclass(frozen=True)
class Scene:
    """A board of a slant before a wall that is so much farther [m]; None: before nothing."""

    camera: str
    slant: int
    step: float | None
    sigma: float
    mixing: float

    def images(self, seeds: int = 3) -> Iterator[tuple[Any, Array, Array, Array]]:
        """Return the camera, a noisy image, which pixels are mixed, and which are true."""
        camera = CAMERAS[self.camera]
        distance = 0.6
        mesh, pose = scene_mesh(self.slant, self.step, distance), np.diag([1.0, -1.0, -1.0, 1.0])
        pose[2, 3] = distance
        options: dict[str, Any] = {"background_depth": distance + 0.3}
        exact = mesh.simulate_depth(camera, pose)
        mixed = mesh.simulate_depth(camera, pose, edge_mixing=self.mixing, **options)
        step = self.step or 0.3
        off = distance_to_surfaces(mixed, exact, step, self.mixing)
        is_mixed = np.isfinite(mixed) & (off > max(0.1 * step, 2 * self.sigma))
        is_true = np.isfinite(mixed) & (np.abs(mixed - exact) < 1e-6)
        for seed in range(seeds):
            yield (
                camera,
                mesh.simulate_depth(
                    camera, pose, noise=self.sigma, edge_mixing=self.mixing, seed=seed, **options
                ),
                is_mixed,
                is_true,
            )


CAMERAS = {
    "pinhole": nacre.Camera(240, 200, 300.0, 300.0, 119.5, 99.5),
    "orthographic": nacre.Camera.orthographic(width=240, height=200, pixel_size=0.002),
}


def scene_mesh(slant: int, step: float | None, distance: float) -> nacre.Mesh:
    """Return a board turned about y (and a little about x, so that edges cross the pixels), and the wall."""
    angle, tilt = math.radians(slant), math.radians(7)
    half = 0.1
    board = np.array([[-half, -half, 0], [half, -half, 0], [half, half, 0], [-half, half, 0]])
    roll = np.array([[math.cos(tilt), -math.sin(tilt), 0], [math.sin(tilt), math.cos(tilt), 0], [0, 0, 1]])
    turn = np.array(
        [[math.cos(angle), 0, math.sin(angle)], [0, 1, 0], [-math.sin(angle), 0, math.cos(angle)]]
    )
    vertices = board @ roll.T @ turn.T
    triangles = np.array([[0, 1, 2], [0, 2, 3]])
    if step is None:
        return nacre.Mesh(vertices, triangles)
    wall = 10 * board @ turn.T - [0, 0, step]  # parallel, so that the step is the same everywhere
    return nacre.Mesh(np.concatenate([vertices, wall]), np.concatenate([triangles, triangles + 4]))


def distance_to_surfaces(mixed: Array, exact: Array, step: float, mixing: float) -> Array:
    """Return how far a mixed pixel is from its own surface and from the other one, whichever is nearer."""
    own = np.abs(mixed - np.where(np.isfinite(exact), exact, np.inf))
    reach = math.ceil(mixing) + 1
    nearest = own
    padded = np.pad(exact, reach, constant_values=np.nan)
    height, width = exact.shape
    for dv in range(2 * reach + 1):
        for du in range(2 * reach + 1):
            other = np.abs(mixed - padded[dv : dv + height, du : du + width])
            nearest = np.fmin(nearest, other)
    return np.where(np.isfinite(nearest), nearest, step)


def by_nacre(**options: Any) -> Way:
    """Return nacre's cleaning; the noise is measured from the image."""
    return lambda depth, camera, sigma: np.isfinite(nacre.preprocess_depth(depth, camera, **options))


def erode(depth: Array, camera: Any, sigma: float) -> Array:
    """Remove two pixels around missing pixels and jumps of 2 cm."""
    edge = ~np.isfinite(depth)
    for axis in (0, 1):
        step = np.abs(np.diff(depth, axis=axis)) > 0.02
        edge |= pad(step, axis, 0) | pad(step, axis, 1)
    edge = grow(edge)
    return np.asarray(~edge)


def threshold(depth: Array, camera: Any, sigma: float) -> Array:
    """Remove pixels that differ from a neighbour by more than six sigma and a twentieth of a footprint."""
    edge = ~np.isfinite(depth)
    for axis in (0, 1):
        step = np.abs(np.diff(depth, axis=axis)) > max(0.005, 6 * sigma)
        edge |= pad(step, axis, 0) | pad(step, axis, 1)
    return np.asarray(~edge)


def median(depth: Array, camera: Any, sigma: float) -> Array:
    """Remove pixels that are far from the median of 5 x 5."""
    import cv2

    filled = np.nan_to_num(depth).astype(np.float32)
    off = np.abs(filled - cv2.medianBlur(filled, 5))
    return np.asarray(np.isfinite(depth) & (off < max(0.005, 6 * sigma)))


def pad(step: Array, axis: int, side: int) -> Array:
    """Return an array as large as the image whose differences these are."""
    widths = [(0, 0), (0, 0)]
    widths[axis] = (1, 0) if side else (0, 1)
    return np.pad(step, widths)


def grow(edge: Array) -> Array:
    """Return the pixels and their neighbours."""
    wide = np.pad(edge, 1)
    rows = wide[:-2] | wide[1:-1] | wide[2:]
    return np.asarray(rows[:, :-2] | rows[:, 1:-1] | rows[:, 2:])


WAYS: dict[str, Way] = {
    "nacre": by_nacre(),
    "nacre, the paper's gradient test": by_nacre(edge_test="gradient"),
    "2 px erosion at jumps": erode,
    "threshold of differences": threshold,
    "median of 5 x 5 (OpenCV)": median,
}
SCENES = [
    *(Scene(camera, slant, None, 0.001, 1.0) for camera in CAMERAS for slant in (0, 30, 45, 60, 70, 75)),
    *(Scene("pinhole", 30, None, sigma, 1.0) for sigma in (0.0, 0.0003, 0.003)),
    *(Scene("pinhole", 30, step, 0.001, 1.0) for step in (0.01, 0.02, 0.05, 0.2)),
    *(Scene("pinhole", 30, None, 0.001, mixing) for mixing in (2.0, 3.0, 4.0)),
    *(Scene("pinhole", 60, 0.1, 0.001, mixing) for mixing in (1.0, 2.0, 4.0)),
]


def figures(scene: Scene) -> dict[str, tuple[float, float]]:
    """Return the part of the mixed pixels that each way removes, and of the true ones [%]."""
    sums: dict[str, list[float]] = {}
    for camera, depth, is_mixed, is_true in scene.images():
        for name, way in WAYS.items():
            try:
                kept = way(depth, camera, scene.sigma)
            except ImportError:
                continue
            measured = np.isfinite(depth)
            counts = sums.setdefault(name, [0, 0, 0, 0])
            mixed, true = is_mixed & measured, is_true & measured
            for i, count in enumerate((mixed & ~kept, mixed, true & ~kept, true)):
                counts[i] += int(count.sum())
    return {name: (100 * a / max(b, 1), 100 * c / max(d, 1)) for name, (a, b, c, d) in sums.items()}


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.parse_args()
    found = {scene: figures(scene) for scene in SCENES}
    names = list(next(iter(found.values())))
    print("| scene | " + " | ".join(names) + " |")
    print("| --- " * (len(names) + 1) + "|")
    for scene, row in found.items():
        behind = "nothing behind" if scene.step is None else f"wall {1000 * scene.step:g} mm behind"
        words = (
            f"{scene.camera}, {scene.slant} degrees, {behind}, sigma {1000 * scene.sigma:g} mm, "
            f"blur {scene.mixing:g} px"
        )
        cells = " | ".join(f"{mixed:.1f} / {true:.1f}" for mixed, true in row.values())
        print(f"| {words} | {cells} |")


if __name__ == "__main__":
    main()
