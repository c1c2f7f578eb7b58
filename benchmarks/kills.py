"""
Kill ``nacre reconstruct`` at random moments, resume it, and compare what comes out with an undisturbed run.

    python benchmarks/kills.py --kills 300
    python benchmarks/kills.py --kills 60 --along-wall  # points leave memory, and come back

A small recording is simulated (with colours, frames that see nothing and frames that are only found at the
end), and run once undisturbed. Then runs are begun, killed with SIGKILL after a random time, resumed, killed
again and so on until they finish. After each kill every file must be whole, and the journal must hold every
frame but the one in flight; at the end model.ply and trajectory.txt must have the same bytes, and report.json
the same figures but for times.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import random
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

import nacre
from nacre.datasets import open_sequence, write_recording
from nacre.model import Model
from nacre.reconstruction import Reconstruction
from nacre.reconstruction.journal import read_journal

NACRE = "from nacre.cli import main; main()"
PLAIN = "import nacre.report; nacre.report.render_page = lambda data: '<html></html>'; " + NACRE
CAMERA = nacre.Camera(128, 96, 105.0, 105.0, 63.5, 47.5)
CADENCES = ((), ("--checkpoint-every", "1"), ("--checkpoint-every", "4"), ("--checkpoint-every", "0"))


def simulate(folder: Path, views: int) -> None:
    """Write a recording of an object on a turntable."""
    mesh = nacre.built_in_object()
    poses = nacre.turntable_poses(mesh, 36, np.radians(10))
    order = [*range(views - 4), 18, 19, *range(views - 4, views - 1)]  # the other side comes too early
    depth = [mesh.simulate_depth(CAMERA, poses[i], noise=0.0003, seed=i) for i in order]
    depth[5] = np.full_like(depth[5], np.nan)
    colors = [np.repeat((np.nan_to_num(d) * 200).astype(np.uint8)[..., None], 3, axis=2) for d in depth]
    write_recording(
        folder, CAMERA, depth, depth_scale=20000, colors=colors, poses=[poses[i] for i in order],
        timestamps=[0.1 * i for i in range(len(order))],
    )  # fmt: skip


def simulate_wall(folder: Path, views: int) -> None:
    """Write a recording of a camera that goes along a wall in relief, and back."""
    step, size = 0.25, 0.02  # [m] of the camera, of a square of the wall
    x, y = np.mgrid[-1 : views * step / 2 + 1 : size, -0.8:0.8:size]
    waves = np.random.default_rng(3).uniform([-9, -9, 0], [9, 9, 2 * np.pi], (12, 3))
    z = 1 + 0.05 * np.sin(np.tensordot(waves, [x, y, np.ones_like(x)], axes=1)).sum(axis=0)
    index = np.arange(x.size).reshape(x.shape)
    corner, right, below, opposite = index[:-1, :-1], index[:-1, 1:], index[1:, :-1], index[1:, 1:]
    triangles = [
        np.stack(half, axis=-1).reshape(-1, 3) for half in ([corner, right, below], [below, right, opposite])
    ]
    mesh = nacre.Mesh(np.stack([x, y, z], axis=-1).reshape(-1, 3), np.concatenate(triangles))
    poses = np.tile(np.eye(4), (views, 1, 1))
    poses[:, 0, 3] = step * np.minimum(np.arange(views), views - np.arange(views))
    depth = [mesh.simulate_depth(CAMERA, pose, noise=0.0005, seed=i) for i, pose in enumerate(poses)]
    write_recording(folder, CAMERA, depth, depth_scale=20000, poses=list(poses))


def start(log: Path, program: str, *arguments: str | Path) -> subprocess.Popen[bytes]:
    """Start a command; what it logs goes to a file."""
    words = [sys.executable, "-c", program, *map(str, arguments), "-v", "-v"]
    with log.open("wb") as stream:
        return subprocess.Popen(words, stdout=stream, stderr=stream)


def digest(path: Path) -> str:
    """Return the SHA-256 of a file."""
    return hashlib.sha256(path.read_bytes()).hexdigest()


def without_times(figures: Any) -> Any:
    """Return a report's figures but for those that are times."""
    if isinstance(figures, dict):
        return {name: without_times(value) for name, value in figures.items() if name != "milliseconds"}
    return [without_times(value) for value in figures] if isinstance(figures, list) else figures


def results(out: Path) -> tuple[str, str, Any]:
    """Return the digests of model and trajectory, and the figures."""
    report = without_times(json.loads((out / "report.json").read_text()))
    return digest(out / "model.ply"), digest(out / "trajectory.txt"), report


def check_whole(out: Path, recording: Path) -> int:
    """Raise unless every file that is there is whole; return how many frames the checkpoint has."""
    for path in out.rglob("*"):
        if path.suffix == ".ply":
            nacre.read_points(path)
        elif path.name == "trajectory.txt":
            nacre.read_trajectory(path)
        elif path.suffix == ".json":
            json.loads(path.read_text())
        elif path.suffix == ".html":
            assert path.read_text().rstrip().endswith("</html>"), path
    checkpoint = out / "unfinished" / "checkpoint"
    if not checkpoint.exists():
        return 0
    points = checkpoint.with_name("points")
    Reconstruction.load(checkpoint, open_sequence(recording), points_folder=points)
    return int(Model._loaded(checkpoint, points)[1]["num_journaled"])


def num_logged(log: Path) -> int:
    """Return how many frames a process said that it had done."""
    return len(re.findall(r"^debug: frame \d+: ", log.read_text(), re.MULTILINE))


def main() -> None:
    """Do it."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--kills", type=int, default=300)
    parser.add_argument("--views", type=int, help="default 24, along a wall 60")
    parser.add_argument("--along-wall", action="store_true", help="a recording of which points leave memory")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument(
        "--plain-page", action="store_true", help="report.html without its pictures: much faster"
    )
    arguments = parser.parse_args()
    program = PLAIN if arguments.plain_page else NACRE
    chance = random.Random(arguments.seed)
    options: tuple[str, ...]
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        recording, log = folder / "recording", folder / "log.txt"
        if arguments.along_wall:
            simulate_wall(recording, arguments.views or 60)
            options = ("--set", "max_points=8000")
        else:
            simulate(recording, arguments.views or 24)
            options = ()
        begin = time.monotonic()
        process = start(log, program, "reconstruct", recording, "-o", folder / "undisturbed", *options)
        while process.poll() is None and not (folder / "undisturbed" / "model.ply").exists():
            time.sleep(0.01)
        frames_took = time.monotonic() - begin
        assert process.wait() == 0, log.read_text()
        duration = time.monotonic() - begin
        expected = results(folder / "undisturbed")
        statuses = [frame["status"] for frame in expected[2]["frames"]]
        told = ", ".join(f"{statuses.count(name)} {name}" for name in sorted(set(statuses)))
        print(
            f"undisturbed: {duration:.1f} s, {frames_took:.1f} s of them before the results; {told}",
            flush=True,
        )
        num_kills = num_runs = num_redone = num_in_results = 0
        while num_kills < arguments.kills:
            out = folder / f"out{num_runs}"
            cadence = CADENCES[num_runs % len(CADENCES)]
            command: tuple[str | Path, ...] = ("reconstruct", recording, "-o", out, *options, *cadence)
            num_before = num_saved = 0
            while True:
                process = start(log, program, *command)
                most = 1.1 * (
                    duration if chance.random() < 0.2 else frames_took
                )  # the page takes most of the time
                try:
                    process.wait(chance.uniform(0.0, most) if num_kills < arguments.kills else None)
                except subprocess.TimeoutExpired:
                    process.kill()
                    process.wait()
                if process.returncode != -9:
                    assert process.returncode == 0, log.read_text()
                    break
                num_kills += 1
                before = num_saved
                num_saved = check_whole(out, recording)
                entries, _ = read_journal(out / "unfinished" / "journal.txt")
                if (out / "unfinished" / "run.json").exists():
                    assert len(entries) >= num_before, "frames were lost"
                    assert len(entries) >= before + num_logged(log) - 1, (
                        "more than the frame in flight was lost"
                    )
                    num_before = len(entries)
                    num_redone += len(entries) - num_saved
                    command = ("reconstruct", "--resume", out, *cadence)
                elif (out / "report.json").exists():
                    break  # killed after the end
                else:
                    num_before = num_saved = 0
                num_in_results += (out / "model.ply").exists()
            assert results(out) == expected, "the results differ"
            left = [path.name for path in out.rglob("*") if path.name.endswith(".tmp")]
            assert not left, left
            num_runs += 1
            print(f"{num_kills} kills, {num_runs} runs finished, all with the same bytes", flush=True)
        print(
            f"{num_kills} kills ({num_in_results} of them with results there), {num_runs} runs: "
            f"no frame lost but those in flight, {num_redone / num_kills:.1f} frames a kill done again, "
            f"every file whole, model {expected[0][:16]} and trajectory {expected[1][:16]} the same in all"
        )


if __name__ == "__main__":
    os.environ.setdefault("OMP_NUM_THREADS", "2")
    main()
