"""The rows of the table."""

from __future__ import annotations

from pathlib import Path

from track.peers import ANY_CAMERA, PINHOLE
from track.recordings import ORTHOGRAPHIC, found, simulated
from track.rows import Goal, Places, Row


def bunny(places: Places) -> Path:
    """Return the bunny's mesh."""
    return places.bunny


def at_most(**limits: float) -> tuple[Goal, ...]:
    """Return bounds from above, on absolute values."""
    return tuple(Goal(name, limit, absolute=True) for name, limit in limits.items())


def at_least(**limits: float) -> tuple[Goal, ...]:
    """Return bounds from below."""
    return tuple(Goal(name, limit, at_least=True) for name, limit in limits.items())


def turntable(name: str, title: str, views: int, step: int, sigma: float, goals: tuple[Goal, ...]) -> Row:
    """Return the bunny on a turntable, seen by an orthographic camera with mixed pixels at the edges."""
    options = (*ORTHOGRAPHIC, "--views", views, "--step", step, "--noise", sigma)
    return Row(
        name,
        title,
        recording=simulated(name, bunny, *options),
        mesh=bunny,
        peers=ANY_CAMERA,
        goals=(*at_least(tracked=views), *goals),
    )


ROWS = [
    turntable(
        "bunny12",
        "Bunny, 12 views every 30 degrees, sigma 0.5 mm",
        12,
        30,
        0.0005,
        at_most(rotation=0.1, translation=0.2, rms=0.12, bias=0.02, cov=0.15) + at_least(complete=99.0),
    ),
    Row(
        "teddy",
        "tum-fr3-teddy, whole view, 200 frames",
        recording=found("tum-fr3-teddy"),
        peers=(*ANY_CAMERA, *PINHOLE),
        goals=at_most(ate=12, lost=0),
    ),
]
BY_NAME = {row.name: row for row in ROWS}
