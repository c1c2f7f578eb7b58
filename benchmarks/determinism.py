"""
Whole reconstructions, again and again: model, trajectory and report have the same bits.

    python benchmarks/determinism.py                                  # simulated recordings
    python benchmarks/determinism.py --recording FOLDER --frames 40   # and a real one
    python benchmarks/determinism.py --threads 1,2 --repeats 2        # as the tests run it

Each recording is run with each number of threads, some more times in one process, saved and loaded on the
way, and in other processes: with each instruction set, hash seed, locale and time zone, on one processor, and
with dirty memory. Prints the SHA-256 of each, and by how much it differs; ends with 1 where it may not.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from simulated import Scene

import nacre
from nacre.datasets.sequence import SequenceFrame
from nacre.reconstruction import Reconstruction

Array = npt.NDArray[Any]

MODELS: dict[str, dict[str, Any]] = {
    "room": {
        "max_points": 8000
    },  # a full turn with wrong focal length, so that a loop closes; lost frames; colours
    "object": {"region": {"object": True}},
    "wlop": {"fusion_method": "wlop", "max_points": 1000},
    "wlop+": {"fusion_method": "wlop+", "max_points": 1000},
    "recording": {},
}
# Environments of other processes; "processors" is how many the process may use.
ELSEWHERE: dict[str, dict[str, str]] = {
    "another process": {"PYTHONHASHSEED": "1"},
    "another hash seed, dirty memory": {"PYTHONHASHSEED": "271828", "MALLOC_PERTURB_": "170"},
    "German locale, time zone of Tokyo": {"LC_ALL": "de_DE.UTF-8", "TZ": "Asia/Tokyo"},
    "one processor": {"processors": "1"},
    "NACRE_SIMD=baseline": {"NACRE_SIMD": "baseline"},
    "NACRE_SIMD=avx2": {"NACRE_SIMD": "avx2"},
    "NACRE_SIMD=avx512": {"NACRE_SIMD": "avx512"},
}
FREE = {"wlop", "wlop+"}  # may differ between instruction sets


@dataclass(eq=False)
class Result:
    """What a run left: its arrays, and the figures of its report that are no times."""

    arrays: dict[str, Array]
    figures: str
    about: str = ""

    @property
    def sha256(self) -> str:
        """Of all of it."""
        total = hashlib.sha256(self.figures.encode())
        for name, array in sorted(self.arrays.items()):
            total.update(f"{name}{array.dtype}{array.shape}".encode())
            total.update(np.ascontiguousarray(array).tobytes())
        return total.hexdigest()

    def difference(self, other: Result) -> str:
        """Say how far apart two results are."""
        points, others = self.arrays["points"], other.arrays["points"]
        poses = np.abs(self.arrays["poses"] - other.arrays["poses"])
        said = f"poses up to {np.nanmax(poses):.1e}"
        if len(points) != len(others):
            return f"{said}, {len(points)} and {len(others)} points"
        return f"{said}, points up to {np.abs(points - others).max():.1e} m"


def recording(name: str, frames: int, path: str | None) -> Sequence[SequenceFrame]:
    """Return the frames of a case."""
    if name == "recording":
        assert path is not None
        opened: Sequence[SequenceFrame] = nacre.open_sequence(path)[:frames]
        return opened
    if name.startswith("wlop"):
        thing = nacre.built_in_object()
        camera, poses = nacre.default_camera(thing), nacre.turntable_poses(thing, 8, np.radians(15))
        views = [thing.simulate_depth(camera, pose, noise=0.0005, seed=i) for i, pose in enumerate(poses)]
        return [SequenceFrame(i, view, camera, None, None, None) for i, view in enumerate(views)]
    scene = Scene("object" if name == "object" else "turning", 160, views=max(36, frames - 4), sigma=0.001)
    camera = scene.camera
    if name == "room":
        wrong = 1.015 * camera.fx
        camera = nacre.Camera(camera.width, camera.height, wrong, wrong, camera.cx, camera.cy)
    images = [scene.depth(i) for i in range(frames)]
    if name in ("room", "object"):
        images[5] = np.full_like(images[5], np.nan)  # covered
        images[9] = np.random.default_rng(9).uniform(0.5, 2, images[9].shape).astype(np.float32)
    return [
        SequenceFrame(i, image, camera, timestamp=i / 30, color=scene.color(i), truth=scene.truth(i))
        for i, image in enumerate(images)
    ]


def without_times(value: Any) -> Any:
    """Return figures less what is measured by a clock, or says with how many threads."""
    if isinstance(value, dict):
        left_out = ("milliseconds", "num_threads", "versions")
        return {key: without_times(entry) for key, entry in value.items() if key not in left_out}
    return [without_times(entry) for entry in value] if isinstance(value, list) else value


def reconstruct(
    name: str, sequence: Sequence[SequenceFrame], num_threads: int, interrupted: int | None = None
) -> Result:
    """Run one case; save it after some frames, forget it, load it and go on, if asked to."""
    model = nacre.Model(sequence[0].camera, num_threads=num_threads, **MODELS[name])
    done = Reconstruction(sequence, model)
    if interrupted is not None:
        for _ in done.run(range(interrupted)):
            pass
        with tempfile.TemporaryDirectory() as folder:
            done.save(Path(folder) / "checkpoint")
            done = Reconstruction.load(Path(folder) / "checkpoint", sequence)
    done.complete()
    model = done.model
    figures = without_times(done.as_dict())
    arrays: dict[str, Array] = {
        "points": model.points,
        "normals": model.normals,
        "confidence": model.confidence,
        "last_seen": model.last_seen,
        "poses": done.poses,
        "trajectory": done.trajectory.poses,
    }
    if model.colors is not None:
        arrays["colors"] = model.colors
    counts = ", ".join(f"{count} {status}" for status, count in done.counts.items() if count)
    about = f"{counts}, {len(done.loops)} loops, {len(model)} points"
    return Result(arrays, json.dumps(figures, sort_keys=True), about)


def in_another_process(name: str, words: list[str], environment: dict[str, str]) -> Result | str:
    """Run one case there; return why not where it cannot be."""
    environment = dict(environment)
    command = [sys.executable, str(Path(__file__).resolve()), "--only", name, *words]
    if "processors" in environment:
        if not hasattr(os, "sched_setaffinity"):
            return "no processor affinity on this system"
        command = ["taskset", "--cpu-list", str(min(os.sched_getaffinity(0))), *command]
        environment.pop("processors")
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "result.npz"
        done = subprocess.run(
            [*command, "--save", str(file)],
            env={**os.environ, **environment},
            capture_output=True,
            text=True,
            check=False,
        )
        if "which this processor does not have" in done.stderr:
            return "not on this processor"
        if done.returncode != 0:
            raise RuntimeError(f"{name} in {environment}:\n{done.stderr}")
        with np.load(file) as saved:
            arrays = {key: saved[key] for key in saved.files if key != "figures"}
            return Result(arrays, str(saved["figures"]))


def compare(name: str, options: argparse.Namespace) -> bool:
    """Run a case in every way, print what came of it, and return whether it is as promised."""
    sequence = recording(name, options.frames, options.recording)
    first = reconstruct(name, sequence, options.threads[0])
    print(f"{name}: {len(sequence)} frames, {first.about}")
    holds = True

    def tell(way: str, result: Result | str, free: bool = False) -> None:
        nonlocal holds
        if isinstance(result, str):
            print(f"  {way:36} {result}")
            return
        same = result.sha256 == first.sha256
        holds &= same or free
        print(f"  {way:36} {result.sha256[:16]}  {'same' if same else first.difference(result)}", flush=True)

    print(f"  {'SHA-256':36} {first.sha256}")
    for threads in options.threads[1:]:
        tell(f"{threads} threads", reconstruct(name, sequence, threads))
    repeats = {first.sha256: first}
    for _ in range(options.repeats):
        repeated = reconstruct(name, sequence, 0)
        repeats[repeated.sha256] = repeated
    tell(f"{options.repeats} times, all threads", list(repeats.values())[-1])
    for part in (0.25, 0.5, 0.9):
        frames = int(part * len(sequence))
        tell(f"saved and loaded after {frames} frames", reconstruct(name, sequence, 0, frames))
    words = [
        "--frames",
        str(options.frames),
        *(["--recording", options.recording] if options.recording else []),
    ]
    for way, environment in ELSEWHERE.items():
        free = "NACRE_SIMD" in environment and name in FREE
        tell(way, in_another_process(name, words, environment), free)
    return holds


def main() -> int:
    """Compare the cases that are asked for."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    numbers = lambda text: [int(word) for word in text.split(",")]  # noqa: E731
    parser.add_argument("--threads", type=numbers, default=[1, 2, 3, 4, 7, 8, 16])
    parser.add_argument("--repeats", type=int, default=20)
    parser.add_argument("--frames", type=int, default=76, help="of each recording")
    parser.add_argument(
        "--recording", help="a folder or file of a recording, as `nacre reconstruct` takes it"
    )
    parser.add_argument("--only", choices=MODELS, action="append", help="by default all")
    parser.add_argument("--save", type=Path, help=argparse.SUPPRESS)
    options = parser.parse_args()
    names = options.only or [name for name in MODELS if name != "recording" or options.recording]
    if options.save:
        result = reconstruct(names[0], recording(names[0], options.frames, options.recording), 2)
        np.savez(options.save, allow_pickle=False, figures=result.figures, **result.arrays)
        return 0
    hold = [compare(name, options) for name in names]
    return 0 if all(hold) else 1


if __name__ == "__main__":
    sys.exit(main())
