"""The section of the page about the real recordings: contenders over all, and recordings by contenders."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

from track.commands import LIMIT
from track.figures import BY_NAME as FIGURES
from track.page import number, table
from track.table import ROWS

TITLE = "Real recordings of many cameras, everybody untuned"
NOTE = f"""Made by `python benchmarks/tracking.py --real`. nacre has its default settings, and so have the
loops of peers, with a grid of twice a pixel. A frame is claimed where a pose is given for it (by nacre:
tracked or relocalised); right within 2 % of the median depth and 3 degrees of the truth, after the rigid
motion that makes most of them right; else wrong; far off by more than a tenth of the depth or 10 degrees.
ATE and RPE (from one frame to the next) are root mean squares over claimed frames: small, too, for who
claims only what is easy. Bold is the best among those who have nine tenths of the most right frames of a
recording, or more. Who needs more than {LIMIT:.0f} s for a recording is cut off. Times with ~ are of a
machine that did other things, too: their order of magnitude counts.

The true poses of the iPhone are its own odometry's, those of the D435 in the hand a tracker's that is fixed
beside it: good to centimetres over all. The living room is rendered. A flat door leaves three
directions open: from its depth alone nobody knows them. Images of tum-fr1-rpy are 20 ms older than their
poses. By nacre's poses depth images agree better than by the true ones, in wrong frames, too
([](limits.md#how-true-the-true-poses-are)).
"""
GROUPS = {
    "Frames right / claimed / far off": ("right", "claimed", "far"),
    "ATE RMSE [mm]": ("ate",),
    "RPE [mm / degrees]": ("rpe", "rpe_rotation"),
    "Time of a frame, median [ms], and of the processor for all frames [s]": ("milliseconds", "processor"),
}
"""The tables of the section of real recordings."""
TIMES = ("milliseconds", "processor")


def with_section(whole: str, results: Mapping[str, Any], old: str) -> str:
    """Return a page with our section after the summary; where there are no results, that of the old page."""

    def split(text: str, *, into_ours: bool) -> list[str]:
        parts = re.split(r"(?m)^(?=## )", text)
        return [part for part in parts if part.startswith(f"## {TITLE}\n") == into_ours]

    parts = split(whole, into_ours=False)
    return "".join([*parts[:2], section(results) or "".join(split(old, into_ours=True)), *parts[2:]])


def section(results: Mapping[str, Any]) -> str:
    """Return the section; nothing where there are no results."""
    done = {row.title: results[row.name]["contenders"] for row in ROWS if row.real and row.name in results}
    frames = {title: round(next(iter(found.values())).get("frames", 0)) for title, found in done.items()}
    shown = {f"{title}, {frames[title]} frames": found for title, found in done.items()}
    names = list(dict.fromkeys(name for contenders in shown.values() for name in contenders))
    if not names:
        return ""
    counts = [FIGURES[name] for name in ("claimed", "right", "wrong", "far")]
    rows = [
        [name, *(str(sum(found.get(name, {}).get(f.name, 0) for found in shown.values())) for f in counts)]
        for name in names
    ]
    heads = [f"{len(shown)} recordings, {sum(frames.values())} frames", *(figure.head for figure in counts)]
    parts = [f"## {TITLE}\n\n{NOTE}", table(heads, rows)]
    for head, figures in GROUPS.items():
        rows = [[title, *compared(contenders, names, figures)] for title, contenders in shown.items()]
        parts.append(f"{head}:\n\n{table(['', *names], rows)}")
    return "\n".join([*parts, ""])


def compared(contenders: Mapping[str, Any], names: list[str], figures: tuple[str, ...]) -> list[str]:
    """Return some figures of each contender; bold: the best first one, of those with enough right frames."""
    enough = 0.9 * max(found.get("right", 0) for found in contenders.values())
    sign = -1 if figures[0] == "right" else 1
    values = {
        name: sign * round(found[figures[0]], FIGURES[figures[0]].digits)
        for name, found in contenders.items()
        if found.get("right", -1) >= enough and figures[0] in found
    }
    cells = []
    for name in names:
        found = contenders.get(name, {})
        cell = " / ".join(number(found.get(figure), FIGURES[figure].digits) for figure in figures)
        if found.get("busy") and figures[0] in TIMES:
            cell = f"~{cell}"
        if "failed" in found:
            cell = found["failed"] if figures[0] == "right" else "-"
        best = name in values and values[name] == min(values.values())
        cells.append(f"**{cell}**" if best else cell)
    return cells
