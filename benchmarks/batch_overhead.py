"""
What a recording of ``nacre batch`` costs beside its reconstruction: bytes, scheduler, looking, table.

Milliseconds are those of processors, of the process that holds scheduler and client.

    python benchmarks/batch_overhead.py              # 10 000 tasks on 2 workers
    python benchmarks/batch_overhead.py --tasks 1000 --recordings 4

Some simulated recordings are reconstructed; then as many tasks as wanted go through a cluster whose workers
return the result of one of them at once, and the table of all is written.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import pickle
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import nacre
from nacre._internal.cluster import cluster_client
from nacre.reconstruction.batch.index import Index
from nacre.reconstruction.batch.result import BatchResult
from nacre.reconstruction.batch.sources import find_recordings
from nacre.reconstruction.batch.task import Task, make_tasks, reconstruct_recording
from nacre.reconstruction.run_options import RunOptions

COSTS: dict[str, float] = {}


@contextmanager
def timed(name: str, number: int) -> Iterator[None]:
    """Measure what each of so many takes of this process's time on processors [ms]."""
    start = time.process_time()
    yield
    COSTS[name] = 1000 * (time.process_time() - start) / number


def return_at_once(task: Task, result: BatchResult) -> BatchResult:
    """Stand for a reconstruction that takes no time."""
    return dataclasses.replace(result, name=task.name)


def write_recordings(folder: Path, number: int) -> None:
    """Write recordings of the built-in object: twelve views of 160 x 120."""
    mesh = nacre.built_in_object()
    camera = nacre.Camera(width=160, height=120, fx=131.0, fy=131.0, cx=79.5, cy=59.5)
    poses = nacre.turntable_poses(mesh, 12, 0.1, camera=camera)
    for seed in range(number):
        depths = [mesh.simulate_depth(camera, pose, noise=0.0005, seed=seed) for pose in poses]
        nacre.write_recording(folder / f"object{seed}", camera, depths, depth_scale=20000, poses=poses)


def measure(folder: Path, num_recordings: int, num_tasks: int) -> None:
    """Fill the table of costs."""
    write_recordings(folder / "scans", num_recordings)
    with timed("find a recording", num_recordings):
        recordings = find_recordings(folder / "scans")
    out = folder / "out"
    tasks = make_tasks(recordings, RunOptions(""), nacre.ModelParameters(), out)
    with timed("reconstruct it", num_recordings):
        results = [reconstruct_recording(task) for task in tasks]
    with timed("see that it is finished", num_recordings):
        for task in tasks:
            reconstruct_recording(task)
    many = [dataclasses.replace(tasks[0], name=f"object{number}") for number in range(num_tasks)]
    COSTS["bytes to a worker"] = len(pickle.dumps(tasks[0]))
    COSTS["bytes from a worker"] = len(pickle.dumps(results[0]))
    COSTS["bytes of the thumbnail"] = (out / "thumbnails" / "object0.webp").stat().st_size
    with cluster_client(None, 2, num_tasks) as client:
        from distributed import as_completed

        with timed("scheduler and client", num_tasks):
            futures = client.map(return_at_once, many, result=results[0], pure=False)
            found = []
            for future in as_completed(futures):
                found.append(future.result())
                future.release()
    assert len({result.name for result in found}) == num_tasks
    index = Index(out, found)
    with timed("write the table once", num_tasks):
        index.write()
    COSTS["bytes of index.json"] = (out / "index.json").stat().st_size / num_tasks


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--tasks", type=int, default=10_000)
    parser.add_argument("--recordings", type=int, default=8)
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        measure(Path(folder), asked.recordings, asked.tasks)
    if asked.json:
        print(json.dumps(COSTS))
        return
    for name, cost in COSTS.items():
        unit = "bytes" if "bytes" in name else "ms"
        print(f"{name.removeprefix('bytes ') if unit == 'bytes' else name:<26} {cost:10.3f} {unit} each")


if __name__ == "__main__":
    main()
