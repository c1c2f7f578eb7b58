"""The recordings of the table: simulated ones are made when they are first needed."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from track.commands import nacre
from track.rows import Places

ORTHOGRAPHIC = ("--orthographic", "--edge-mixing")
KINECT = ("--noise", "kinect", "--edge-mixing", "--distance", "0.5")


def simulated(name: str, mesh: Callable[[Places], Path], *options: str | float) -> Callable[[Places], Path]:
    """Return what makes a recording of a mesh with ``nacre simulate``."""

    def make(places: Places) -> Path:
        folder = places.work / "recordings" / name
        if not (folder / "groundtruth.txt").exists():
            folder.parent.mkdir(parents=True, exist_ok=True)
            nacre("simulate", mesh(places), "-o", folder, "--quiet", *options)
        return folder

    return make


def found(name: str) -> Callable[[Places], Path]:
    """Return what finds a real recording, and raises FileNotFoundError where there is none."""

    def find(places: Places) -> Path:
        folder = places.data / name
        if not folder.exists():
            raise FileNotFoundError(f"{name} is not in {places.data}")
        return folder

    return find
