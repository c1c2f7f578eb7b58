"""
Clouds larger than memory: time, memory and bytes, whatever the workers and tiles.

    python benchmarks/large_clouds.py                          # 10 million points
    python benchmarks/large_clouds.py --points 50e6 --memory 2GB --only out-of-core

Writes a terrain with buildings, then consolidates it to a twentieth and finds its normals: in memory, and out
of core by one, two and four workers and with three sizes of tiles. Each runs in a process of its own; memory
is the largest sum of the resident bytes of it and its children, a point's time is that of processors.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import math
import resource
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import psutil

import nacre
from nacre import out_of_core
from nacre.io.points import write_chunks

POINTS_PER_BLOCK = 1_000_000
SPACING = 0.1  # [m]
BLOCK_OF_HOUSES, HOUSE, WALL = 25.0, 12.0, 0.15  # [m]
NOISE = 0.02  # [m]
FRACTION = 0.05  # that consolidation leaves
RUNS = (
    ("in memory", 1, 1),
    ("out-of-core", 1, 1),
    ("out-of-core", 2, 1),
    ("out-of-core", 4, 1),
    ("out-of-core", 1, 3),
    ("out-of-core", 2, 7),
)

COLUMNS = ["what", "where", "workers", "cells a task", "cells", "time [s]", "processors [s]", "a point [us]"]
COLUMNS += ["memory [GB]", "SHA-256"]


def block_of_terrain(number: int, num_points: int) -> nacre.Cloud:
    """Return the points of one strip; random numbers count up from its number, so that any is made alone."""
    num_blocks = math.ceil(num_points / POINTS_PER_BLOCK)
    count = min(POINTS_PER_BLOCK, num_points - number * POINTS_PER_BLOCK)
    side = SPACING * math.sqrt(num_points)
    random = np.random.Generator(np.random.Philox(key=36, counter=[0, 0, 0, number]))
    x, y, up, noise = random.random((4, count))
    x, y = (number + x * count / POINTS_PER_BLOCK) * side / num_blocks, y * side
    ground = 6 * np.sin(x / 41) * np.cos(y / 53) + 0.3 * np.sin(x / 3.1) * np.sin(y / 2.7)
    inside = np.minimum(*(HOUSE / 2 - np.abs(v % BLOCK_OF_HOUSES - BLOCK_OF_HOUSES / 2) for v in (x, y)))
    height = 4 + 8 * ((np.floor(x / BLOCK_OF_HOUSES) * 7 + np.floor(y / BLOCK_OF_HOUSES) * 13) % 5) / 4
    height *= np.where(inside < WALL, up, 1.0) * (inside > 0)
    z = ground + height + NOISE * (2 * noise - 1)
    return nacre.Cloud(np.column_stack([x, y, z]).astype(np.float32))


def write_terrain(path: Path, num_points: int) -> None:
    """Write the whole terrain."""
    blocks = (block_of_terrain(i, num_points) for i in range(math.ceil(num_points / POINTS_PER_BLOCK)))
    write_chunks(path, blocks, num_points, np.zeros((2, 3)))


def run(
    task: str, where: str, workers: int, cells_per_task: int, memory: str, source: Path, output: Path
) -> int:
    """Do one of the runs, and return how many cells there were."""
    num_points = round(FRACTION * count_of(source))
    if where == "in memory":
        cloud = nacre.read_points(source)
        if task == "normals":
            nacre.write_points(output, cloud.points, normals=nacre.estimate_normals(cloud.points))
        else:
            nacre.write_points(output, nacre.consolidate(cloud.points, num_points=num_points).points)
        return 1
    options: dict[str, Any] = {"memory": memory, "workers": workers, "cells_per_task": cells_per_task}
    if task == "normals":
        return out_of_core.estimate_normals(source, output, **options).num_cells
    return out_of_core.consolidate(source, output, num_points=num_points, **options).num_cells


def count_of(source: Path) -> int:
    """Return how many points a file of this benchmark has."""
    with source.open("rb") as stream:
        return next(int(line.split()[2]) for line in stream if line.startswith(b"element vertex"))


def measured(command: list[str]) -> tuple[float, float, float, dict[str, int]]:
    """Run a program; return its seconds, those of processors, the most bytes it had, and what it printed."""
    start, before = time.perf_counter(), resource.getrusage(resource.RUSAGE_CHILDREN)
    program = subprocess.Popen(command, stdout=subprocess.PIPE)
    most = [0]
    ended = threading.Event()

    def watch() -> None:
        whole = psutil.Process(program.pid)
        while not ended.wait(0.1):
            try:
                family = [whole, *whole.children(recursive=True)]
                most[0] = max(most[0], sum(process.memory_info().rss for process in family))
            except psutil.Error:
                continue

    watcher = threading.Thread(target=watch)
    watcher.start()
    printed = program.communicate()[0]
    ended.set()
    watcher.join()
    if program.returncode:
        sys.exit(f"{command}: exit code {program.returncode}")
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    busy = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return time.perf_counter() - start, busy, most[0], json.loads(printed)


def rows_of(source: Path, num_points: int, memory: str, only: str, tasks: list[str]) -> Iterator[str]:
    """Yield a line of the table for each run."""
    for task in tasks:
        for where, workers, cells_per_task in (r for r in RUNS if only in r[0]):
            output = source.with_name("result.ply")
            arguments = [task, where, str(workers), str(cells_per_task), memory, str(source), str(output)]
            seconds, busy, most, told = measured([sys.executable, __file__, "--run", *arguments])
            figures = [workers, cells_per_task, told["num_cells"], f"{seconds:.1f}", f"{busy:.1f}"]
            figures += [f"{1e6 * busy / num_points:.2f}", f"{most / 1e9:.2f}", f"`{sha256(output)[:16]}`"]
            yield f"| {' | '.join(map(str, [task, where, *figures]))} |"


def sha256(path: Path) -> str:
    """Return the hash of a file."""
    digest = hashlib.sha256()
    with path.open("rb") as stream:
        while block := stream.read(1 << 24):
            digest.update(block)
    return digest.hexdigest()


def halo_rows(num_points: int = 1_500_000) -> Iterator[str]:
    """Yield, for growing halos, how far samples of a strip end from where they end in the whole cloud."""
    random = np.random.default_rng(0)
    xy = random.uniform([-100, -37.5], [100, 37.5], (num_points, 2))
    z = 2 * np.sin(xy[:, 0] / 7) * np.cos(xy[:, 1] / 9) + random.normal(0, 0.03, num_points)
    points = np.column_stack([xy, z])
    samples = points[random.random(num_points) < FRACTION]
    radius = nacre.consolidate(points, num_points=len(samples), iterations=0).radius
    inner = np.abs(samples[:, 0]) < 3
    for method, iterations in (("wlop", 10), ("wlop+", 10), ("cgal", 10), ("cgal", 35)):
        options: dict[str, Any] = {"radius": radius, "method": method, "iterations": iterations}
        whole = nacre.project_samples(samples, points, **options)[inner]
        for halo in (1, 2, 3, 4, 5, 6, 8, 10, 12, 20):
            near = np.abs(samples[:, 0]) < 3 + halo * radius
            around = points[np.abs(points[:, 0]) < 3 + (halo + 2) * radius]
            cut = nacre.project_samples(samples[near], around, **options)[inner[near]]
            most = np.linalg.norm(cut - whole, axis=1).max() / radius
            yield f"| {method} | {iterations} | {halo} | {most:.1e} |"


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--points", type=float, default=10e6)
    parser.add_argument("--memory", default="2GB")
    parser.add_argument("--only", default="", help="in memory, or out-of-core")
    parser.add_argument("--tasks", nargs="*", default=["consolidate", "normals"])
    parser.add_argument("--halo", action="store_true", help="how far a cut is felt, in place of all else")
    parser.add_argument("--folder", help="where the files are; some 40 bytes a point")
    parser.add_argument("--run", nargs=7, help=argparse.SUPPRESS)
    asked = parser.parse_args()
    if asked.run:
        task, where, workers, cells_per_task, memory, source, output = asked.run
        found = run(task, where, int(workers), int(cells_per_task), memory, Path(source), Path(output))
        print(json.dumps({"num_cells": found}))
        return
    if asked.halo:
        print("| method | iterations | halo [h] | largest difference [h] |\n|---|---|---|---|")
        print("\n".join(halo_rows()))
        return
    with tempfile.TemporaryDirectory(dir=asked.folder) as folder:
        source, num_points = Path(folder) / "terrain.ply", int(asked.points)
        write_terrain(source, num_points)
        print(f"| {' | '.join(COLUMNS)} |\n{'|---' * len(COLUMNS)}|")
        for row in rows_of(source, num_points, asked.memory, asked.only, asked.tasks):
            print(row, flush=True)


if __name__ == "__main__":
    main()
