"""Where the points of what bends were, frame by frame, in few bytes."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.errors import FileFormatError
from nacre.frame_report import FrameReport
from nacre.io.npz import read_arrays, write_arrays
from nacre.io.quantization import octahedral, quantized, unit_vectors
from nacre.meshing.surface_points import surface_rows
from nacre.model import Model
from nacre.run_data.frame_record import FrameRecord

_MOST_POSITIONS = 4_000_000  # of all shapes together: 32 MB
_FINEST = 0.01  # [spacing] of the step: what is finer takes room, and is noise
_LAYOUT: dict[str, tuple[type, int]] = {
    "moments": (np.float64, 1),
    "points": (np.uint16, 3),
    "normals": (np.uint8, 3),
    "origin": (np.float64, 1),
    "step": (np.float64, 0),
}


@dataclass(frozen=True, eq=False)
class Motion:
    """
    Where the points of what bends were at each frame of a run: some shapes, and blends of two of them.

    Attributes
    ----------
    moments : (P,) float64
        Of each frame of the run which shape it has: 3.5 is halfway from shape 3 to shape 4.
    points : (F, N, 3) uint16
        Of each shape, in steps from the origin.
    normals : (F, N, 2) uint8
        Octahedral.
    origin : (3,) float64
        [m], in the world frame.
    step : float
        [m].
    """

    moments: npt.NDArray[np.float64]
    points: npt.NDArray[np.uint16]
    normals: npt.NDArray[np.uint8]
    origin: npt.NDArray[np.float64]
    step: float

    def at(self, place: int) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.float32]]:
        """Return the points (N, 3) [m] and their unit normals at the frame of that place in the run."""
        moment = float(self.moments[place])
        low, part = int(moment), moment % 1
        high = low + (part > 0)
        steps = (1 - part) * self.points[low] + part * self.points[high]
        normals = (1 - part) * unit_vectors(self.normals[low]) + part * unit_vectors(self.normals[high])
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-9)
        return (self.origin + self.step * steps).astype(np.float32), normals.astype(np.float32)

    def of_points(self, rows: slice | npt.NDArray[np.int64]) -> Motion:
        """Return the motion of some of the points."""
        return replace(self, points=self.points[:, rows], normals=self.normals[:, rows])


def motion_of(
    model: Model,
    reports: Sequence[FrameReport | None],
    rows: slice | npt.NDArray[np.int64] = slice(None),
) -> Motion | None:
    """
    Return how a model that deforms moved.

    Parameters
    ----------
    model : Model
        With ``deform=True``.
    reports : sequence of FrameReport or None
        The model's, of each frame of the run; None for one that never came to it.
    rows : slice or (N,) int64
        Of the model's points, those that are wanted.

    Returns
    -------
    Motion or None
        The shapes of evenly chosen tracked frames, the first and the last among them: of all, unless these
        are more than four million positions. Positions are rounded to 1 / 65535 of the longest side of the
        box of all, or a hundredth of the model's spacing. None where no frame is tracked, or no point there.
    """
    shown = frames_shown(reports)
    num_points = len(model.points[rows])
    if not (shown and num_points):
        return None
    tracked = list(dict.fromkeys(shown))
    count = min(len(tracked), max(2, _MOST_POSITIONS // num_points))
    chosen = np.linspace(0, len(tracked) - 1, count).round()
    frames = [tracked[int(i)] for i in chosen]
    points = np.concatenate([model.points_at(frame)[rows] for frame in frames])
    steps, origin, step = quantized(points, _FINEST * model.spacing)
    place_of = {frame: place for place, frame in enumerate(tracked)}
    return Motion(
        np.interp([place_of[frame] for frame in shown], chosen, np.arange(count)),
        steps.reshape(count, -1, 3),
        np.stack([octahedral(model.normals_at(frame)[rows]) for frame in frames]),
        np.array(origin),
        step,
    )


def frames_shown(reports: Sequence[FrameReport | None]) -> list[int]:
    """
    Return of each frame of a run which of the model's frames has its shape; none where none is tracked.

    That is its own; of one that is LOST that of the last one tracked before it, or of the first one at all.
    """
    # Where a lost frame was gone over again, the model has it later.
    own = [report.index if report is not None and report.tracked else None for report in reports]
    last = next((index for index in own if index is not None), None)
    if last is None:
        return []
    shown = []
    for index in own:
        last = last if index is None else index
        shown.append(last)
    return shown


def shown_rows(model: Model, all_points: bool) -> npt.NDArray[np.int64]:
    """Return the rows of a model's points that files show, as :meth:`nacre.Model.cloud` does."""
    points = model.points
    if all_points or not len(points):
        return np.arange(len(points))
    return surface_rows(
        points, model.normals, model.confidence, model.last_seen, model.frames, model.parameters.region
    )


def write_model_motion(
    path: Path, model: Model, frames: Sequence[FrameRecord], *, all_points: bool = False
) -> None:
    """
    Write how the points of ``model.ply`` moved, for the viewer.

    Parameters
    ----------
    path : Path
        An ``.npz`` file, each array by its name in :class:`Motion`; there is none after this where no frame
        is tracked, or there is no point.
    model : Model
        With ``deform=True``.
    frames : sequence of FrameRecord
        In their order.
    all_points : bool
        Whether the file of the points has all, not those alone that are a surface.
    """
    motion = motion_of(model, [frame.report for frame in frames], shown_rows(model, all_points))
    if motion is None:
        path.unlink(missing_ok=True)
        return
    columns: dict[str, npt.NDArray[Any]] = {name: np.asarray(value) for name, value in vars(motion).items()}
    write_arrays(path, columns, compressed=True)


def read_motion(path: str | os.PathLike[str]) -> Motion:
    """Read what :func:`write_model_motion` wrote; FileFormatError where it is damaged."""
    found = read_arrays(path)
    for name, (dtype, ndim) in _LAYOUT.items():
        if name not in found or found[name].dtype != dtype or found[name].ndim != ndim:
            raise FileFormatError(path, f"{name} must be {np.dtype(dtype)} of {ndim} dimensions")
    count, num_points = found["points"].shape[:2]
    expected = {"points": (count, num_points, 3), "normals": (count, num_points, 2), "origin": (3,)}
    for name, shape in expected.items():
        if found[name].shape != shape:
            raise FileFormatError(path, f"{name} must have shape {shape}, got {found[name].shape}")
    moments = found["moments"]
    if not (np.isfinite(found["origin"]).all() and 0 < found["step"] < np.inf):
        raise FileFormatError(path, "origin and step must be finite, and the step positive")
    if not ((moments >= 0) & (moments <= count - 1)).all():
        raise FileFormatError(path, f"moments must be from 0 to {count - 1}")
    return Motion(moments, found["points"], found["normals"], found["origin"], float(found["step"]))
