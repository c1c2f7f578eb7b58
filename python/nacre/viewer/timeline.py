"""What a viewer tells: the frames of a run, and the model after some of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from nacre.camera import Camera
from nacre.errors import printable
from nacre.io.painting import Painting
from nacre.model import Model
from nacre.reconstruction.frame_record import FrameRecord
from nacre.reconstruction.motion import Motion, motion_of
from nacre.report.reported_frame import ReportedFrame
from nacre.report.text import count, quantity
from nacre.viewer.view import View

if TYPE_CHECKING:
    from nacre.viewer.levels import Levels

CAMERA_FRAME = "the world is the first camera's frame"
"""A comment of point files: x right, y down, z forward."""


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
    sigma : (N,) float, optional
        The expected standard deviation of each point across the surface [m]; NaN where not known.
    triangles : (T, 3) integer, optional
        Rows of the points, of a mesh; otherwise the viewer joins the points itself.
    painting : Painting, optional
        The image that is painted on the triangles.
    motion : Motion, optional
        Where the points were at each frame of the timeline, if they moved; they themselves are the canonical
        shape.
    """

    points: npt.NDArray[np.float32]
    normals: npt.NDArray[np.float32]
    spacing: float
    colors: npt.NDArray[np.uint8] | None = None
    confidence: npt.NDArray[Any] | None = None
    last_seen: npt.NDArray[Any] | None = None
    sigma: npt.NDArray[Any] | None = None
    triangles: npt.NDArray[np.int32] | None = None
    painting: Painting | None = None
    motion: Motion | None = None

    @classmethod
    def of(cls, model: Model, frame: int | None = None) -> Snapshot:
        """
        Copy the points of a model as it is now.

        Parameters
        ----------
        model : Model
            Where it deforms, its points are taken as they were at a frame.
        frame : int, optional
            Of the model; by default the newest.
        """
        points, normals = model.points, model.normals
        if model.parameters.deform and len(model.frames):
            shown = len(model.frames) - 1 if frame is None else frame
            points, normals = model.points_at(shown), model.normals_at(shown)
        return cls(
            points,
            normals,
            model.spacing,
            model.colors,
            model.confidence,
            model.last_seen,
            model.point_sigma.astype(np.float32),
        )

    def rows(self, chosen: slice | npt.NDArray[np.int64], spacing: float) -> Snapshot:
        """Return some of the points, which are so far apart, and the triangles between them."""

        def chosen_of(column: Any) -> Any:
            return None if column is None else column[chosen].copy()

        return Snapshot(
            chosen_of(self.points),
            chosen_of(self.normals),
            spacing,
            chosen_of(self.colors),
            chosen_of(self.confidence),
            chosen_of(self.last_seen),
            chosen_of(self.sigma),
            self._triangles_between(chosen),
            None if self.painting is None else self.painting.rows(chosen),
            None if self.motion is None else self.motion.of_points(chosen),
        )

    def at(self, place: int) -> Snapshot:
        """Return the points as they were at the frame of that place; what does not move, itself."""
        if self.motion is None:
            return self
        points, normals = self.motion.at(place)
        return replace(self, points=points, normals=normals, motion=None)

    def _triangles_between(self, chosen: slice | npt.NDArray[np.int64]) -> npt.NDArray[np.int32] | None:
        if self.triangles is None:
            return None
        row_of = np.full(len(self.points), -1, np.int32)
        row_of[chosen] = np.arange(len(row_of[chosen]))
        triangles = row_of[self.triangles]
        return triangles[(triangles >= 0).all(axis=1)]

    def thinned(self, max_points: int) -> Snapshot:
        """Return every second, third, ... point, ``max_points`` at most; fewer than all without triangles."""
        step = max(-(-len(self.points) // max_points), 1)
        if step == 1:
            return self
        return replace(self, triangles=None, painting=None).rows(
            slice(None, None, step), self.spacing * step**0.5
        )


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
