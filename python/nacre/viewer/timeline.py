"""What a viewer tells: the frames of a run, and the model after some of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.camera import Camera
from nacre.errors import printable
from nacre.model import Model
from nacre.run_data.frame_record import FrameRecord
from nacre.run_data.motion import motion_of
from nacre.run_data.reported_frame import ReportedFrame
from nacre.run_data.text import count, quantity
from nacre.viewer.levels import Levels
from nacre.viewer.snapshot import Snapshot
from nacre.viewer.view import View

CAMERA_FRAME = "the world is the first camera's frame"
"""A comment of point files: x right, y down, z forward."""


_FIGURES: dict[str, tuple[str, Callable[[Any], str]]] = {
    "overlap": ("overlap", lambda value: quantity(value, "fraction")),
    "consistency": ("consistency", lambda value: quantity(value, "fraction")),
    "score": ("registration score", lambda value: f"{value:.2f}"),
    "rmse": ("RMS distance of matched points", lambda value: quantity(value, "m")),
    "num_inliers": ("matched points", count),
    "num_points": ("model points", count),
    "milliseconds": ("time", lambda value: quantity(value, "ms")),
}


def words(frame: ReportedFrame) -> dict[str, str]:
    """Return figures of a frame in words, by name; what is not known is left out."""
    known = {name: frame.figures.get(name) for name in _FIGURES} | {
        "milliseconds": frame.milliseconds.get("total")
    }
    return {_FIGURES[name][0]: _FIGURES[name][1](value) for name, value in known.items() if value is not None}


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
    depth_range : (float, float)
        Outside of which depth was not used [m].
    is_upright : bool
        Whether y points up and z to who looks, as in files of other programs, and not as in a camera's frame.
    is_survey : bool
        Whether z points up, as in surveys.
    max_points : int
        States but the newest keep so many points at most, so that a long run stays within memory.

    Attributes
    ----------
    frames : list of ReportedFrame
        In the order in which they came; their true poses in the world of the model.
    painted : Snapshot or None
        A mesh of the model that an image is painted on.
    is_growing : bool
        Whether more is coming: what grows is not put into an octree again and again.
    levels : Levels or None
        Of a file that memory need not hold: all points of the newest state, which has the coarse ones.
    origin : (3,) float64
        Where the origin of all positions lies in the file's coordinates, which may be large [m].
    view : View or None
        From where to look first, where the file of a model without cameras says it.
    placement : str
        Of a run that is compared with another: how it came into the other's world frame; "" where not known.
    """

    def __init__(
        self,
        title: str,
        camera: Camera | None,
        *,
        depth_of: Callable[[int], npt.NDArray[np.float32]] | None = None,
        depth_range: tuple[float, float] = (0.0, np.inf),
        is_upright: bool = False,
        is_survey: bool = False,
        max_snapshots: int = 40,
        max_points: int = 100_000,
    ) -> None:
        if max_snapshots < 2:
            raise ValueError(f"max_snapshots must be at least 2, got {max_snapshots}")
        self.title = printable(title)
        self.camera = camera
        self.depth_of = depth_of
        self.depth_range = depth_range
        self.is_upright = is_upright
        self.is_survey = is_survey
        self.frames: list[ReportedFrame] = []
        self.painted: Snapshot | None = None
        self.is_growing = False
        self.levels: Levels | None = None
        self.origin: npt.NDArray[np.float64] = np.zeros(3)
        self.view: View | None = None
        self.placement = ""
        self._snapshots: list[tuple[int, Snapshot]] = []
        self._max_snapshots = max_snapshots
        self._max_points = max_points

    @classmethod
    def of(cls, model: Model, title: str = "model") -> Timeline:
        """
        Return what a model tells: its frames, and its points after the last.

        Of a model that deforms the points move: at each frame they are where they were.
        """
        depth = model.parameters.depth
        timeline = cls(title, model.camera, depth_range=(depth.min_depth, depth.max_depth))
        reports = list(model.frames)
        for i, report in enumerate(reports):
            record = FrameRecord(i, report.timestamp, report.status, report.reason, report, None)
            timeline.add(ReportedFrame(**record.as_dict()))
        cloud = Snapshot.of(model)
        if model.parameters.deform:
            motion = motion_of(model, reports)
            cloud = replace(cloud, points=model.points, normals=model.normals, motion=motion)
        if len(model):
            timeline.set_snapshot(cloud)
        return timeline

    def add(self, frame: ReportedFrame) -> None:
        """Append a frame."""
        self.frames.append(frame)

    def set_snapshot(self, cloud: Snapshot) -> None:
        """Note the model as it is after the last frame that was added."""
        place = len(self.frames) - 1
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

    @property
    def num_points(self) -> int:
        """Of the newest state, with all levels of detail."""
        if self.levels is not None:
            return sum(self.levels.counts.values())
        return len(self._snapshots[-1][1].points) if self._snapshots else 0

    @property
    def has_points(self) -> bool:
        """Whether some state of the model has a point."""
        return any(len(cloud.points) > 0 for _, cloud in self._snapshots)
