"""The table as Markdown."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from headings import link_to

from track.figures import BY_NAME as FIGURES
from track.figures import FIGURES as ALL
from track.rows import Goal, Row
from track.table import ROWS

PICTURES = {
    "model-bunny12.webp": "The bunny from 12 noisy views (Stanford 3D Scanning Repository)",
    "model-spot12.webp": "Spot from 12 noisy views (Keenan Crane)",
    "model-teddy.webp": "tum-fr3-teddy (TUM RGB-D benchmark, CC BY 4.0)",
}
"""What may be shown; the others stay in the folder of the results."""


def page(results: Mapping[str, Any], pictures: list[str]) -> str:
    """Return the whole page."""
    parts = [INTRODUCTION, summary(results)]
    parts += [f"![{PICTURES[name]}](images/{name})\n\n*{PICTURES[name]}.*\n" for name in pictures]
    parts += [section(row, results[row.name]) for row in ROWS if row.name in results and not row.real]
    return "\n".join(parts)


INTRODUCTION = """# Tracking and models, measured

Made by `python benchmarks/tracking.py`: every recording is simulated (`nacre simulate`) or real, is run
through `nacre reconstruct` with default settings, and what that wrote is measured by `nacre evaluate`.
Peers run on the same frames, all of them, in an environment of their own, and what they wrote is measured
by the same command. [`benchmarks/README.md`](../benchmarks/README.md) says how.

Errors of poses are those throughout, the greatest of all frames, with the first frame in its place; the
shift is that of the object's middle. A model's RMS and bias (positive: outside) are to the true surface;
what is covered is the part of the surface that the cameras saw within 3 mm of a model point. A dash
is what was not measured.
"""


def summary(results: Mapping[str, Any]) -> str:
    """Return one line a row: what was to be reached, and what was."""
    rows = []
    for row in ROWS:
        if row.name not in results or not row.goals:
            continue
        figures = ours(results[row.name])
        states = [
            f"{'**' if not goal.is_reached(figures) else ''}{words(goal, figures)}"
            f"{'**' if not goal.is_reached(figures) else ''}"
            for goal in row.goals
        ]
        rows.append([link_to(row.title), "; ".join(states)])
    text = "Each figure with its goal in brackets; what misses its goal is bold."
    return f"## In short\n\n{text}\n\n{table(['on', 'reached'], rows)}"


def section(row: Row, result: Mapping[str, Any]) -> str:
    """Return the table of a row."""
    contenders = result["contenders"]
    shown = [figure for figure in ALL if any(figure.name in figures for figures in contenders.values())]
    zero = {"relocalised", "weak", "lost"}
    shown = [f for f in shown if f.name not in zero or any(c.get(f.name) for c in contenders.values())]
    heads = ["", *(figure.head for figure in shown)]
    rows = []
    for name, figures in contenders.items():
        if "failed" in figures:
            rows.append([name, figures["failed"], *[""] * (len(shown) - 1)])
        else:
            rows.append([name, *(number(figures.get(figure.name), figure.digits) for figure in shown)])
    note = f"{row.note}\n\n" if row.note else ""
    return f"## {row.title}\n\n{note}{table(heads, rows)}"


def missed(results: Mapping[str, Any], rows: list[Row]) -> list[str]:
    """Return a line for every goal that is not reached."""
    return [
        f"{row.name} misses {words(goal, ours(results[row.name]))}"
        for row in rows
        if row.name in results
        for goal in row.goals
        if not goal.is_reached(ours(results[row.name]))
    ]


def ours(result: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return the figures of the first contender."""
    figures: Mapping[str, Any] = next(iter(result["contenders"].values()))
    return figures


def words(goal: Goal, figures: Mapping[str, Any]) -> str:
    """Return a figure and its goal in words."""
    figure = FIGURES[goal.figure]
    sign = "\N{GREATER-THAN OR EQUAL TO}" if goal.at_least else "\N{LESS-THAN OR EQUAL TO}"
    return f"{figure.head} {number(figures.get(goal.figure), figure.digits)} ({sign} {goal.limit:g})"


def number(value: Any, digits: int) -> str:
    """Return a number of the table; a dash where there is none."""
    return "-" if value is None else f"{value:.{digits}f}"


def table(heads: list[str], rows: list[list[str]]) -> str:
    """Return a Markdown table."""
    lines = [heads, ["---"] * len(heads), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines) + "\n"
