#!/usr/bin/env python
"""
Compare the working tree with a commit: kernels, loops and real recordings, in turns on this machine.

Both are built, each into a folder of its own (minutes; the commit's is kept for the next time). What is
printed is how many times faster the working tree is, the median over turns with the least and the largest;
of recordings also the 99th percentile of a frame, and the frames that are right and their error, since a
faster loop that errs more is none. The answers of kernels are checked as those of ``run.py`` are.

    python benchmarks/compare.py HEAD~3
    python benchmarks/compare.py HEAD~1 --only "normals*" "loop*" --recordings teddy rpy d435
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
import venv
from collections.abc import Callable, Iterator
from fnmatch import fnmatch
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent
BEFORE, NOW = "before", "now"
NEEDED = ["numpy", "scipy", "pillow"]


def parse() -> argparse.Namespace:
    """Read the command line."""
    layout = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=layout)
    add = parser.add_argument
    add("commit", nargs="?", help="what to compare the working tree with")
    add("--only", nargs="*", metavar="NAME", help="these workloads of run.py (default: those of its --quick)")
    add("--recordings", nargs="*", metavar="NAME", default=["teddy", "rpy", "d435"], help="of cases.py")
    add("--most", type=int, help="frames of a recording (default: all)")
    add("--threads", type=int, default=min(2, len(os.sched_getaffinity(0))))
    add("--turns", type=int, default=5, help="of each (default: 5)")
    add("--data", type=Path, help="folder of real recordings, for the loop-* workloads that need it")
    add("--builds", type=Path, default=ROOT / "build" / "compare", help="folder of what is built")
    add("--built", type=json.loads, help=argparse.SUPPRESS)  # where; what follows needs the environment
    add("--run", metavar="NAME", help=argparse.SUPPRESS)  # a recording, with the nacre that can be imported
    return parser.parse_args()


def output_of(*command: str | Path, folder: Path = ROOT) -> str:
    """Run a command; what it prints is the error if it fails."""
    done = subprocess.run(command, cwd=folder, text=True, capture_output=True, check=False)
    if done.returncode:
        raise RuntimeError(f"{' '.join(map(str, command))}\n{(done.stdout + done.stderr)[-3000:]}")
    return done.stdout


def build(python: Path, source: Path, target: Path) -> None:
    """Install a source tree into a folder that PYTHONPATH can name."""
    print(f"building {target.name}", file=sys.stderr, flush=True)
    pip = (python, "-m", "pip", "--disable-pip-version-check")
    cache = f"-Cbuild-dir={target}-build"
    output_of(*pip, "install", "--no-deps", "--upgrade", "--target", target, cache, source)


def builds(python: Path, commit: str, folder: Path) -> dict[str, str]:
    """Build the commit, unless it is there, and the working tree."""
    if not python.exists():
        venv.create(python.parents[1], with_pip=True)
        output_of(python, "-m", "pip", "install", *NEEDED)
    name = output_of("git", "rev-parse", "--short=12", f"{commit}^{{commit}}").strip()
    before, now = folder / name, folder / "working-tree"
    if not before.is_dir():
        with tempfile.TemporaryDirectory() as tree:
            archive = subprocess.Popen(["git", "archive", name], cwd=ROOT, stdout=subprocess.PIPE)
            subprocess.run(["tar", "-x", "-C", tree], stdin=archive.stdout, check=True)
            if archive.wait():
                raise RuntimeError(f"git archive {name} failed")
            build(python, Path(tree), before)
    build(python, ROOT, now)
    return {BEFORE: str(before), NOW: str(now)}


def run_workload(workload: Any, workers: Any, turns: int) -> dict[str, list[dict[str, Any]]]:
    """Return what both builds took for nacre's part of a workload, turn by turn."""
    from suite.contest import save

    nacre = workload.contender("nacre")
    with tempfile.TemporaryDirectory(prefix="nacre-compare-") as folder:
        save(workload, Path(folder))

        def turn(peer: str, first: bool) -> dict[str, Any]:
            said: dict[str, Any] = workers.turn(workload.name, folder, nacre, first, process=peer)
            if said.get("failed"):
                raise RuntimeError(f"{workload.name}, {peer}: {said['failed']}")
            return said

        checked = {peer: turn(peer, True)["errors"] for peer in (BEFORE, NOW)}
        timed = in_turns(lambda peer: turn(peer, False), turns)
    return {peer: [{**said, "errors": checked[peer]} for said in timed[peer]] for peer in timed}


def in_turns(run: Callable[[str], dict[str, Any]], turns: int) -> dict[str, list[dict[str, Any]]]:
    """Let both take turns, each first as often as the other."""
    said: dict[str, list[dict[str, Any]]] = {BEFORE: [], NOW: []}
    for i in range(turns):
        for peer in (BEFORE, NOW) if i % 2 == 0 else (NOW, BEFORE):
            said[peer].append(run(peer))
    return said


def run_recording(
    name: str, paths: dict[str, str], options: argparse.Namespace
) -> dict[str, list[dict[str, Any]]]:
    """Return what both builds took for a recording, each turn in a process of its own."""
    command = [sys.executable, str(HERE / "compare.py"), "--run", name, "--threads", str(options.threads)]
    if options.most:
        command += ["--most", str(options.most)]

    def run(peer: str) -> dict[str, Any]:
        environment = {**os.environ, "PYTHONPATH": paths[peer]}
        done = subprocess.run(command, env=environment, text=True, capture_output=True, check=False)
        if done.returncode:
            raise RuntimeError(f"{name}, {peer}:\n{done.stderr[-3000:]}")
        said: dict[str, Any] = json.loads(done.stdout)
        return said

    return in_turns(run, options.turns)


def recording_figures(name: str, most: int | None, threads: int) -> dict[str, Any]:
    """Run a recording with the nacre that is imported."""
    import cases
    import numpy as np

    case = cases.make(name, most=most)
    figures, model = cases.run(case, num_threads=threads)
    times = np.array([report.milliseconds["total"] for report in model.frames])
    return {
        "seconds": float(times.mean()) / 1e3,
        "median": float(np.median(times)),
        "99 %": float(np.percentile(times, 99)),
        "claimed": figures.claimed,
        "right": figures.right,
        "ate": figures.ate,
    }


def ratio(said: dict[str, list[dict[str, Any]]], key: str) -> str:
    """Return how many times faster it is now: median, least and largest over turns."""
    ratios = [before[key] / now[key] for before, now in zip(said[BEFORE], said[NOW], strict=True)]
    return f"{statistics.median(ratios):6.2f} ({min(ratios):.2f} to {max(ratios):.2f})"


def middle(said: list[dict[str, Any]], key: str) -> float:
    """Return the median over turns."""
    return float(statistics.median(turn[key] for turn in said))


def workload_rows(options: argparse.Namespace, paths: dict[str, str]) -> Iterator[str]:
    """Run the workloads of run.py that are asked for."""
    from suite.contest import Workers
    from suite.registry import all_workloads

    places = {peer: {"PYTHONPATH": path} for peer, path in paths.items()}
    with Workers(options.threads, places) as workers:
        for workload in all_workloads().values():
            is_named = any(fnmatch(workload.name, name) for name in options.only or ())
            if not (workload.quick if options.only is None else is_named):
                continue
            said = run_workload(workload, workers, options.turns)
            before, now = (1e3 / workload.steps * middle(said[peer], "seconds") for peer in (BEFORE, NOW))
            errors = [said[peer][0]["errors"] for peer in (BEFORE, NOW)]
            same = "same errors" if errors[0] == errors[1] else f"errors {errors[0]} -> {errors[1]}"
            yield f"{workload.name:20}{ratio(said, 'seconds')}  {before:8.2f} -> {now:8.2f} ms  {same}"


def recording_rows(options: argparse.Namespace, paths: dict[str, str]) -> Iterator[str]:
    """Run the recordings that are asked for."""
    for name in options.recordings:
        said = run_recording(name, paths, options)
        before, now = ({key: middle(said[peer], key) for key in said[peer][0]} for peer in (BEFORE, NOW))

        def change(key: str, digits: int = 1, b: dict[str, float] = before, n: dict[str, float] = now) -> str:
            return f"{b[key]:.{digits}f} -> {n[key]:.{digits}f}"

        yield (
            f"{name:20}{ratio(said, 'seconds')}  median {change('median')} ms, 99 % {change('99 %')} ms;"
            f" claimed {change('claimed', 0)}, right {change('right', 0)}, ATE {change('ate', 2)} mm"
        )


def compare(options: argparse.Namespace) -> None:
    """Let the builds take turns, and print a line for each piece of work."""
    print(f"times faster than {options.commit}, {options.threads} threads, {options.turns} turns of each:")
    for rows in (workload_rows, recording_rows):
        for line in rows(options, options.built):
            print(line, flush=True)


def main() -> int:
    """Build both, and compare them in an environment that has neither."""
    options = parse()
    if options.run:
        print(json.dumps(recording_figures(options.run, options.most, options.threads)))
        return 0
    if options.commit is None:
        raise RuntimeError("compare.py: name the commit to compare with, such as HEAD")
    if options.built:
        compare(options)
        return 0
    folder = options.builds.resolve()
    python = folder / "env" / "bin" / "python"
    built = builds(python, options.commit, folder)
    environment = {**os.environ, "PYTHONPATH": built[NOW]}
    if options.data:
        environment["NACRE_BENCHMARK_DATA"] = str(options.data.resolve())
    command = [python, __file__, *sys.argv[1:], "--built", json.dumps(built)]
    return subprocess.run(command, env=environment, check=False).returncode


if __name__ == "__main__":
    try:
        sys.exit(main())
    except (RuntimeError, KeyboardInterrupt) as error:
        sys.exit(str(error))
