"""
The process that one peer runs in, with one number of threads.

It reads commands from its standard input and answers each with a line of JSON: ``{"workload", "contender",
"data", "first"}`` for a turn, ``{"versions_of"}`` for the versions of what is installed.
"""

from __future__ import annotations

import ctypes
import gc
import importlib.metadata
import json
import os
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

from suite import native
from suite.registry import all_workloads
from suite.workload import Arrays, Contender, Workload

TURN = 0.05
"""A turn repeats a fast run until it has lasted so long [s]; the median run counts."""
LARGE = 500_000
"""With so many items, what a library sets up but once does not count: no run comes before the first."""


def run_once(contender: Contender, arrays: Arrays, threads: int) -> tuple[float, dict[str, float], Arrays]:
    """Return the time of a run, of each of its stages [s], and the answer."""
    run = contender.make(arrays, threads)
    stages: dict[str, float] = {}
    elapsed = 0.0

    def lap(stage: str, seconds: float | None = None) -> None:
        nonlocal elapsed
        took = time.perf_counter() - start - elapsed if seconds is None else seconds
        stages[stage] = stages.get(stage, 0.0) + took
        elapsed += took

    gc.collect()
    gc.disable()
    start = time.perf_counter()
    answer = run(lap)
    end = time.perf_counter() - start
    gc.enable()
    return elapsed or end, stages, answer


def turn(
    workload: Workload, contender: Contender, arrays: Arrays, threads: int, first: bool
) -> dict[str, Any]:
    """Take one turn; the first one warms up, measures the memory and checks the answer."""
    if first:
        if workload.items < LARGE:
            run_once(contender, arrays, threads)
        give_back_memory()
        before = memory("VmRSS") if reset_peak() else None
        seconds, stages, answer = run_once(contender, arrays, threads)
        peak = memory("VmHWM") - before if before is not None else None
        errors = {name: float(value) for name, value in workload.check(arrays, answer).items()}
        return {"seconds": seconds, "stages": stages, "errors": errors, "memory": peak}
    runs: list[tuple[float, dict[str, float]]] = []
    while sum(run[0] for run in runs) < TURN and len(runs) < 25:
        runs.append(run_once(contender, arrays, threads)[:2])
    seconds, stages = sorted(runs, key=lambda run: run[0])[len(runs) // 2]
    return {"seconds": seconds, "stages": stages}


def give_back_memory() -> None:
    """Return what earlier workloads freed to the system, so that it is not taken for free."""
    gc.collect()
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None)
    if trim is not None:
        trim(0)


def reset_peak() -> bool:
    """Make the peak of memory start again from here, where the system can."""
    try:
        Path("/proc/self/clear_refs").write_text("5")
    except OSError:
        return False
    return True


def memory(field: str) -> int:
    """Return VmRSS or VmHWM of this process [bytes]."""
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith(field + ":"):
            return int(line.split()[1]) * 1024
    raise KeyError(field)


def load(folder: Path) -> dict[str, Any]:
    """Map the arrays of a folder into memory, all pages present; what is written to them stays here."""
    paths = sorted(folder.glob("*.npy"))
    arrays = {path.stem: np.asarray(np.load(path, mmap_mode="c")) for path in paths}
    for array in arrays.values():
        array.max(initial=0)
    return arrays


def versions(names: list[str]) -> dict[str, str]:
    """Return the versions of distributions and of C++ peers that are there."""
    found = {}
    for name in names:
        try:
            found[name] = importlib.metadata.version(name)
        except importlib.metadata.PackageNotFoundError:
            try:
                found[name] = native.version(name)
            except (native.AbsentError, OSError):
                continue
    return found


def answer_to(command: dict[str, Any], threads: int, loaded: dict[str, dict[str, Any]]) -> dict[str, Any]:
    """Carry out a command; keeps the data of one workload in ``loaded``."""
    if "versions_of" in command:
        return versions(command["versions_of"])
    workload = all_workloads()[command["workload"]]
    if command["data"] not in loaded:
        loaded.clear()
        loaded[command["data"]] = load(Path(command["data"]))
    arrays = loaded[command["data"]]
    return turn(workload, workload.contender(command["contender"]), arrays, threads, command["first"])


def main() -> None:
    """Answer until the input ends."""
    threads = int(sys.argv[1])
    os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[:threads])
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)  # libraries print
    loaded: dict[str, dict[str, Any]] = {}
    for line in sys.stdin:
        try:
            answer = answer_to(json.loads(line), threads, loaded)
        except Exception as error:
            answer = {"failed": f"{type(error).__name__}: {error}"}
        print(json.dumps(answer), file=answers, flush=True)


if __name__ == "__main__":
    main()
