"""Which threads a package should have: nacre's own against OpenMP's, idle, busy, and beside others.

The installations differ in NACRE_PARALLEL alone; each measurement is a process, and they take turns:

    for backend in threads openmp; do
      pip install --target build/$backend -C cmake.define.NACRE_PARALLEL=$backend .
    done
    python benchmarks/parallel.py build/threads build/openmp
"""

from __future__ import annotations

import argparse
import importlib.util
import json
import multiprocessing
import os
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

FRAMES = 40
SCENES = ("idle", "busy", "pause", "blas", "torch", "fork")
ABOUT = {
    "idle": "frame after frame",
    "busy": "as many other processes that compute as there are processors",
    "pause": "10 ms of sleep after each frame, as with a camera",
    "blas": "a product of matrices by NumPy after each frame",
    "torch": "a product of matrices by PyTorch after each frame",
    "fork": "in a child, after the parent's frames",
}


def between_frames(scene: str) -> Callable[[], object]:
    """Return what the process does after each frame."""
    if scene == "pause":
        return lambda: time.sleep(0.01)
    if scene == "blas":
        import numpy as np

        matrix = np.random.default_rng(0).random((400, 400))
        return lambda: matrix @ matrix
    if scene == "torch":
        import torch

        tensor = torch.rand(400, 400)
        return lambda: torch.mm(tensor, tensor).relu_()
    return lambda: None


def measure(scene: str) -> dict[str, float]:
    """Register frames against a model; return medians of wall and processor time a frame [ms]."""
    import nacre

    thing = nacre.built_in_object()
    camera = nacre.Camera(width=320, height=240, fx=300, fy=300, cx=159.5, cy=119.5)
    poses = nacre.turntable_poses(thing, FRAMES, 0.02, camera=camera)
    mesh = (thing.vertices, thing.triangles)
    images = [nacre.simulate_depth(*mesh, camera, pose, noise=0.0003) for pose in poses]
    aside = between_frames(scene)

    def grow() -> dict[str, float]:
        model = nacre.Model(camera)
        begin, used = time.perf_counter(), time.process_time()
        wall = []
        for image in images:
            start = time.perf_counter()
            model.add_frame(image)
            wall.append(time.perf_counter() - start)
            aside()
        total, processor = time.perf_counter() - begin, time.process_time() - used
        figures = {"frame": statistics.median(wall), "whole": total / FRAMES, "processor": processor / FRAMES}
        return {name: 1000 * value for name, value in figures.items()}

    grow()
    if scene != "fork":
        return grow()
    context = multiprocessing.get_context("fork")
    receiver, sender = context.Pipe(False)
    child = context.Process(target=lambda: sender.send(grow()))
    child.start()
    if not receiver.poll(120):
        child.kill()
        return {"frame": float("inf"), "whole": float("inf"), "processor": float("inf")}
    return dict(receiver.recv())


def spin() -> None:
    """Compute until ended."""
    while True:
        sum(range(100000))


def run(installation: str, scene: str) -> dict[str, float]:
    """Measure in a process of its own."""
    busy = [multiprocessing.Process(target=spin, daemon=True) for _ in range(os.cpu_count() or 1)]
    for process in busy if scene == "busy" else []:
        process.start()
    try:
        command = [sys.executable, __file__, "--scene", scene]
        path = os.pathsep.join([installation, os.environ.get("PYTHONPATH", "")])
        environment = {**os.environ, "PYTHONPATH": path}
        done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    finally:
        for process in busy if scene == "busy" else []:
            process.kill()
    return dict(json.loads(done.stdout))


def main() -> None:
    """Print a table."""
    as_written = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=as_written)
    parser.add_argument("installations", nargs="*", metavar="FOLDER", help="what to compare")
    parser.add_argument("--scene", choices=SCENES, help="measure this one, of the nacre that Python finds")
    parser.add_argument("--rounds", type=int, default=5)
    options = parser.parse_args()
    if options.scene:
        print(json.dumps(measure(options.scene)))
        return
    scenes = [scene for scene in SCENES if scene != "torch" or importlib.util.find_spec("torch")]
    print(f"{'':46} {'frame':>8} {'whole':>8} {'processor':>10}   medians of {options.rounds} [ms]")
    for scene in scenes:
        rounds = [[run(folder, scene) for folder in options.installations] for _ in range(options.rounds)]
        for index, folder in enumerate(options.installations):
            name = f"{scene:6} {Path(folder).name}"
            figures = [
                statistics.median(answers[index][key] for answers in rounds)
                for key in ("frame", "whole", "processor")
            ]
            print(f"{name:46} {figures[0]:8.1f} {figures[1]:8.1f} {figures[2]:10.1f}   {ABOUT[scene]}")


if __name__ == "__main__":
    main()
