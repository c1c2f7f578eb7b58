"""What a report says in words and main figures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from nacre._internal.arrays import stacked_poses
from nacre.evaluation import (
    AbsoluteTrajectoryError,
    Completeness,
    SurfaceAccuracy,
    absolute_trajectory_error,
)
from nacre.report.data import ReportData
from nacre.report.reported_frame import ReportedFrame
from nacre.report.text import count, quantity
from nacre.report.verdict import Verdict, judge

ResultType = TypeVar("ResultType")


@dataclass(frozen=True)
class Tile:
    """One main figure."""

    label: str
    value: str
    note: str = ""


@dataclass(frozen=True, eq=False)
class Summary:
    """The main figures of a reconstruction."""

    verdict: Verdict | None
    sentence: str
    tiles: tuple[Tile, ...]
    trajectory: AbsoluteTrajectoryError | None  #: given, or worked out from the poses


def find(data: ReportData, kind: type[ResultType]) -> ResultType | None:
    """Return the first evaluation result of a kind."""
    return next((result for result in data.evaluation.values() if isinstance(result, kind)), None)


def summarize(data: ReportData) -> Summary:
    """Work out what to say first."""
    trajectory = find(data, AbsoluteTrajectoryError) or _trajectory_error(data.frames)
    verdict = judge(data, trajectory)
    sentences, tiles = [], []
    if verdict is not None:
        sentences.append(verdict.why)
        num_frames, num_tracked = len(data.frames), sum(frame.is_tracked for frame in data.frames)
        part = quantity(num_tracked / num_frames, "fraction")
        tiles.append(Tile("Frames tracked", f"{count(num_tracked)} / {count(num_frames)}", part))
    matching = [f.overlap for f in data.frames if f.is_tracked and f.num_inliers and f.overlap is not None]
    if matching:
        typical = 100 * float(np.median(matching))
        sentences.append(f"Typically {typical:.0f} % of a frame matches the model")
    if data.model is not None:
        num_points = int(np.isfinite(np.asarray(data.model.points)).all(axis=1).sum())
        sentences.append(f"The model has {count(num_points)} points")
        tiles.append(Tile("Model points", count(num_points), _extent(data)))

    accuracy, covered = find(data, SurfaceAccuracy), find(data, Completeness)
    if accuracy is not None:
        rms = quantity(accuracy.rms, "m")
        sentences.append(f"It lies {rms} (RMS) from the reference surface")
        tiles.append(Tile("Distance to reference", rms, f"RMS; bias {quantity(accuracy.bias, 'm')}"))
    if covered is not None:
        middle = len(covered.tau) // 2
        part = quantity(covered.fraction[middle], "fraction")
        tiles.append(Tile("Surface covered", part, f"within {quantity(covered.tau[middle], 'm')}"))

    if trajectory is not None and trajectory.num_compared:
        rmse = quantity(trajectory.rmse, "m")
        sentences.append(f"The camera positions are off by {rmse} (RMS){_path_length(data.frames)}")
        tiles.append(
            Tile(
                "Trajectory error", rmse, f"ATE RMSE; {quantity(trajectory.rotation_rmse, 'rad')} in rotation"
            )
        )

    times = [time for frame in data.frames if (time := frame.total_milliseconds) is not None]
    if times:
        median = quantity(float(np.median(times)), "ms")
        tiles.append(
            Tile(
                "Time per frame",
                median,
                f"median; 99 % within {quantity(float(np.percentile(times, 99)), 'ms')}",
            )
        )
    return Summary(verdict, ". ".join(sentences) + "." * bool(sentences), tuple(tiles), trajectory)


def _path_length(frames: Sequence[ReportedFrame]) -> str:
    places = [np.asarray(frame.truth, dtype=np.float64)[:3, 3] for frame in frames if frame.truth is not None]
    length = float(np.linalg.norm(np.diff(places, axis=0), axis=1).sum()) if len(places) > 1 else 0.0
    return f" on a path of {quantity(length, 'm')}" if length > 0 else ""


def _trajectory_error(frames: Sequence[ReportedFrame]) -> AbsoluteTrajectoryError | None:
    if not any(frame.truth is not None for frame in frames):
        return None
    return absolute_trajectory_error(
        stacked_poses(frame.world_from_camera for frame in frames),
        stacked_poses(frame.truth for frame in frames),
        valid=[frame.is_tracked for frame in frames],
    )


def _extent(data: ReportData) -> str:
    points = np.asarray(data.model.points if data.model is not None else np.zeros((0, 3)), dtype=np.float64)
    points = points[np.isfinite(points).all(axis=1)]
    if not len(points):
        return ""
    low, high = np.percentile(points, (0.1, 99.9), axis=0)
    sides = [quantity(float(side), "m") for side in high - low]
    units = {side.split(" ")[1] for side in sides}
    if len(units) == 1:
        return " \N{MULTIPLICATION SIGN} ".join(side.split(" ")[0] for side in sides) + f" {units.pop()}"
    return " \N{MULTIPLICATION SIGN} ".join(sides)
