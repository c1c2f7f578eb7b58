"""What a viewer tells: the frames of a run, and the model after some of them."""

from __future__ import annotations

import bisect
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre import Camera
from nacre.errors import printable
from nacre.model import Model
from nacre.reconstruction.frame_record import FrameRecord
from nacre.report.text import count, quantity


@dataclass(frozen=True, eq=False)
class Snapshot:
    """
    The points of a model.

    Attributes
    ----------
    points, normals : (N, 3) float32
        [m], in the world frame; unit vectors.
    spacing : float
        Between neighbouring points [m].
    colors : (N, 3) uint8, optional
        Red, green, blue.
    confidence : (N,) float32, optional
        Frontal observations that each point stands for.
    last_seen : (N,) integer, optional
        Of the registered frames, the last that observed the point.
    """

    points: npt.NDArray[np.float32]
    normals: npt.NDArray[np.float32]
    spacing: float
    colors: npt.NDArray[np.uint8] | None = None
    confidence: npt.NDArray[Any] | None = None
    last_seen: npt.NDArray[Any] | None = None

    @classmethod
    def of(cls, model: Model) -> Snapshot:
        """Copy the points of a model as it is now."""
        return cls(
            model.points, model.normals, model.spacing, model.colors, model.confidence, model.last_seen
        )

    def thinned(self, max_points: int) -> Snapshot:
        """Return the same with every second, third, ... point, ``max_points`` at most."""
        step = max(-(-len(self.points) // max_points), 1)
        if step == 1:
            return self
        rest = (
            None if rows is None else rows[::step].copy()
            for rows in (self.colors, self.confidence, self.last_seen)
        )
        points, normals = self.points[::step].copy(), self.normals[::step].copy()
        return Snapshot(points, normals, self.spacing * step**0.5, *rest)


@dataclass(frozen=True, eq=False)
class Moment:
    """
    One frame of a run.

    Attributes
    ----------
    index : int
        Its place in the recording.
    status, reason : str
        See :class:`nacre.FrameReport`.
    world_from_camera, truth : (4, 4) float64 or None
        None where it is not known; the truth in the world of the model.
    figures : mapping of str to str
        In words, by name.
    """

    index: int
    status: str
    reason: str = ""
    world_from_camera: npt.NDArray[np.float64] | None = None
    truth: npt.NDArray[np.float64] | None = None
    figures: Mapping[str, str] = field(default_factory=dict)

    @classmethod
    def of(cls, record: FrameRecord) -> Moment:
        """Return what is to be told of a frame of a reconstruction."""
        report = record.report
        figures = {}
        if report is not None:
            figures = words(
                overlap=report.overlap,
                consistency=report.consistency,
                evidence=report.evidence,
                rmse=report.rmse,
                num_inliers=report.num_inliers,
                num_points=report.num_points,
                milliseconds=report.milliseconds["total"],
            )
        return cls(
            record.index, record.status, record.reason, record.world_from_camera, record.truth, figures
        )


_FIGURES: dict[str, tuple[str, Callable[[Any], str]]] = {
    "overlap": ("overlap", lambda value: quantity(value, "fraction")),
    "consistency": ("consistency", lambda value: quantity(value, "fraction")),
    "evidence": ("evidence", lambda value: f"{value:.2f}"),
    "rmse": ("residual", lambda value: quantity(value, "m")),
    "num_inliers": ("pairs", count),
    "num_points": ("model points", count),
    "milliseconds": ("time", lambda value: quantity(value, "ms")),
}


def words(**figures: float | None) -> dict[str, str]:
    """Return figures of a frame in words; what is not known or not finite is left out."""
    return {
        _FIGURES[name][0]: _FIGURES[name][1](value)
        for name, value in figures.items()
        if value is not None and np.isfinite(value)
    }


class Timeline:
    """
    What a viewer tells.

    Parameters
    ----------
    title : str
        Of the recording.
    camera : Camera or None
        Of every frame.
    depth_of : callable, optional
        ``depth_of(index)`` reads the depth image of a frame again: (H, W) float32 [m].
    max_snapshots : int
        So many states of the model are kept, evenly spread over the frames.
    max_points : int
        States but the newest keep so many points at most, so that a long run stays within memory.

    Attributes
    ----------
    moments : list of Moment
        The frames, in the order in which they came.
    """

    def __init__(
        self,
        title: str,
        camera: Camera | None,
        *,
        depth_of: Callable[[int], npt.NDArray[np.float32]] | None = None,
        max_snapshots: int = 40,
        max_points: int = 100_000,
    ) -> None:
        if max_snapshots < 2:
            raise ValueError(f"max_snapshots must be at least 2, got {max_snapshots}")
        self.title = printable(title)
        self.camera = camera
        self.depth_of = depth_of
        self.moments: list[Moment] = []
        self._snapshots: list[tuple[int, Snapshot]] = []
        self._max_snapshots = max_snapshots
        self._max_points = max_points

    def add(self, moment: Moment) -> None:
        """Append a frame."""
        self.moments.append(moment)

    def clear(self) -> None:
        """Forget the frames and the model."""
        self.moments.clear()
        self._snapshots.clear()

    def set_snapshot(self, cloud: Snapshot) -> None:
        """Note the model as it is after the last frame that was added."""
        place = len(self.moments) - 1
        if self._snapshots and self._snapshots[-1][0] == place:
            self._snapshots.pop()
        if len(self._snapshots) >= self._max_snapshots:
            self._snapshots = self._snapshots[::2]
        if self._snapshots:
            before, last = self._snapshots[-1]
            self._snapshots[-1] = (before, last.thinned(self._max_points))
        self._snapshots.append((place, cloud))

    @property
    def snapshots(self) -> list[tuple[int, Snapshot]]:
        """States of the model, each with the place of the newest frame in it."""
        return list(self._snapshots)

    def snapshot_at(self, place: int) -> Snapshot | None:
        """Return the model as it was after a frame, or the last state known before; the first one else."""
        if not self._snapshots:
            return None
        found = bisect.bisect_right(self._snapshots, place, key=lambda state: state[0])
        return self._snapshots[max(found - 1, 0)][1]

    def pose_at(self, place: int) -> npt.NDArray[np.float64] | None:
        """Return the pose of a frame; for a lost one the last one known before."""
        for moment in reversed(self.moments[: place + 1]):
            if moment.world_from_camera is not None:
                return moment.world_from_camera
        return None
