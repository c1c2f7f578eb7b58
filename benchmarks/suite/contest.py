"""Runs all contenders of a workload in turns, and collects what they took."""

from __future__ import annotations

import json
import os
import select
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from suite.workload import Contender, Workload

PAUSE = 0.02
"""Before each turn [s], so that threads that still spin go to sleep."""
SLOW, VERY_SLOW = 3.0, 20.0
"""A first run that takes so long [s] counts as a repeat; a contender so slow repeats but twice."""
LIMIT = 300.0
"""A contender that takes longer [s] has failed."""

Turn = Callable[[Contender, bool], dict[str, Any]]
"""A turn of a contender, its first or not, and what came of it."""


class Workers:
    """One process per peer, with one number of threads, started when it is first needed."""

    def __init__(self, threads: int, environments: Mapping[str, Mapping[str, str]] | None = None) -> None:
        """``environments``: what is set for some of the processes."""
        self.threads = threads
        self.environments = environments or {}
        self._processes: dict[str, subprocess.Popen[str]] = {}

    def __enter__(self) -> Workers:
        return self

    def __exit__(self, *_: object) -> None:
        for peer in list(self._processes):
            self._stop(peer)

    def turn(
        self, workload: str, folder: str, contender: Contender, first: bool, process: str | None = None
    ) -> dict[str, Any]:
        """Let a contender take a turn, in its peer's process unless another one is named."""
        command = {"workload": workload, "data": folder, "contender": contender.name, "first": first}
        return self.ask(process or contender.peer, command)

    def ask(self, peer: str, command: dict[str, Any]) -> dict[str, Any]:
        """Send a command to the peer's process, and wait for what it says."""
        process = self._processes.get(peer) or self._start(peer)
        assert process.stdin is not None
        assert process.stdout is not None
        try:
            process.stdin.write(json.dumps(command) + "\n")
            process.stdin.flush()
            ready, _, _ = select.select([process.stdout], [], [], LIMIT)
            line = process.stdout.readline() if ready else ""
        except BrokenPipeError:
            ready, line = [process.stdout], ""
        if line:
            said: dict[str, Any] = json.loads(line)
            return said
        code = self._stop(peer)
        if not ready:
            return {"failed": f"no answer in {LIMIT:.0f} s"}
        return {"failed": f"the process ended: {signal.Signals(-code).name if code < 0 else code}"}

    def _start(self, peer: str) -> subprocess.Popen[str]:
        threads = {f"{name}_NUM_THREADS": str(self.threads) for name in ("OMP", "OPENBLAS", "MKL", "NUMEXPR")}
        self._processes[peer] = subprocess.Popen(
            [sys.executable, "-m", "suite.worker", str(self.threads)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
            cwd=Path(__file__).resolve().parents[1],
            env={**os.environ, **threads, **self.environments.get(peer, {})},
        )
        return self._processes[peer]

    def _stop(self, peer: str) -> int:
        with self._processes.pop(peer) as process:
            process.kill()
        return process.returncode


def contend(workload: Workload, threads: int, repeats: int, turn: Turn) -> list[dict[str, Any]]:
    """Run each contender once to warm up and to check it, then all of them in turns of changing order."""
    results, wanted = [], {}
    for contender in workload.contenders:
        said = turn(contender, True)
        result = {
            "workload": workload.name,
            "contender": contender.name,
            "peer": contender.peer,
            "threads": threads,
            "seconds": [],
            "stages": {},
            "errors": said.get("errors", {}),
            "memory": said.get("memory"),
            "failed": said.get("failed"),
        }
        seconds = said.get("seconds", 0.0)
        if seconds > SLOW:
            _add(result, said)
        wanted[contender.name] = min(repeats, 2) if seconds > VERY_SLOW else repeats
        results.append(result)
    pairs = list(zip(results, workload.contenders, strict=True))
    for repeat in range(repeats):
        shift = repeat % len(pairs)
        for result, contender in pairs[shift:] + pairs[:shift]:
            if result["failed"] is None and len(result["seconds"]) < wanted[contender.name]:
                time.sleep(PAUSE)
                said = turn(contender, False)
                result["failed"] = said.get("failed")
                if result["failed"] is None:
                    _add(result, said)
    return results


def _add(result: dict[str, Any], said: dict[str, Any]) -> None:
    result["seconds"].append(said["seconds"])
    for stage, seconds in said["stages"].items():
        result["stages"].setdefault(stage, []).append(seconds)


def run(
    workloads: Iterable[Workload], thread_counts: list[int], repeats: int, tell: Callable[[str], None]
) -> Iterator[tuple[Workload, list[dict[str, Any]]]]:
    """Run workloads with each number of threads, one after the other."""
    with ExitStack() as stack:
        teams = [stack.enter_context(Workers(threads)) for threads in thread_counts]
        for workload in workloads:
            start = time.perf_counter()
            results = []
            with tempfile.TemporaryDirectory(prefix="nacre-benchmark-") as folder:
                error = _save_or_say(workload, Path(folder))
                for team in teams:
                    if not workload.most_threads_only or team.threads == max(thread_counts):
                        turn: Turn = partial(team.turn, workload.name, folder)
                        if error is not None:
                            turn = partial(_fail, error)
                        results += contend(workload, team.threads, repeats, turn)
            tell(f"{workload.name}: {time.perf_counter() - start:.1f} s")
            yield workload, results


def save(workload: Workload, folder: Path) -> None:
    """Write the data of a workload for the workers to read."""
    for key, array in workload.data().items():
        np.save(folder / f"{key}.npy", array)


def _save_or_say(workload: Workload, folder: Path) -> str | None:
    try:
        save(workload, folder)
    except Exception as error:
        return f"no data: {type(error).__name__}: {error}"
    return None


def _fail(error: str, contender: Contender, first: bool) -> dict[str, Any]:
    return {"failed": error}
