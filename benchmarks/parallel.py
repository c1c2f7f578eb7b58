"""Which threads a package should have: nacre's own pool or OpenMP's team, idle, busy, and beside others.

    python benchmarks/parallel.py               # needs NumPy; PyTorch where it is installed

Builds nacre with each into build/parallel, with pip (minutes), and measures frames of a turning object. Each
measurement is a process, and the two take turns. Ends with an error where two models have not the same bits.
"""

from __future__ import annotations

import argparse
import hashlib
import importlib.util
import json
import multiprocessing
import os
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
BACKENDS = ("threads", "openmp")
SCENES = {
    "idle": "frame after frame",
    "busy": "beside as many processes that compute as there are processors",
    "pause": "10 ms of sleep after each frame, as with a camera",
    "numpy": "a product of matrices by NumPy after each frame",
    "torch": "a product of matrices by PyTorch after each frame",
    "fork": "in a child process, after its parent's frames",
}


def between_frames(scene: str) -> Callable[[], object]:
    """Return what the process does after each frame."""
    if scene == "pause":
        return lambda: time.sleep(0.01)
    if scene == "numpy":
        import numpy as np

        matrix = np.random.default_rng(0).random((400, 400))
        return lambda: matrix @ matrix
    if scene == "torch":
        import torch

        tensor = torch.rand(400, 400)
        return lambda: torch.mm(tensor, tensor).relu_()
    return lambda: None


def in_child(work: Callable[[], Any]) -> Any:
    """Do it in a forked process, and return what it returns; two minutes at most."""
    context = multiprocessing.get_context("fork")
    receiver, sender = context.Pipe(False)
    child = context.Process(target=lambda: sender.send(work()))
    child.start()
    if not receiver.poll(120):
        child.kill()
        raise TimeoutError("the forked process waits for threads that it does not have")
    return receiver.recv()


def measure(scene: str, threads: int, frames: int) -> dict[str, Any]:
    """Return wall and processor time a frame [ms], the SHA-256 of the model, and the backend."""
    import nacre

    thing = nacre.built_in_object()
    camera = nacre.Camera(width=320, height=240, fx=300, fy=300, cx=159.5, cy=119.5)
    poses = nacre.turntable_poses(thing, frames, 0.02, camera=camera)
    images = [thing.simulate_depth(camera, poses[i], noise=0.0003, seed=i) for i in range(frames)]
    aside = between_frames(scene)

    def grow() -> dict[str, Any]:
        model = nacre.Model(camera, num_threads=threads)
        wall, used = [], time.process_time()
        for image in images:
            begin = time.perf_counter()
            model.add_frame(image)
            wall.append(1000 * (time.perf_counter() - begin))
            aside()
        processor = 1000 * (time.process_time() - used) / frames
        parts = (model.points, model.normals, model.poses)
        digest = hashlib.sha256(b"".join(part.tobytes() for part in parts)).hexdigest()
        return {"wall": statistics.median(wall), "processor": processor, "sha256": digest}

    grow()
    return {**(in_child(grow) if scene == "fork" else grow()), "backend": nacre.parallel_backend()}


def spin() -> None:
    """Compute until ended."""
    while True:
        sum(range(100000))


@contextmanager
def load(processes: int) -> Iterator[None]:
    """Keep processors busy."""
    busy = [multiprocessing.Process(target=spin, daemon=True) for _ in range(processes)]
    for process in busy:
        process.start()
    try:
        yield
    finally:
        for process in busy:
            process.kill()


def install(backend: str, folder: Path) -> None:
    """Build nacre with one kind of threads."""
    settings = [f"cmake.define.NACRE_PARALLEL={backend}", f"build-dir={folder}-build"]
    command = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--upgrade"]
    options = [word for setting in settings for word in ("-C", setting)]
    subprocess.run([*command, "--target", str(folder), *options, str(ROOT)], check=True)


def in_fresh_process(installation: Path, *words: str) -> dict[str, Any]:
    """Measure with one of the installations."""
    path = os.pathsep.join([str(installation), os.environ.get("PYTHONPATH", "")])
    command = [sys.executable, __file__, "--measure", *words]
    environment = {**os.environ, "PYTHONPATH": path}
    done = subprocess.run(command, env=environment, stdout=subprocess.PIPE, text=True, check=True)
    return dict(json.loads(done.stdout))


def main() -> None:
    """Print a table."""
    as_written = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=as_written)
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--frames", type=int, default=40)
    parser.add_argument("--threads", type=int, nargs="+", default=[1, 2])
    parser.add_argument("--keep", action="store_true", help="what was built before")
    parser.add_argument("--measure", nargs=3, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.measure:
        scene, threads, frames = options.measure
        print(json.dumps(measure(scene, int(threads), int(frames))))
        return
    installations = {backend: ROOT / "build" / "parallel" / backend for backend in BACKENDS}
    for backend, folder in installations.items():
        if not (options.keep and folder.exists()):
            install(backend, folder)
    found = set()
    print(f"load before: {os.getloadavg()[0]:.1f}; {options.rounds} rounds, times of a frame [ms]")
    print(f"{'':6} threads  backend  wall: median  best   processor: median  best")
    for scene, about in SCENES.items():
        if scene == "torch" and not importlib.util.find_spec("torch"):
            continue
        print(f"{scene}: {about}", flush=True)
        for threads in options.threads:
            words = (scene, str(threads), str(options.frames))
            with load(os.cpu_count() or 1 if scene == "busy" else 0):
                rounds = [
                    {backend: in_fresh_process(folder, *words) for backend, folder in installations.items()}
                    for _ in range(options.rounds)
                ]
            for backend in BACKENDS:
                said = [answers[backend] for answers in rounds]
                assert {answer["backend"] for answer in said} == {backend}
                found |= {answer["sha256"] for answer in said}
                figures = [
                    of(answer[time] for answer in said)
                    for time in ("wall", "processor")
                    for of in (statistics.median, min)
                ]
                print(
                    f"{threads:14}  {backend:7}  {{:12.1f}} {{:5.1f}}   {{:17.1f}} {{:5.1f}}".format(*figures)
                )
    assert len(found) == 1, f"models with other bits: {sorted(found)}"
    print(f"load after: {os.getloadavg()[0]:.1f}; the same bits in all, SHA-256 {found.pop()[:16]}")


if __name__ == "__main__":
    main()
