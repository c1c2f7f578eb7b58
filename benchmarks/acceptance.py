#!/usr/bin/env python
"""
Measure how well the registration score tells right from wrong, on registrations of real recordings.

From models of six frames with known poses, later frames are registered near and far, from the truth, from
the last pose, from starts that are 10 and 20 degrees wrong, and frames of other places from the last pose.
Whatever matches is taken. A registration is right within 3 % of the median depth and 3 degrees, wrong beyond
twice that, and left out between, or where it leaves directions open.

For each recording: the area under the ROC curve; the share of right ones and the number of wrong ones that
reach `min_score`; and the score that 3 % of the wrong ones of all the other recordings reach, with the same
figures. Then, for each frame that has something in common with the model, the best of its starts: how many
are right and wrong by its score, and the greatest score of a wrong one of the other recordings. Last, the
probability that the best is right, a logistic curve of the score's logarithm that is fitted to the other
recordings, against how many are.

    python benchmarks/acceptance.py teddy rpy d435 robot sr300 iphone boxcan icl
"""

from __future__ import annotations

import argparse
import itertools
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import cases
import numpy as np
import numpy.typing as npt

import nacre

Array = npt.NDArray[np.float64]

SEED_FRAMES = 6
STEPS = (1, 2, 3, 5, 8, 12, 20, 30, 45)
WRONG_STARTS = (10.0, 20.0)
"""[degrees] With shifts of 3 % of the depth for each 10 degrees."""
RIGHT_SHIFT, RIGHT_TURN = 0.03, 3.0
WRONG_SHARE = 0.03
LEAST_SCORE = 1e-3
"""Lower ones are taken for this: where nothing fits, how little does."""


def turned(pose: Array, degrees: float, shift: float, rng: np.random.Generator) -> Array:
    """Return a pose turned about a random axis, and shifted."""
    x, y, z = rng.normal(size=3)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]]) / np.linalg.norm([x, y, z])
    motion = np.eye(4)
    angle = np.radians(degrees)
    motion[:3, :3] += np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
    motion[:3, 3] = shift * rng.normal(size=3)
    return pose @ motion


def starts(
    case: cases.Case, last: int, now: Array, world: Array, rng: np.random.Generator
) -> list[tuple[int, Array, bool]]:
    """Return frames, the guesses to register them from, and whether they come next."""
    depth = cases.middle_depth(case.depths)
    found = []
    for index in [last + step for step in STEPS if last + step < len(case.depths)]:
        truth = case.truths[index]
        if truth is None:
            continue
        found += [(index, world @ truth, True), (index, now, True)]
        for degrees in WRONG_STARTS:
            found.append((index, turned(world @ truth, degrees, 0.003 * degrees * depth, rng), True))
    elsewhere = rng.choice(len(case.depths), 3, replace=False)
    return found + [(int(index), now, False) for index in elsewhere if case.truths[index] is not None]


@dataclass(frozen=True)
class Registrations:
    """Of a recording: scores, which are right, and the number of the frame; -1 for one of another place."""

    scores: Array
    right: npt.NDArray[np.bool_]
    frames: npt.NDArray[np.int64]

    def best(self) -> Registrations:
        """Return the best of each frame."""
        order = np.argsort(-self.scores, kind="stable")
        _, first = np.unique(self.frames[order], return_index=True)
        rows = order[first][self.frames[order][first] >= 0]
        return Registrations(self.scores[rows], self.right[rows], self.frames[rows])


def registrations(name: str) -> Registrations:
    """Register frames of a recording to models of others."""
    case = cases.make(name)
    rng = np.random.default_rng(7)
    depth = cases.middle_depth(case.depths)
    scores, right, frames = [], [], []
    anchors = np.unique(np.linspace(0, max(0, len(case.depths) - SEED_FRAMES - 3), 10).astype(int))
    for first in anchors:
        truths = case.truths[first : first + SEED_FRAMES]
        if len(truths) < SEED_FRAMES or any(truth is None for truth in truths):
            continue
        model = nacre.Model(case.camera, num_threads=1, verify=False, relocalise=False, loop_closure=False)
        for index in range(first, first + SEED_FRAMES):
            model.add_frame(case.depths[index], color=case.colors[index], guess=case.truths[index])
        last = first + SEED_FRAMES - 1
        now = model.frames[-1].world_from_camera
        world = now @ np.linalg.inv(case.truths[last])
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "model.nacre"
            model.save(path)
            for index, guess, is_near in starts(case, last, now, world, rng):
                truth = case.truths[index]
                assert truth is not None
                report = nacre.Model.load(path).add_frame(
                    case.depths[index], color=case.colors[index], guess=guess
                )
                if report.status == "LOST" or len(report.weak_directions) > 0:
                    continue
                error = np.linalg.inv(world @ truth) @ report.world_from_camera
                turn = cases.angle_between(np.eye(3), error[:3, :3]) / RIGHT_TURN
                shift = float(np.linalg.norm(error[:3, 3])) / depth / RIGHT_SHIFT
                if not 1 < max(turn, shift) < 2:
                    scores.append(report.score)
                    right.append(max(turn, shift) <= 1)
                    frames.append(1000 * int(first) + index if is_near else -1)
    return Registrations(np.array(scores), np.array(right, bool), np.array(frames))


def area(scores: Array, right: npt.NDArray[np.bool_]) -> float:
    """Return the area under the ROC curve: how often a right one has the higher score."""
    a, b = scores[right][:, None], scores[~right][None, :]
    return float(np.mean((a > b) + 0.5 * (a == b)))


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("recording", nargs="+", help=f"of {', '.join(cases.REAL)}")
    names = parser.parse_args().recording
    found = {}
    for name in names:
        found[name] = registrations(name)
        print(f"{name}: {len(found[name].scores)} registrations", file=sys.stderr, flush=True)
    least = nacre.ModelParameters().min_score
    columns = ["recording", "right", "wrong", "area", "right accepted", "wrong", "score of the others"]
    columns += ["right accepted", "wrong"]
    print(f"| {' | '.join(columns)} |")
    print(f"|{'---|' * len(columns)}")
    for name, of in found.items():
        scores, right = of.scores, of.right
        others = [o.scores[~o.right] for other, o in found.items() if other != name or len(found) == 1]
        level = float(np.quantile(np.concatenate(others), 1 - WRONG_SHARE))
        cells = [f"{area(scores, right):.3f}"]
        for threshold in (least, level):
            cells += [
                f"{np.mean(scores[right] >= threshold):.2f}",
                str(int(np.sum(scores[~right] >= threshold))),
            ]
        cells.insert(3, f"{level:.2f}")
        print(f"| {name} | {right.sum()} | {(~right).sum()} | {' | '.join(cells)} |")
    best = {name: of.best() for name, of in found.items()}
    print_best(best)
    print_reliability(best)


def print_best(best: dict[str, Registrations]) -> None:
    """Print how often the best of a frame's starts is right and wrong, by its score."""
    least = nacre.ModelParameters().min_score
    bounds = [0.0, 0.2 * least, 0.4 * least, least, np.inf]
    heads = [f"{low:.2f} to {high:.2f}" for low, high in itertools.pairwise(bounds)]
    print(f"\n| best of the starts | {' | '.join(heads)} | greatest wrong score of the others |")
    print(f"|{'---|' * (len(heads) + 2)}")
    for name, of in best.items():
        cells = []
        for low, high in itertools.pairwise(bounds):
            inside = (of.scores >= low) & (of.scores < high)
            cells.append(f"{np.sum(of.right[inside])} / {np.sum(~of.right[inside])}")
        others = [o.scores[~o.right] for other, o in best.items() if other != name or len(best) == 1]
        greatest = max((float(wrong.max()) for wrong in others if len(wrong) > 0), default=0.0)
        print(f"| {name} | {' | '.join(cells)} | {greatest:.3f} |")


def fitted(scores: Array, right: npt.NDArray[np.bool_]) -> tuple[float, float]:
    """Return the score of even odds, and the power of it by which odds grow (maximum likelihood)."""
    rows = np.column_stack([np.ones(len(scores)), np.log(np.maximum(scores, LEAST_SCORE))])
    weights = np.zeros(2)
    for _ in range(50):
        told = 1 / (1 + np.exp(-rows @ weights))
        curvature = rows.T @ (rows * (told * (1 - told))[:, None]) + 1e-6 * np.eye(2)
        weights += np.linalg.solve(curvature, rows.T @ (right - told))
    return float(np.exp(-weights[0] / weights[1])), float(weights[1])


def print_reliability(best: dict[str, Registrations]) -> None:
    """Print the probability that is told, with the recording left out, against how many are right."""
    bounds = [0.0, 0.5, 0.8, 0.95, 0.99, 1.0]
    heads = [f"{low:g} to {high:g}" for low, high in itertools.pairwise(bounds)]
    print(f"\n| told probability | even odds at | power | {' | '.join(heads)} |")
    print(f"|{'---|' * (len(heads) + 3)}")
    told_by_others, was_right = [], []
    for name, of in best.items():
        others = [o for other, o in best.items() if other != name or len(best) == 1]
        even, power = fitted(
            np.concatenate([o.scores for o in others]), np.concatenate([o.right for o in others])
        )
        told = 1 / (1 + (even / np.maximum(of.scores, LEAST_SCORE)) ** power)
        print(f"| {name} | {even:.3f} | {power:.2f} | {' | '.join(by_told(told, of.right, bounds))} |")
        told_by_others.append(told)
        was_right.append(of.right)
    every = np.concatenate([o.scores for o in best.values()]), np.concatenate(was_right)
    even, power = fitted(*every)
    cells = by_told(np.concatenate(told_by_others), every[1], bounds)
    print(f"| all | {even:.3f} | {power:.2f} | {' | '.join(cells)} |")


def by_told(told: Array, right: npt.NDArray[np.bool_], bounds: list[float]) -> list[str]:
    """Return for each range of probabilities how many are told on average, and how many are right."""
    cells = []
    for low, high in itertools.pairwise(bounds):
        inside = (told >= low) & ((told < high) | (high == bounds[-1]))
        count = int(inside.sum())
        cells.append(f"{told[inside].sum():.1f} / {right[inside].sum()} of {count}" if count else "-")
    return cells


if __name__ == "__main__":
    main()
