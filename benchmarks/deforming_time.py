#!/usr/bin/env python3
"""
Measure how the time of a frame grows with the points and nodes of what bends.

    python benchmarks/deforming_time.py
    python benchmarks/deforming_time.py pipe 640x480

The things of `deforming_scenes.py` as a camera of several sizes sees them, on two threads, at several
spacings of the model's points; and the rigid loop on the same images. Time is the median of a frame.
"""

from __future__ import annotations

import sys
from typing import Any

import numpy as np
from cases import Array
from deforming_scenes import THINGS, record

import nacre

SIZES = ("160x120", "320x240", "640x480")
SPACINGS = (1.0, 0.5)
"""Of the spacing that nacre chooses."""
NUM_FRAMES = 40


def camera_of(size: str) -> nacre.Camera:
    """Return a camera of a Kinect's view, from its size in pixels as WIDTHxHEIGHT."""
    width, height = (int(part) for part in size.split("x"))
    focal = 262.5 * width / 320
    return nacre.Camera(width, height, focal, focal, (width - 1) / 2, (height - 1) / 2)


def time_of(model: nacre.Model) -> float:
    """Return the median time of its frames [ms], without the first."""
    return float(np.median([report.milliseconds["total"] for report in model.frames[1:]]))


def run(camera: nacre.Camera, depths: list[Array], **options: Any) -> nacre.Model:
    """Return a model of images."""
    model = nacre.Model(camera, num_threads=2, **options)
    for depth in depths:
        model.add_frame(depth)
    return model


def main() -> None:
    """Print a table of the things and sizes that are named, or of all."""
    names = [word for word in sys.argv[1:] if word in THINGS] or ["homer", "pipe"]
    sizes = [word for word in sys.argv[1:] if word[0].isdigit()] or list(SIZES)
    print("| thing | image | points | nodes | ms | rigid, ms |\n|---|---|---|---|---|---|")
    for name in names:
        for size in sizes:
            camera = camera_of(size)
            recording = record(name, NUM_FRAMES, camera=camera)
            rigid = run(camera, recording.depths)
            for factor in SPACINGS:
                bent = run(camera, recording.depths, deform=True, spacing=factor * rigid.spacing)
                nodes = bent.frames[-1].deformation.num_nodes
                times = f"{time_of(bent):.0f} | {time_of(rigid):.0f}"
                print(f"| {name} | {size} | {len(bent)} | {nodes} | {times} |", flush=True)


if __name__ == "__main__":
    main()
