#!/usr/bin/env python
"""
Show the model of a part of a recording single frames of the rest, and hold what it says against the truth.

For each recording, with its colours and without them: of so many frames how many are found, right (within 6 %
of the median depth and 4 degrees, since parts drift) and wrong. Frames that show nothing of the part are
among them, and most are of another place: none of them may be found.

    python benchmarks/relocalisation.py boxcan d435 sr300
"""

from __future__ import annotations

import argparse
import tempfile
from collections import Counter
from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import cases
import numpy as np

import nacre

# Where parts start, how many frames each has, and the step between the frames that are shown to it.
PARTS = {
    "boxcan": ((0, 10, 20, 28), 8, 2),
    "d435": ((0, 100, 200), 15, 15),
    "sr300": ((0, 25), 8, 4),
    "cabinet": ((0, 15, 30, 45), 10, 4),
    "robot": ((0, 24), 8, 4),
    "rpy": ((0, 50), 10, 10),
    "iphone": ((0, 120, 220), 15, 20),
    "icl": ((0, 150), 15, 20),
    "apc": ((0, 7), 5, 1),
}
FOUND = ("TRACKED", "RELOCALISED")
LARGEST_SHIFT = 0.06
"""[depth]"""
LARGEST_TURN = 4.0
"""[degrees]"""


def shown_to(case: cases.Case, start: int, count: int, step: int) -> Counter[str]:
    """Return what becomes of the frames outside of a part, each shown to the part's model alone."""
    model = nacre.Model(case.camera, num_threads=1)
    for i in range(start, start + count):
        model.add_frame(case.depths[i], color=case.colors[i])
    world = []  # of the model in that of the truths, by each registered frame; parts drift: the newest tells
    for report in model.frames:
        truth = case.truths[start + report.index]
        if report.status in FOUND and truth is not None:
            world.append(truth @ np.linalg.inv(report.world_from_camera))
    found: Counter[str] = Counter()
    with tempfile.TemporaryDirectory() as folder:
        part = Path(folder) / "part.nacre"
        model.save(part)
        for i in range(0, len(case.depths), step):
            truth = case.truths[i]
            if start <= i < start + count or truth is None:
                continue
            report = nacre.Model.load(part).add_frame(case.depths[i], color=case.colors[i])
            found["shown"] += 1
            if report.status not in FOUND:
                continue
            off = np.linalg.inv(truth) @ world[-1] @ report.world_from_camera
            depth = np.median(case.depths[i][case.depths[i] > 0])
            is_right = np.linalg.norm(off[:3, 3]) < LARGEST_SHIFT * depth
            is_right &= cases.angle_between(np.eye(3), off[:3, :3]) < LARGEST_TURN
            found["right" if is_right else "wrong"] += 1
    return found


def run(job: tuple[str, bool, int]) -> tuple[str, bool, Counter[str]]:
    """Run one part of a recording, with colours or without."""
    name, has_colors, start = job
    case = cases.make(name)
    if not has_colors:
        case.colors = [None] * len(case.depths)
    _, count, step = PARTS[name]
    return name, has_colors, shown_to(case, start, count, step)


def jobs_of(names: Iterable[str]) -> list[tuple[str, bool, int]]:
    """Return all that is to be run; with colours where there are some."""
    jobs = []
    for name in names:
        is_colored = cases.make(name, most=1).colors[0] is not None
        kinds = (True, False) if is_colored else (False,)
        jobs += [(name, has_colors, start) for has_colors in kinds for start in PARTS[name][0]]
    return jobs


def main() -> None:
    """Print a table of the recordings that are named, or of all."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("names", nargs="*", default=list(PARTS), help=f"of {', '.join(PARTS)}")
    names = parser.parse_args().names
    found: dict[tuple[str, bool], Counter[str]] = {}
    with ProcessPoolExecutor(2) as pool:
        for name, has_colors, counts in pool.map(run, jobs_of(names)):
            found.setdefault((name, has_colors), Counter()).update(counts)
    print("| recording | frames shown | found right / wrong | without colours |\n| --- | --- | --- | --- |")
    for name in names:
        with_colors, without = (found.get((name, kind), Counter()) for kind in (True, False))
        colored = f"{with_colors['right']} / {with_colors['wrong']}" if with_colors else "-"
        print(f"| {name} | {without['shown']} | {colored} | {without['right']} / {without['wrong']} |")


if __name__ == "__main__":
    main()
