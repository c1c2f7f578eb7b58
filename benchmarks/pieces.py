#!/usr/bin/env python
"""
Run pieces of real recordings: from other frames on, every n-th frame alone, and backwards.

A recording as a whole is one sample: where a frame stands on the edge of what is believed, anything may push
it over, and all that follow are lost with it. Pieces are many samples, and motions faster than hands are.

    python benchmarks/pieces.py d435 iphone --output pieces.json
"""

from __future__ import annotations

import argparse
import json
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass
from pathlib import Path

import cases

LONGEST = 40
"""Frames of a piece."""
# Where pieces start, and the steps from frame to frame; those backwards start at the end.
PIECES = {
    "teddy": ((0, 60, 120), (1, 2, 3, 5), (-1, -3, -5)),
    "rpy": ((0, 40), (1, 2, 3), (-1, -2)),
    "d435": ((0, 80, 160), (1, 3, 5, 8), (-1, -3, -5)),
    "iphone": ((0, 100, 200), (1, 3, 5, 10), (-1, -5)),
    "icl": ((0, 100, 200), (1, 3, 5), (-1, -3)),
    "cabinet": ((0, 10, 20, 30), (1,), (-1,)),
    "robot": ((0, 12, 24), (1,), (-1,)),
    "sr300": ((0,), (1, 2, 3), (-1, -2)),
    "boxcan": ((0, 5), (1, 2, 3), (-1, -2)),
    "apc": ((0, 3), (1,), (-1,)),
    "door": ((0, 100, 200), (1, 3), ()),
}


@dataclass
class Piece:
    """A piece that was run: how many of its frames have a true pose, and of those what was claimed."""

    name: str
    start: int
    step: int
    frames: int
    claimed: int
    right: int
    far_off: int
    milliseconds: float


def pieces_of(name: str) -> list[tuple[str, int, int]]:
    """Return the pieces of a recording: its name, the first frame, the step; -1 is the last frame."""
    starts, steps, backwards = PIECES[name]
    return [(name, start, step) for step in steps for start in starts] + [
        (name, -1, step) for step in backwards
    ]


def run(piece: tuple[str, int, int]) -> Piece:
    """Run one piece, with default settings on one thread."""
    name, start, step = piece
    whole = cases.make(name)
    part = slice(start, None, step)
    case = cases.Case(
        whole.name,
        whole.camera,
        whole.depths[part][:LONGEST],
        whole.colors[part][:LONGEST],
        whole.truths[part][:LONGEST],
    )
    figures, model = cases.run(case)
    known = [i for i, truth in enumerate(case.truths) if truth is not None]
    claimed = [i for i in known if model.frames[i].status in ("TRACKED", "RELOCALISED")]
    far_off = cases.count_far_off(case, model)
    return Piece(name, start, step, len(known), len(claimed), figures.right, far_off, figures.milliseconds)


def table(pieces: list[Piece]) -> str:
    """Return a table of the recordings: right / claimed / far off of the frames with a true pose, by step."""
    lines = ["| recording | every frame | every second or third | fewer | backwards | right of all [%] |"]
    lines.append("| --- | --- | --- | --- | --- | --- |")
    columns = [(1, 1), (2, 3), (4, 99), (-99, -1)]
    for name in dict.fromkeys(piece.name for piece in pieces):
        own = [piece for piece in pieces if piece.name == name]
        cells = []
        for least, most in columns:
            some = [piece for piece in own if least <= piece.step <= most]
            right, claimed = sum(p.right for p in some), sum(p.claimed for p in some)
            far, frames = sum(p.far_off for p in some), sum(p.frames for p in some)
            cells.append(f"{right} / {claimed} / {far} of {frames}" if some else "")
        share = 100 * sum(p.right for p in own) / sum(p.frames for p in own)
        lines.append(f"| {name} | {' | '.join(cells)} | {share:.0f} |")
    total = [sum(getattr(p, key) for p in pieces) for key in ("right", "claimed", "far_off", "frames")]
    lines.append("| all | | | | | {} / {} / {} of {} |".format(*total))
    return "\n".join(lines)


def main() -> None:
    """Run the pieces of the recordings that are named, or of all."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("names", nargs="*", choices=[[], *PIECES], default=[], metavar="NAME")
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--output", type=Path, help="each piece's figures, as JSON")
    arguments = parser.parse_args()
    todo = [piece for name in arguments.names or PIECES for piece in pieces_of(name)]
    with ProcessPoolExecutor(arguments.processes) as pool:
        done = list(pool.map(run, todo))
    if arguments.output:
        arguments.output.write_text(json.dumps([asdict(piece) for piece in done], indent=1) + "\n")
    print(table(done))


if __name__ == "__main__":
    main()
