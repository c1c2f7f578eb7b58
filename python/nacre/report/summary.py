"""What a report says in words and main figures."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from nacre._internal.arrays import stacked_poses
from nacre.evaluation import (
    AbsoluteTrajectoryError,
    Completeness,
    SurfaceAccuracy,
    absolute_trajectory_error,
)
from nacre.evaluation.trajectory import MIN_ALIGNED
from nacre.report.data import ReportData
from nacre.report.deformation import DeformationFigures, deformation_figures
from nacre.report.verdict import Verdict, judge
from nacre.run_data.reported_frame import ReportedFrame
from nacre.run_data.text import count, length_unit, quantity

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
    tiles: tuple[Tile, ...]
    trajectory: AbsoluteTrajectoryError | None  #: given, or worked out from the poses
    deformation: DeformationFigures | None  #: of a model that deforms


def find(data: ReportData, kind: type[ResultType]) -> ResultType | None:
    """Return the first evaluation result of a kind."""
    return next((result for result in data.evaluation.values() if isinstance(result, kind)), None)


def summarize(data: ReportData) -> Summary:
    """Work out what to say first."""
    trajectory = find(data, AbsoluteTrajectoryError) or _trajectory_error(data.frames)
    deformation = deformation_figures(data.frames)
    is_bent = deformation is not None and deformation.is_bent
    tiles = [
        *_frame_tiles(data.frames),
        *_deformation_tiles(deformation),
        *_model_tiles(data, is_bent=is_bent),
        *_evaluation_tiles(data),
    ]
    if trajectory is not None:
        tiles.append(_trajectory_tile(trajectory, is_bent=is_bent))
    times = [time for frame in data.frames if (time := frame.total_milliseconds) is not None]
    if times:
        slow = quantity(float(np.percentile(times, 99)), "ms")
        tiles.append(
            Tile("Time per frame", quantity(float(np.median(times)), "ms"), f"median; 99 % within {slow}")
        )
    return Summary(judge(data, trajectory), tuple(tiles), trajectory, deformation)


def _frame_tiles(frames: Sequence[ReportedFrame]) -> Iterator[Tile]:
    if not frames:
        return
    num_tracked = sum(frame.is_tracked for frame in frames)
    found = sum(frame.status == "RELOCALISED" for frame in frames)
    more = f"; {count(found)} relocalised after a loss" * bool(found)
    part = quantity(num_tracked / len(frames), "fraction")
    yield Tile("Frames tracked", f"{count(num_tracked)} / {count(len(frames))}", part + more)
    matching = [f.overlap for f in frames if f.is_tracked and f.num_inliers and f.overlap is not None]
    if matching:
        yield Tile(
            "Inlier ratio", quantity(float(np.median(matching)), "fraction"), "median of tracked frames"
        )


def _deformation_tiles(bent: DeformationFigures | None) -> Iterator[Tile]:
    if bent is None:
        return
    frames = f"{count(bent.num_bent)} frame{'s' * (bent.num_bent != 1)}"
    note = f"part of the points in view, median; the shape was bent at {frames}"
    yield Tile("Explained", quantity(bent.explained, "fraction"), note)


def _model_tiles(data: ReportData, *, is_bent: bool) -> Iterator[Tile]:
    if data.model is None:
        return
    num_points = int(np.isfinite(np.asarray(data.model.points)).all(axis=1).sum())
    yield Tile("Model points", count(num_points), _extent(data))
    spread = None if data.model.sigma is None else sigma_statistics(data.model.sigma)
    if spread is not None:
        note = f"median, {noise_alone(is_bent=is_bent)}; for 95 % at most {quantity(spread['p95'], 'm')}"
        yield Tile("Point standard deviation", quantity(spread["median"], "m"), note)


def _evaluation_tiles(data: ReportData) -> Iterator[Tile]:
    accuracy, covered = find(data, SurfaceAccuracy), find(data, Completeness)
    if accuracy is not None:
        note = f"RMS distance to the reference; bias {quantity(accuracy.bias, 'm')}"
        yield Tile("Accuracy", quantity(accuracy.rms, "m"), note)
    if covered is not None:
        middle = len(covered.tau) // 2
        part = quantity(covered.fraction[middle], "fraction")
        yield Tile("Completeness", part, f"within {quantity(covered.tau[middle], 'm')}")


def noise_alone(*, is_bent: bool) -> str:
    """Return what a point's standard deviation counts, in words."""
    return "expected from noise alone" + ", without the error of the warp" * is_bent


def _trajectory_tile(error: AbsoluteTrajectoryError, *, is_bent: bool) -> Tile:
    rmse, of = told_trajectory_error(error)
    more = f"; {quantity(error.rotation_rmse, 'rad')} in rotation" * (error.num_compared >= MIN_ALIGNED)
    more += "; of a camera relative to the shape" * is_bent
    return Tile("Trajectory error (ATE)", rmse, of + more)


def told_trajectory_error(error: AbsoluteTrajectoryError) -> tuple[str, str]:
    """Return the RMSE in words, and of how many frames it is: of fewer than three it says nothing."""
    if error.num_compared < MIN_ALIGNED:
        compared = f"{count(error.num_compared)} of {count(error.num_frames)} frames"
        return "not known", f"{compared} have a pose and a true one, at least {MIN_ALIGNED} must"
    rmse = quantity(error.rmse, "m")
    return rmse, f"RMSE over {count(error.num_compared)} of {count(error.num_frames)} frames"


def sigma_statistics(sigma: npt.ArrayLike) -> dict[str, float] | None:
    """Return median, 95th percentile and root mean square of standard deviations; None: none is known."""
    known = np.asarray(sigma, dtype=np.float64)
    known = known[np.isfinite(known)]
    if not len(known):
        return None
    median, p95 = np.percentile(known, (50, 95))
    return {"median": float(median), "p95": float(p95), "rms": float(np.sqrt(np.mean(known**2)))}


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
    unit, factor = length_unit(float(max(high - low)))
    sides = " \N{MULTIPLICATION SIGN} ".join(quantity(float(factor * side), "number") for side in high - low)
    return f"{sides} {unit}"
