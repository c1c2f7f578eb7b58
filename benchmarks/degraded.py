#!/usr/bin/env python3
"""
Make the images of real recordings worse, one way at a time, and see what is still tracked rightly.

    python benchmarks/degraded.py teddy d435 robot iphone most=60
    python benchmarks/degraded.py teddy d435 only="noise|missing|to 5 mm|focal" peers=opencv_tsdf

writes a table of frames claimed and right, and of the trajectory's error, for each damage: of nacre, and of
peers (see `track/peers/`; `grid=0.01` [m], or twice a pixel) where they are installed, as by `tracking.py`.
"""

from __future__ import annotations

import math
import re
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import numpy.typing as npt
from cases import Case, Figures, make, measure, run
from track import peers

import nacre

Depth = npt.NDArray[np.float32]

STILL_FRAMES = 10  # before somebody walks through the image
FRAMES_TO_PASS = 45


def unchanged(case: Case) -> Case:
    """Return the recording as it is."""
    return case


def noisier(times: float) -> Callable[[Case], Case]:
    """Add noise, so many times as much as the first image has, independent from pixel to pixel."""

    def change(case: Case) -> Case:
        rng = np.random.default_rng(1)
        noise = nacre.estimate_noise(case.depths[0], case.camera)

        def add(depth: Depth) -> Depth:
            sigma = noise.constant + noise.quadratic * (depth - noise.offset) ** 2
            return (depth + times * sigma * rng.standard_normal(depth.shape)).astype(np.float32)

        return each(case, add)

    return change


def missing(part: float) -> Callable[[Case], Case]:
    """Take pixels away at random."""

    def change(case: Case) -> Case:
        rng = np.random.default_rng(1)
        return each(case, lambda depth: np.where(rng.random(depth.shape) < part, np.float32(np.nan), depth))

    return change


def wrong(part: float) -> Callable[[Case], Case]:
    """Give pixels at random any value, as outliers of time of flight have."""

    def change(case: Case) -> Case:
        rng = np.random.default_rng(1)

        def scatter(depth: Depth) -> Depth:
            is_wrong = rng.random(depth.shape) < part
            return np.where(is_wrong, rng.uniform(0.3, 6.0, depth.shape), depth).astype(np.float32)

        return each(case, scatter)

    return change


def spread(apart: int) -> Callable[[Case], Case]:
    """Leave one pixel of each block, as where images are moved into those of a camera with finer pixels."""

    def change(depth: Depth) -> Depth:
        points = np.full_like(depth, np.nan)
        points[::apart, ::apart] = depth[::apart, ::apart]
        return points

    return lambda case: each(case, change)


def rounded(unit: float) -> Callable[[Case], Case]:
    """Round depth to multiples of a unit [m]."""
    return lambda case: each(case, lambda depth: np.round(depth / np.float32(unit)) * np.float32(unit))


def in_disparity(unit: float) -> Callable[[Case], Case]:
    """Round inverse depth to multiples of a unit [1/m], as stereo cameras do, and store whole millimetres."""

    def change(depth: Depth) -> Depth:
        steps = np.round(1 / (depth * np.float32(unit)))
        with np.errstate(divide="ignore"):
            return np.where(steps > 0, np.round(1000 / (steps * np.float32(unit))) / 1000, np.nan).astype(
                np.float32
            )

    return lambda case: each(case, change)


def filled(value: float) -> Callable[[Case], Case]:
    """Give a value where nothing was measured [m], as simulators and some cameras do."""
    return lambda case: each(
        case, lambda depth: np.where(np.isfinite(depth) & (depth > 0), depth, np.float32(value))
    )


def repeated(every: int) -> Callable[[Case], Case]:
    """Give every so many-th image twice, as recordings do that wait for no new depth."""

    def change(case: Case) -> Case:
        order = [i for i in range(len(case.depths)) for _ in range(2 if i % every == 0 else 1)]
        return replace(
            case,
            depths=[case.depths[i] for i in order],
            colors=[case.colors[i] for i in order],
            truths=[case.truths[i] for i in order],
        )

    return change


def dropped(every: int, count: int = 1) -> Callable[[Case], Case]:
    """Let so many images in a row show nothing, after every so many."""

    def change(case: Case) -> Case:
        depths = [
            np.zeros_like(depth) if i % (every + count) >= every else depth
            for i, depth in enumerate(case.depths)
        ]
        return replace(case, depths=depths)

    return change


def rested(count: int) -> Callable[[Case], Case]:
    """Let the camera rest first: its first image so many times, each with noise of its own."""

    def change(case: Case) -> Case:
        still = replace(case, depths=[case.depths[0]] * count)
        return replace(
            case,
            depths=[*noisier(1)(still).depths, *case.depths[1:]],
            colors=[case.colors[0]] * count + list(case.colors[1:]),
            truths=[case.truths[0]] * count + list(case.truths[1:]),
        )

    return change


def every_pixel(step: int) -> Callable[[Case], Case]:
    """Keep one pixel of so many, each way."""

    def change(case: Case) -> Case:
        smaller = each(case, lambda depth: np.ascontiguousarray(depth[::step, ::step]))
        height, width = smaller.depths[0].shape
        old = case.camera
        camera = nacre.Camera(width, height, old.fx / step, old.fy / step, old.cx / step, old.cy / step)
        return replace(smaller, camera=camera, colors=[None] * len(case.depths))

    return change


def enlarged(times: int) -> Callable[[Case], Case]:
    """Repeat each pixel so many times, each way."""

    def change(case: Case) -> Case:
        larger = each(case, lambda depth: np.repeat(np.repeat(depth, times, axis=0), times, axis=1))
        height, width = larger.depths[0].shape
        old = case.camera
        centre = [(c + 0.5) * times - 0.5 for c in (old.cx, old.cy)]
        camera = nacre.Camera(width, height, old.fx * times, old.fy * times, *centre)
        return replace(larger, camera=camera, colors=[None] * len(case.depths))

    return change


def wrong_focal_length(factor: float) -> Callable[[Case], Case]:
    """Say a wrong focal length."""

    def change(case: Case) -> Case:
        old = case.camera
        camera = nacre.Camera(old.width, old.height, old.fx * factor, old.fy * factor, old.cx, old.cy)
        return replace(case, camera=camera)

    return change


def distorted(factor: float) -> Callable[[Case], Case]:
    """Let the lens bend rays by a factor of the squared slope, of which nobody knows."""

    def change(case: Case) -> Case:
        camera, (height, width) = case.camera, case.depths[0].shape
        v, u = np.mgrid[:height, :width]
        x, y = (u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy
        bent = 1 + factor * (x**2 + y**2)
        column = np.round(x * bent * camera.fx + camera.cx).astype(int)
        row = np.round(y * bent * camera.fy + camera.cy).astype(int)
        inside = (column >= 0) & (column < width) & (row >= 0) & (row < height)
        column, row = np.clip(column, 0, width - 1), np.clip(row, 0, height - 1)
        return replace(
            each(case, lambda depth: np.where(inside, depth[row, column], np.nan).astype(np.float32)),
            colors=[None if color is None else color[row, column] for color in case.colors],
        )

    return change


def passed_by(part: float) -> Callable[[Case], Case]:
    """Let somebody walk through the image, there and back: a cylinder that fills so much of its width."""

    def change(case: Case) -> Case:
        camera = case.camera
        seen = [np.where(np.asarray(depth) > 0, depth, np.nan) for depth in case.depths]
        distance = 0.6 * np.nanmedian(seen[0])
        radius = 0.5 * part * distance * camera.width / camera.fx
        slope = (np.arange(camera.width) - camera.cx) / camera.fx
        farthest = 0.5 * (1 + part) * distance * camera.width / camera.fx
        noise, rng = nacre.estimate_noise(case.depths[0], camera), np.random.default_rng(1)

        def cylinder(frame: int) -> Depth:
            time = (frame - STILL_FRAMES) / FRAMES_TO_PASS
            if time < 0:
                return np.full(camera.width, np.inf, np.float32)
            centre = farthest * (1 - 4 * abs((time / 2) % 1 - 0.5))
            # (s z - centre)^2 + (z - distance)^2 = radius^2, the nearer of both z
            a, b, c = slope**2 + 1, slope * centre + distance, centre**2 + distance**2 - radius**2
            inside = b**2 - a * c
            return np.where(inside > 0, (b - np.sqrt(np.abs(inside))) / a, np.inf).astype(np.float32)

        def add(frame: int, depth: Depth) -> Depth:
            row = cylinder(frame)[None]
            before = np.isfinite(row) & ~(depth < row)
            seen = np.where(before, row, depth)
            sigma = noise.constant + noise.quadratic * (seen - noise.offset) ** 2
            return np.where(before, seen + sigma * rng.standard_normal(depth.shape), depth).astype(np.float32)

        return replace(case, depths=[add(i, depth) for i, depth in enumerate(seen)])

    return change


def holding(part: float) -> Callable[[Case], Case]:
    """Put a rough gripper before the camera, 0.25 m away, over so much of the image."""

    def change(case: Case) -> Case:
        width, height = case.camera.width, case.camera.height
        rng = np.random.default_rng(3)
        v, u = np.mgrid[:height, :width]
        surface = 0.25 + 0.04 * np.sin(8 * math.pi * u / width) * np.cos(8 * math.pi * v / height)
        tall, wide = 1.2 * math.sqrt(part) * height, math.sqrt(part) / 1.2 * width
        inside = (v > height - tall) & (u > 0.55 * width) & (u < 0.55 * width + wide)

        def add(depth: Depth) -> Depth:
            return np.where(inside, surface + rng.normal(0, 0.0008, depth.shape), depth).astype(np.float32)

        return each(case, add)

    return change


def each(case: Case, change: Callable[[Depth], Depth]) -> Case:
    """Change each image."""
    return replace(case, depths=[change(np.asarray(depth, np.float32)) for depth in case.depths])


DAMAGES: dict[str, Callable[[Case], Case]] = {
    "as it is": unchanged,
    **{f"{times} times its noise added": noisier(times) for times in (1, 2, 4, 8)},
    **{f"{100 * part:.0f} % of the pixels missing": missing(part) for part in (0.1, 0.3, 0.5)},
    **{f"{100 * part:.0f} % of the pixels wrong": wrong(part) for part in (0.05, 0.1)},
    "one pixel of nine left": spread(3),
    **{f"rounded to {1000 * unit:.0f} mm": rounded(unit) for unit in (0.005, 0.01, 0.02, 0.05, 0.1)},
    **{f"disparity in steps of {unit} / m": in_disparity(unit) for unit in (0.0075, 0.015, 0.03)},
    "10 m where nothing was measured": filled(10.0),
    "every third image twice": repeated(3),
    "every tenth image empty": dropped(9),
    "three images of twenty empty": dropped(17, 3),
    "at rest for 30 frames first": rested(30),
    "every second pixel": every_pixel(2),
    "every fourth pixel": every_pixel(4),
    "pixels doubled": enlarged(2),
    **{f"somebody passing, {100 * part:.0f} % wide": passed_by(part) for part in (0.15, 0.3, 0.45)},
    **{f"a gripper over {100 * part:.0f} % of the image": holding(part) for part in (0.1, 0.2, 0.35)},
    **{f"focal length {factor:+.0%}": wrong_focal_length(1 + factor) for factor in (-0.03, 0.03)},
    **{f"rays bent by {factor:+.0%} of their squared slope": distorted(factor) for factor in (-0.05, 0.05)},
}


def run_peer(name: str, case: Case, grid: float) -> Figures:
    """Run a peer's loop with a grid [m]; a frame that it fails on is lost."""
    depths = [np.asarray(depth, np.float32) for depth in case.depths]
    loop, frames = peers.make(name, case.camera, depths[0], grid), []
    for depth in depths:
        start = time.perf_counter()
        try:
            pose = loop.add(depth)
        except RuntimeError:
            pose = None
        status = "LOST" if pose is None else "TRACKED"
        spent = {"total": 1e3 * (time.perf_counter() - start)}
        frames.append(SimpleNamespace(status=status, world_from_camera=pose, milliseconds=spent))
    return measure(case, SimpleNamespace(frames=frames, points=[]))


def cell(figures: Figures) -> str:
    """Return frames claimed and right, and the trajectory's error."""
    error = f", {figures.ate:.1f} mm" if figures.claimed > 1 and np.isfinite(figures.ate) else ""
    return f"{figures.claimed} / {figures.right}{error}"


def main() -> None:
    """Measure the recordings that are named, with settings as those of `cases.py`."""
    settings: dict[str, Any] = dict(word.split("=") for word in sys.argv[1:] if "=" in word)
    most, only, grid = int(settings.get("most", 60)), settings.get("only", ""), float(settings.get("grid", 0))
    others = settings["peers"].split(",") if "peers" in settings else []
    names = [word for word in sys.argv[1:] if "=" not in word] or ["teddy", "d435", "robot", "iphone"]
    cases = [make(name, most=most) for name in names]
    heads = [f"{name}, {len(case.depths)}" for name, case in zip(names, cases, strict=True)]
    if others:
        titles = ["nacre", *(peers.TITLES[peer].partition(":")[0] for peer in others)]
        heads = [f"{head}: {title}" for head in heads for title in titles]
    print(f"| frames | {' | '.join(heads)} |")
    print("|---" * (len(heads) + 1) + "|")
    for damage in [damage for damage in DAMAGES if re.search(only, damage)]:
        found = []
        for case in map(DAMAGES[damage], cases):
            found += [run(case)[0], *(run_peer(peer, case, grid) for peer in others)]
        print(f"| {damage} | {' | '.join(map(cell, found))} |", flush=True)


if __name__ == "__main__":
    main()
