"""What bends, as a mesh that moves."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt

from nacre.io.animations import write_animation
from nacre.meshing.triangulation import triangulate, used_rows
from nacre.model import Model
from nacre.run_data.frame_record import FrameRecord
from nacre.run_data.motion import shown_rows

_MOST_VERTICES = 20_000_000  # of all frames together: half a GB
_TOLERANCE = 0.1  # [spacing] that a vertex may be off


def write_model_animation(
    path: Path,
    model: Model,
    frames: Sequence[FrameRecord],
    *,
    all_points: bool = False,
    comments: Sequence[str] = (),
) -> None:
    """
    Write a model that deforms as a mesh that moves.

    Parameters
    ----------
    path : Path
        A ``.glb`` file; there is none after this where no frame is tracked, or no surface to show.
    model : Model
        With ``deform=True``.
    frames : sequence of FrameRecord
        In their order. Those that are tracked are shown, of many every second, third or so.
    all_points : bool
        Whether to join all points, not those alone that are a surface.
    comments : sequence of str
        What the file says about itself.
    """
    shown = [frame for frame in frames if frame.world_from_camera is not None]
    rows, triangles = _surface(model, all_points)
    if not (shown and len(triangles)):
        path.unlink(missing_ok=True)
        return
    shown = shown[:: max(1, -(-len(shown) * len(rows) // _MOST_VERTICES))]
    # Where a lost frame was gone over again, the model has it later.
    places = [frame.report.index for frame in shown if frame.report is not None]
    colors = model.colors
    write_animation(
        path,
        np.stack([model.points_at(place)[rows] for place in places]),
        triangles,
        normals=np.stack([model.normals_at(place)[rows] for place in places]),
        colors=None if colors is None else colors[rows],
        times=_times(shown),
        tolerance=_TOLERANCE * model.spacing,
        comments=comments,
    )


def _surface(model: Model, all_points: bool) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int32]]:
    """Return the points of the canonical shape that are shown, and triangles between them."""
    surface = shown_rows(model, all_points)
    if not len(surface):
        return surface, np.zeros((0, 3), np.int32)
    rows, triangles = used_rows(triangulate(model.points[surface], model.normals[surface]))
    return surface[rows], triangles


def _times(frames: Sequence[FrameRecord]) -> npt.NDArray[np.float64] | None:
    """Return when frames were taken [s]; None where that is not known, or does not increase."""
    stamps = [frame.timestamp for frame in frames]
    if any(stamp is None for stamp in stamps):
        return None
    times = np.array(stamps, np.float64)
    return times if np.isfinite(times).all() and (np.diff(times) > 0).all() else None
