"""What a row of the table is: a recording, who runs it, and what is to be reached."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

Figures = dict[str, Any]


@dataclass(frozen=True)
class Places:
    """
    Folders of a run.

    Attributes
    ----------
    data : Path
        The real recordings and meshes.
    work : Path
        Simulated recordings and what the contenders write; kept for the next run.
    """

    data: Path
    work: Path

    @property
    def bunny(self) -> Path:
        """The reference surface of the bunny."""
        return self.data / "stanford-bunny" / "reconstruction" / "bun_zipper.ply"


@dataclass(frozen=True)
class Goal:
    """
    A bound on one figure.

    Attributes
    ----------
    figure : str
        Its name in the table (see :mod:`track.figures`).
    limit : float
        In the table's unit; a figure may be as large, or as small where ``at_least``.
    at_least : bool
        The figure must not be smaller, instead of not larger.
    absolute : bool
        The sign does not count.
    """

    figure: str
    limit: float
    at_least: bool = False
    absolute: bool = False

    def is_reached(self, figures: Mapping[str, Any]) -> bool:
        """Say whether the figures reach it; a figure that is missing does not."""
        value = figures.get(self.figure)
        if value is None:
            return False
        value = abs(value) if self.absolute else value
        return bool(value >= self.limit if self.at_least else value <= self.limit)


@dataclass(frozen=True)
class Row:
    """
    One recording, or one experiment.

    Attributes
    ----------
    name, title : str
        For ``--only``; for readers.
    recording : callable
        ``recording(places)`` makes or finds the folder.
    mesh : callable, optional
        ``mesh(places)`` is the true surface, in the frame of the true poses.
    scale : float
        Metres per unit of the mesh.
    voxel : float, optional
        Grid of the peers' models [m]; by default twice a pixel.
    settings : dict of str to list of str
        What nacre is run with, by the name of the contender: options of ``nacre reconstruct``.
    peers : tuple of str
        See :mod:`track.peers`.
    goals : tuple of Goal
        Of the first contender.
    note : str
        Under the title.
    real : bool
        One of the recordings of ``--real``: how many of the claimed frames are right.
    measure : callable, optional
        ``measure(places, row)`` returns the contenders' figures by name; in place of all of the above.
    """

    name: str
    title: str
    recording: Callable[[Places], Path] | None = None
    mesh: Callable[[Places], Path] | None = None
    scale: float = 1.0
    voxel: float | None = None
    settings: Mapping[str, list[str]] = field(default_factory=lambda: {"nacre": []})
    peers: tuple[str, ...] = ()
    goals: tuple[Goal, ...] = ()
    note: str = ""
    real: bool = False
    measure: Callable[[Places, Row], dict[str, Figures]] | None = None
