"""The model as the viewer shows it first."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from nacre.camera import Camera
from nacre.rendering import View
from nacre.report.data import ModelCloud
from nacre.run_data.reported_frame import ReportedFrame
from nacre.viewer import disks, saved_timeline, views
from nacre.viewer.snapshot import Snapshot
from nacre.viewer.timeline import Timeline
from nacre.viewer.view import View as ViewersView

_FIELD_OF_VIEW = 0.7  # of the viewer's page [rad]


def first_view(
    model: ModelCloud, frames: Sequence[ReportedFrame], camera: Camera | None, size: tuple[int, int]
) -> View:
    """
    Return the view with which the viewer opens.

    Parameters
    ----------
    model : ModelCloud
        One point at least; all of them finite.
    frames : sequence of ReportedFrame
        Of the run; none: it is seen from the side to which it faces.
    camera : Camera or None
        Of every frame.
    size : (int, int)
        Width and height of the picture [pixels].
    """
    view = viewers_view(model, frames, camera)
    half = math.tan(_FIELD_OF_VIEW / 2)  # of the height, as a part of the distance
    distance = view.radius / math.sin(math.atan(half * min(size[0] / size[1], 1)))
    forward = -view.direction
    right = np.cross(forward, view.up)
    right /= np.linalg.norm(right)
    axes = np.stack([right, np.cross(forward, right), forward])
    return View(axes, view.target, 2 * half * distance / size[1], size, distance)


def viewers_view(model: ModelCloud, frames: Sequence[ReportedFrame], camera: Camera | None) -> ViewersView:
    """Return that view as the viewer has it; :func:`first_view` has the parameters."""
    timeline = Timeline("", camera)
    for frame in frames:
        timeline.add(frame)
    return views.first_view(_snapshot(model), timeline, len(frames) - 1)


def disk_radii(model: ModelCloud) -> npt.NDArray[np.float32]:
    """Return how large the viewer draws each point [m], so that the surface of what is far closes, too."""
    return disks.disk_radii(_snapshot(model))


def _snapshot(model: ModelCloud) -> Snapshot:
    points = np.asarray(model.points, np.float32)
    normals = np.full(points.shape, np.nan) if model.normals is None else np.asarray(model.normals)
    known = np.isfinite(normals).all(axis=1, keepdims=True)
    normals = np.where(known, normals, (0, 0, -1)).astype(np.float32)
    spacing = saved_timeline.usual_spacing(points)
    return Snapshot(points, normals, spacing, model.colors, model.confidence)
