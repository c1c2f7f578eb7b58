"""The points of a model at one time."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.io.painting import Painting
from nacre.model import Model
from nacre.run_data.motion import Motion


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
