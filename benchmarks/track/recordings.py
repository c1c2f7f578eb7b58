"""The recordings of the table: simulated ones are made when they are first needed."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Sequence
from pathlib import Path

from track.commands import nacre
from track.rows import Places

Make = Callable[[Places], Path]

ORTHOGRAPHIC = ("--orthographic", "--edge-mixing")
KINECT = ("--noise", "kinect", "--edge-mixing", "--distance", "0.5")


def simulated(name: str, mesh: Make, *options: str | float) -> Make:
    """Return what makes a recording of a mesh with ``nacre simulate``."""

    def make(places: Places) -> Path:
        folder = places.work / "recordings" / name
        if not (folder / "groundtruth.txt").exists():
            folder.parent.mkdir(parents=True, exist_ok=True)
            nacre("simulate", mesh(places), "-o", folder, "--quiet", *options)
        return folder

    return make


def found(name: str) -> Make:
    """Return what finds a real recording, and raises FileNotFoundError where there is none."""

    def find(places: Places) -> Path:
        folder = places.data / name
        if not folder.exists():
            raise FileNotFoundError(f"{name} is not in {places.data}")
        return folder

    return find


def without_frames(name: str, recording: Make, first: int, last: int) -> Make:
    """Return what makes a TUM recording without the depth images from the first to the last."""

    def make(places: Places) -> Path:
        source, folder = recording(places), fresh(places, name)
        shutil.copy(source / "groundtruth.txt", folder)
        (folder / "depth").symlink_to((source / "depth").resolve())
        lines = (source / "depth.txt").read_text().splitlines()
        comments = [line for line in lines if line.startswith("#")]
        images = [line for line in lines if line.strip() and not line.startswith("#")]
        kept = comments + images[:first] + images[last + 1 :]
        (folder / "depth.txt").write_text("\n".join(kept) + "\n")
        for extra in source.iterdir():
            if not (folder / extra.name).exists():
                (folder / extra.name).symlink_to(extra.resolve())
        return folder

    return make


def plain(name: str, recording: Make, pattern: str, camera: str) -> Make:
    """Return what makes a plain recording of depth images that lie together in a folder."""

    def make(places: Places) -> Path:
        source, folder = recording(places), fresh(places, name)
        (folder / "camera.json").write_text(camera)
        (folder / "depth").mkdir()
        for i, image in enumerate(sorted(source.glob(pattern))):
            (folder / "depth" / f"{i:06d}.png").symlink_to(image.resolve())
        return folder

    return make


def reordered(name: str, recording: Make, order: Sequence[str]) -> Make:
    """Return what makes a folder of range scans in another order."""

    def make(places: Places) -> Path:
        source, folder = recording(places), fresh(places, name)
        placed = (source / "bun.conf").read_text()
        for i, scan in enumerate(order):
            (folder / f"{i:02d}-{scan}.ply").symlink_to((source / f"{scan}.ply").resolve())
            placed = placed.replace(f"bmesh {scan}.ply", f"bmesh {i:02d}-{scan}.ply")
        (folder / "bun.conf").write_text(placed)
        return folder

    return make


def fresh(places: Places, name: str) -> Path:
    """Return an empty folder for a recording."""
    folder = places.work / "recordings" / name
    if folder.exists():
        shutil.rmtree(folder)
    folder.mkdir(parents=True)
    return folder
