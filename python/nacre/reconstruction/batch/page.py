"""The page of many reconstructions: a table with a row for each, and links to their reports."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from nacre.errors import printable
from nacre.report.summary import Tile
from nacre.report.templating import render
from nacre.run_data.text import count, duration
from nacre.system import __version__

if TYPE_CHECKING:
    from nacre.reconstruction.batch.result import BatchResult

_MAX_ROWS = 2000  # a browser shows as many at once


def render_batch(title: str, results: Sequence[BatchResult], seconds: float) -> str:
    """
    Return a batch as HTML text.

    Parameters
    ----------
    title : str
        What to call it.
    results : sequence of BatchResult
        One for each recording. Of very many those that failed are shown, and the first of the others.
    seconds : float
        How long it has taken up to now.

    Raises
    ------
    ImportError
        When jinja2 is missing, with the command that installs it.
    """
    shown = list(results)
    if len(shown) > _MAX_ROWS:
        shown = sorted(shown, key=lambda result: result.has_results and not result.message)[:_MAX_ROWS]
    page = render(
        "batch.html",
        title=title,
        tiles=_tiles(results, seconds),
        results=shown,
        num_hidden=len(results) - len(shown),
        has_errors=any(result.trajectory_error is not None for result in shown),
        version=__version__,
    )
    return printable(page)


def _tiles(results: Sequence[BatchResult], seconds: float) -> list[Tile]:
    finished = [result for result in results if result.has_results]
    failed = sum(result.outcome == "failed" for result in results)
    waiting = len(results) - len(finished) - failed
    good = sum(result.level == "ok" for result in finished)
    before = sum(result.outcome == "finished before" for result in finished)
    frames = sum(result.num_frames for result in finished)
    tracked = sum(result.num_tracked for result in finished)
    tiles = [
        Tile(
            "Reconstructed",
            f"{count(len(finished))} / {count(len(results))}",
            f"{before} before" * bool(before),
        ),
        Tile("Good", count(good), "nothing contradicts them"),
        Tile("Failed", count(failed)),
        Tile("Frames tracked", f"{count(tracked)} / {count(frames)}"),
        Tile("Time", duration(seconds)),
    ]
    if waiting:
        tiles.insert(3, Tile("Not done yet", count(waiting)))
    return tiles
