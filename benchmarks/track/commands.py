"""Running nacre's commands, and the peers, as programs; what they wrote is evaluated from the files."""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

NACRE = [sys.executable, "-c", "from nacre.cli import main; main()"]
LIMIT = 600.0
"""A program that takes longer [s] has failed."""


def nacre(*arguments: str | Path | float) -> str:
    """Run a command of nacre and return what it printed."""
    return program(NACRE, *arguments)[0]


def program(command: list[str], *arguments: str | Path | float) -> tuple[str, float]:
    """Run a program; return its standard output and the processor time that it took [s]."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    try:
        done = subprocess.run(
            [*command, *map(str, arguments)],
            capture_output=True,
            text=True,
            check=False,
            timeout=LIMIT,
            env={**os.environ, "NO_COLOR": "1"},
        )
    except subprocess.TimeoutExpired:
        raise RuntimeError(f"not done in {LIMIT / 60:.0f} minutes") from None
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode:
        said = (done.stderr or done.stdout).strip().splitlines() or [f"ended with {done.returncode}"]
        raise RuntimeError(said[-1][:300])
    return done.stdout, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def reconstruct(recording: Path, out: Path, *settings: str) -> float:
    """Run ``nacre reconstruct``, however few frames it tracks; return the processor time [s]."""
    return program(NACRE, "reconstruct", recording, "-o", out, "--quiet", "--min-tracked", "0", *settings)[1]


def run_peer(name: str, recording: Path, out: Path, voxel: float | None) -> float:
    """Run a peer over a recording in a process of its own; return the processor time [s]."""
    return program([sys.executable, "-m", "track.peer"], name, recording, out, voxel or 0.0)[1]


def evaluate(out: Path, *arguments: str | Path | float) -> dict[str, Any]:
    """Run ``nacre evaluate`` on what was written, and return its figures."""
    figures: dict[str, Any] = json.loads(nacre("evaluate", out, *arguments, "--json"))
    return figures


def stamp() -> str:
    """Return the date."""
    return time.strftime("%Y-%m-%d")
