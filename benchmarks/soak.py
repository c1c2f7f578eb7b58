"""
Ten thousand frames: growth of memory and of frame times, and the drift of a camera that stands still.

    python benchmarks/soak.py                              # 10 000 frames of each scene
    python benchmarks/soak.py --scene static --frames 500

Prints a line for each scene and ends with 1 where a limit is missed. Memory at the end is compared to that
after a tenth of the frames, a thousand at most.

Frame times are processor time on one thread; the same work takes up to a fifth more or less of it within an
hour, as other programs run beside. So the model of the beginning is saved, and at the end it and the last one
are given the same frames in turn, a tenth of the frames again.
"""

from __future__ import annotations

import argparse
import gc
import json
import math
import os
import sys
import tempfile
import time
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from simulated import SCENES, Scene

import nacre

LIMITS = {"memory_growth": 0.05, "p99_ratio": 1.1, "drift_mm": 1.0, "drift_degrees": 0.05}


@dataclass
class Outcome:
    """What a run measured; growth and ratios are of the end to the beginning, milliseconds of the end."""

    scene: str
    frames: int
    width: int
    tracked: int
    loops: int
    points: int
    cap: int
    frames_above_cap: int
    memory_mb: float
    memory_growth: float
    bytes_per_frame: float
    p99_ms: float
    p99_ratio: float
    median_ms: float
    median_ratio: float
    drift_mm: float
    drift_degrees: float
    error_mm: float
    error_degrees: float

    def missed(self, left_out: list[str]) -> list[str]:
        """Name the limits that do not hold; only a camera that stands still can drift."""
        names = [name for name in LIMITS if name not in left_out]
        names = [name for name in names if self.scene == "static" or not name.startswith("drift")]
        found = [
            f"{name} {getattr(self, name):.4g} > {LIMITS[name]}"
            for name in names
            if not getattr(self, name) <= LIMITS[name]
        ]
        found += [f"{self.frames_above_cap} frames above the cap"] * (self.frames_above_cap > 0)
        if self.scene != "object" and self.tracked < self.frames:
            found.append(f"{self.frames - self.tracked} frames not tracked")
        return found


def memory() -> int:
    """Return the resident memory of this process [bytes]; linux."""
    gc.collect()
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def motion(pose: np.ndarray) -> tuple[float, float]:
    """Return how far a pose is from none: [mm], [degrees]."""
    sine = np.linalg.norm(pose[:3, :3] - pose[:3, :3].T) / math.sqrt(8)
    angle = math.atan2(float(sine), (np.trace(pose[:3, :3]) - 1) / 2)
    return 1000 * float(np.linalg.norm(pose[:3, 3])), math.degrees(angle)


def timed(models: list[nacre.Model], scene: Scene, frames: range) -> np.ndarray:
    """Give frames to each of some models, and return the processor times [ms], a row per frame."""
    milliseconds = np.zeros((len(frames), len(models)))
    for row, index in enumerate(frames):
        depth, color = scene.depth(index), scene.color(index)
        order = list(range(len(models)))
        for which in order if row % 2 == 0 else order[::-1]:  # the first finds the images in no cache
            before = time.process_time()
            models[which].add_frame(depth, color)
            milliseconds[row, which] = 1000 * (time.process_time() - before)
    return milliseconds


def soak(name: str, frames: int, width: int, cap: int, sigma: float) -> Outcome:
    """Run one scene."""
    scene = Scene(name, width, sigma=sigma)
    model = nacre.Model(scene.camera, max_points=cap, num_threads=1, region={"object": name == "object"})
    part = min(1000, frames // 10)
    first = part + (frames - part) % scene.views  # from where it sees what it sees after the end
    if not 0 < part <= first < frames:
        raise SystemExit(f"--frames: {frames} are too few for two parts that show the same")
    errors = np.full((frames, 2), np.nan)
    tracked = above = loops = begin = 0
    with tempfile.TemporaryDirectory() as folder:
        early = Path(folder) / "early.nacre"
        for index in range(frames):
            report = model.add_frame(scene.depth(index), scene.color(index))
            tracked += report.tracked
            loops += report.loop_frame is not None
            above += report.num_points > cap
            if report.tracked:
                errors[index] = motion(report.world_from_camera @ np.linalg.inv(scene.truth(index)))
            if index + 1 == part:
                begin = memory()
            if index + 1 == first:
                model.save(early)
            if (index + 1) % 1000 == 0:
                print(
                    f"  {name}: {index + 1} frames, {memory() / 1e6:.1f} MB, {report}",
                    file=sys.stderr,
                    flush=True,
                )
        end = memory()
        points = len(model)
        milliseconds = timed([nacre.Model.load(early), model], scene, range(frames, frames + part))
    p99, median = np.percentile(milliseconds, 99, axis=0), np.median(milliseconds, axis=0)
    drift = np.nanmax(errors, axis=0)
    return Outcome(
        scene=name,
        frames=frames,
        width=width,
        tracked=tracked,
        loops=loops,
        points=points,
        cap=cap,
        frames_above_cap=above,
        memory_mb=end / 1e6,
        memory_growth=(end - begin) / begin,
        bytes_per_frame=(end - begin) / (frames - part),
        p99_ms=float(p99[1]),
        p99_ratio=float(p99[1] / p99[0]),
        median_ms=float(median[1]),
        median_ratio=float(median[1] / median[0]),
        drift_mm=float(drift[0]),
        drift_degrees=float(drift[1]),
        error_mm=float(np.nanmedian(errors[:, 0])),
        error_degrees=float(np.nanmedian(errors[:, 1])),
    )


def main(words: list[str] | None = None) -> int:
    """Run the scenes that are asked for, and say what was missed."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--scene", choices=SCENES, action="append", help="by default each of them")
    parser.add_argument("--frames", type=int, default=10_000)
    parser.add_argument(
        "--width", type=int, default=160, help="of the images [pixels]; the height is 3/4 of it"
    )
    parser.add_argument("--max-points", type=int, default=4000, help="the model's cap")
    parser.add_argument("--sigma", type=float, default=0.002, help="of the depth [m]")
    parser.add_argument(
        "--not", dest="left_out", choices=LIMITS, action="append", default=[], help="do not demand it"
    )
    parser.add_argument("--json", type=Path, help="write the figures there")
    options = parser.parse_args(words)
    outcomes = []
    for name in options.scene or SCENES:
        outcome = soak(name, options.frames, options.width, options.max_points, options.sigma)
        missed = outcome.missed(options.left_out)
        outcomes.append({**asdict(outcome), "missed": missed})
        print(*(f"{key}={value:.4g}" if isinstance(value, float) else f"{key}={value}"
                for key, value in asdict(outcome).items()))  # fmt: skip
        print(f"{name}: " + ("; ".join(missed) or "every limit holds"), flush=True)
    if options.json:
        options.json.write_text(json.dumps(outcomes, indent=1) + "\n")
    return int(any(outcome["missed"] for outcome in outcomes))


if __name__ == "__main__":
    sys.exit(main())
