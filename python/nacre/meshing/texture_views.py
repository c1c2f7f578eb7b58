"""Which images of a recording a mesh is painted from."""

from __future__ import annotations

import collections.abc
import dataclasses
import logging
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from nacre._internal import arrays
from nacre._internal.guided import guided
from nacre._internal.kinds import as_kind
from nacre._internal.value_equality import Value
from nacre.camera import Camera, camera_of
from nacre.errors import FileFormatError

if TYPE_CHECKING:
    from nacre.datasets import Sequence

_log = logging.getLogger(__name__)

_MOST_VIEWS = 40  # budget: of memory and time; more bring seams rather than detail
_READ_OF_EACH_STRETCH = 4  # budget: images that are read to find a sharp one


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class TextureView(Value):
    """
    An image that a mesh is painted from.

    Attributes
    ----------
    color : (H, W, 3) uint8
        RGB.
    camera : Camera
        That took it.
    world_from_camera : (4, 4) float64
        Where the camera was.
    depth : (H, W) float32, or None
        What it measured [m], NaN where nothing: the mesh is not painted with what stood before it.
    """

    color: npt.NDArray[np.uint8]
    camera: Camera
    world_from_camera: npt.NDArray[np.float64]
    depth: npt.NDArray[np.float32] | None = None


def check_views(name: str, views: Any) -> list[TextureView]:
    """Return views, one at least, each with an image of its camera's size."""
    if isinstance(views, TextureView) or not isinstance(views, collections.abc.Iterable):
        raise TypeError(f"{name} must be a sequence of TextureView, got {type(views).__name__}")
    checked = [_checked(f"{name}[{i}]", view) for i, view in enumerate(views)]
    if not checked:
        raise ValueError(f"{name} must have at least one view, got none")
    return checked


def _checked(name: str, view: Any) -> TextureView:
    if not isinstance(view, TextureView):
        raise TypeError(f"{name} must be a TextureView, got {type(view).__name__}")
    camera = camera_of(arrays.as_camera(f"{name}.camera", view.camera))
    pose = arrays.as_pose(f"{name}.world_from_camera", view.world_from_camera)
    color = arrays.as_array(f"{name}.color", view.color)
    shape = (camera.height, camera.width)
    if color.shape != (*shape, 3) or color.dtype != np.uint8:
        raise ValueError(f"{name}.color must be {(*shape, 3)} uint8, got {color.shape} of {color.dtype}")
    depth = None if view.depth is None else arrays.as_depth(f"{name}.depth", view.depth)
    if depth is not None and depth.shape != shape:
        raise ValueError(f"{name}.depth must have shape {shape}, got {depth.shape}")
    return TextureView(color, camera, pose, depth)


@guided("a Reconstruction has sequence and poses")
def texture_views(sequence: Sequence, poses: npt.ArrayLike, *, most: int = _MOST_VIEWS) -> list[TextureView]:
    """
    Choose the views of a recording that a mesh is to be painted from: spread over the path, and sharp.

    Parameters
    ----------
    sequence : Sequence
        A recording with colour images.
    poses : (N, 4, 4) array_like
        ``world_from_camera`` of each view; NaN where it is not known: that view is left out.
    most : int
        How many views at most.

    Returns
    -------
    list of TextureView
        In the order of the recording.

    Raises
    ------
    TypeError, ValueError
        Arguments of the wrong type or shape.
    FileFormatError
        No view has both a pose and a colour image that can be read.

    Notes
    -----
    The path, measured by how far the image moves, is cut into ``most`` stretches; of each, the image whose
    Laplacian varies most is taken.
    """
    as_kind("sequence", sequence, collections.abc.Sequence, "a nacre.Sequence")
    known = arrays.as_poses("poses", poses)
    if len(known) != len(sequence):
        raise ValueError(f"poses must have one matrix per view ({len(sequence)}), got {len(known)}")
    count = arrays.as_count("most", most, minimum=1)
    rows = np.flatnonzero(np.isfinite(known).all(axis=(1, 2)))
    chosen = []
    for stretch in _stretches(sequence, known, rows, count):
        step = -(-len(stretch) // _READ_OF_EACH_STRETCH)
        views = [view for row in stretch[::step] if (view := _read(sequence, known, int(row)))]
        if views:
            chosen.append(max(views, key=lambda view: _sharpness(view.color)))
    if not chosen:
        raise FileFormatError(sequence.path, "no view has both a pose and a colour image that can be read")
    return chosen


def _stretches(
    sequence: Sequence, poses: npt.NDArray[np.float64], rows: npt.NDArray[np.intp], count: int
) -> Iterable[npt.NDArray[np.intp]]:
    """Cut the views with a pose into as many stretches of the path, of equal length."""
    if len(rows) <= count:
        return np.split(rows, len(rows)) if len(rows) else []
    view = next((view for row in rows if (view := _read(sequence, poses, int(row)))), None)
    measured = view.depth[np.isfinite(view.depth)] if view and view.depth is not None else np.ones(1)
    distance = float(np.median(measured)) if len(measured) else 1.0
    turns = np.einsum("ij,ij->i", poses[rows[1:], :3, 2], poses[rows[:-1], :3, 2])
    steps = np.linalg.norm(np.diff(poses[rows, :3, 3], axis=0), axis=1) / distance
    path = np.concatenate([[0.0], np.cumsum(steps + np.arccos(np.clip(turns, -1, 1)))])
    cuts = np.searchsorted(path, np.linspace(0, path[-1], count + 1)[1:-1])
    return [stretch for stretch in np.split(rows, cuts) if len(stretch)]


def _read(sequence: Sequence, poses: npt.NDArray[np.float64], row: int) -> TextureView | None:
    """Return a view, or None where it has no image, or cannot be read."""
    try:
        frame = sequence[row]
    except FileFormatError as error:
        _log.warning("%s", error)
        return None
    if frame.color is None:
        return None
    return TextureView(frame.color, frame.camera, poses[row], frame.depth)


def _sharpness(color: npt.NDArray[np.uint8]) -> float:
    """Return how much the Laplacian of an image varies."""
    gray = color.astype(np.float32).mean(axis=2)
    inner = gray[1:-1, 1:-1]
    laplacian = gray[:-2, 1:-1] + gray[2:, 1:-1] + gray[1:-1, :-2] + gray[1:-1, 2:] - 4 * inner
    return float(laplacian.var()) if laplacian.size else 0.0
