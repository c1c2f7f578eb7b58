"""The timeline of what ``nacre reconstruct`` wrote."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np

from nacre.errors import FileFormatError
from nacre.io.points import read_points
from nacre.report.saved_run import SavedRun
from nacre.viewer.timeline import Snapshot, Timeline


def read_timeline(folder: str | os.PathLike[str]) -> Timeline:
    """
    Read what a reconstruction wrote.

    Depth images are shown where the recording is still in its place.

    Parameters
    ----------
    folder : path-like
        ``OUT``; it holds ``model.ply`` and ``report.json``.

    Raises
    ------
    FileFormatError, OSError
        When a file is damaged or missing.
    """
    out = SavedRun(Path(folder))
    timeline = Timeline(
        out.report.get("title") or Path(folder).name, out.camera, depth_of=_recorded_depth(out)
    )
    placed = out.truth_from_world
    world_from_truth = None if placed is None else np.asarray(np.linalg.inv(placed), np.float64)
    for frame in out.frames:
        if frame.truth is not None:
            frame.figures["truth"] = None if world_from_truth is None else world_from_truth @ frame.truth
        timeline.add(frame)
    model = read_points(Path(folder) / "model.ply")
    normals = model.normals
    if normals is None:
        raise FileFormatError(Path(folder) / "model.ply", "a model of nacre reconstruct has normals")
    attributes = model.attributes
    cloud = Snapshot(
        np.asarray(model.points, np.float32),
        np.asarray(normals, np.float32),
        max(float(out.report.get("spacing") or 0.001), 1e-6),
        model.colors,
        attributes.get("confidence"),
        attributes.get("last_seen"),
    )
    is_finite = np.isfinite(cloud.points).all(axis=1) & np.isfinite(cloud.normals).all(axis=1)
    timeline.set_snapshot(cloud if is_finite.all() else cloud.rows(np.flatnonzero(is_finite), cloud.spacing))
    return timeline


def _recorded_depth(out: SavedRun) -> Any:
    """Return what reads a depth image of the recording, or None where the recording is gone."""
    recording = out.report.get("recording") or {}
    path = recording.get("path")
    from nacre.datasets import open_sequence

    try:
        if path is None or not Path(path).exists():
            return None
        sequence = open_sequence(path, format=recording.get("format"))
    except (FileFormatError, ValueError, OSError):
        return None
    return lambda index: sequence[index].depth
