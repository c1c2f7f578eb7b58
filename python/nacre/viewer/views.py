"""Which frames had which points in view, and from where to look at them first."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.camera import Camera
from nacre.viewer.snapshot import Snapshot
from nacre.viewer.timeline import Timeline
from nacre.viewer.view import View

Array = npt.NDArray[np.float64]

_MAX_VIEWS = 60
_MAX_POINTS = 20_000


def posed_places(timeline: Timeline, place: int) -> list[int]:
    """Return the places, 60 at most and evenly spread, of frames up to one whose pose is known."""
    places = [i for i, m in enumerate(timeline.frames[: place + 1]) if m.world_from_camera is not None]
    chosen = np.linspace(0, len(places) - 1, min(len(places), _MAX_VIEWS)).round().astype(int)
    return [places[i] for i in chosen]


def sees(
    camera: Camera, pose: Array, points: npt.NDArray[np.float32], normals: npt.NDArray[np.float32]
) -> npt.NDArray[np.bool_]:
    """
    Return which points (N, 3) are in a camera's image and face it; what hides them does not count.

    Parameters
    ----------
    camera, pose : Camera, (4, 4) array
        The pose is ``world_from_camera``.
    points, normals : (N, 3) float32
        In the world frame [m]; unit vectors.
    """
    local = (points - pose[:3, 3]) @ pose[:3, :3]
    rays = local if camera.model == "pinhole" else np.array([[0.0, 0, 1]])
    facing = (normals @ pose[:3, :3] * rays).sum(axis=1) < 0
    return np.asarray(facing & _in_image(camera, local))


def _in_image(
    camera: Camera, local: npt.NDArray[np.floating[Any]], margin: float = 0.0
) -> npt.NDArray[np.bool_]:
    """Say which points of a camera's frame are in its image, but for a margin, of its width and height."""
    middle = 0.5 * np.array([camera.width - 1, camera.height - 1])
    half = (0.5 - margin) * np.array([camera.width, camera.height])
    with np.errstate(invalid="ignore"):
        inside = (np.abs(camera.project(local) - middle) <= half).all(axis=1)
    return np.asarray(inside & (local[:, 2] > 0))


def could_be_measured(
    timeline: Timeline, place: int, points: npt.NDArray[np.float32], margin: float
) -> npt.NDArray[np.bool_]:
    """
    Return which points (N, 3) a frame up to one had well within its image and range of depth, hidden or not.

    Without a camera these are all.

    Parameters
    ----------
    timeline, place : Timeline, int
        Of its frames up to that place 60 at most count.
    points : (N, 3) float32
        In the world frame [m].
    margin : float
        What does not count at each edge of the image: a part of its width and height; and at either end of
        the range: a part of that depth.
    """
    places = posed_places(timeline, place)
    if timeline.camera is None or not places:
        return np.ones(len(points), bool)
    nearest, farthest = (1 + margin) * timeline.depth_range[0], (1 - margin) * timeline.depth_range[1]
    seen = np.zeros(len(points), bool)
    for pose in _poses(timeline, places):
        local = (points - pose[:3, 3]) @ pose[:3, :3]
        depth = np.linalg.norm(local, axis=1) if timeline.camera.depth == "radial" else local[:, 2]
        seen |= _in_image(timeline.camera, local, margin) & (nearest <= depth) & (depth <= farthest)
    return seen


def first_seen(cloud: Snapshot, timeline: Timeline, place: int) -> npt.NDArray[np.uint32] | None:
    """
    Return the place of the first frame that had each point in view; None where cameras are not known.

    It is worked out from 60 frames at most, and points that none of them faced come with the last one.
    """
    places = posed_places(timeline, place)
    if timeline.camera is None or len(places) < 2:
        return None
    first = np.full(len(cloud.points), places[-1], np.uint32)
    unseen = np.arange(len(cloud.points))
    for i, pose in zip(places, _poses(timeline, places), strict=True):
        shape = cloud.at(i)
        seen = sees(timeline.camera, pose, shape.points[unseen], shape.normals[unseen])
        first[unseen[seen]] = i
        unseen = unseen[~seen]
    return first


def first_view(cloud: Snapshot, timeline: Timeline, place: int) -> View:
    """
    Return a view of the main thing: from where most frames saw it, upright as the cameras were.

    Main is what most frames saw and many observations confirm; specks and far walls have no say. Without
    cameras it is seen as its file says, or else from the side to which it faces; a survey from the south, at
    45 degrees. What no camera had in view as a whole, and is low and wide, is seen from above.
    """
    if timeline.view is not None and _shows(timeline.view, cloud.points):
        return timeline.view
    few = cloud.thinned(_MAX_POINTS)
    places = posed_places(timeline, place)
    if timeline.is_survey:
        return _view(few.points, np.ones(len(few.points), bool), _OBLIQUE, _SKY)
    if timeline.camera is None or not places:
        sign = 1 if timeline.is_upright else -1
        core = _main_part(few, np.ones(len(few.points)))
        toward = _in_front(_mean_normal(cloud), sign * _FORWARD, sign * _DOWN)
        return _not_a_sliver(_view(few.points, core, toward, sign * _DOWN), few.points, core)
    poses = _poses(timeline, places)
    shapes = [few.at(i) for i in places]
    views = zip(poses, shapes, strict=True)
    seen = np.array([sees(timeline.camera, pose, shape.points, shape.normals) for pose, shape in views])
    core = _main_part(few, seen.sum(axis=0))
    best = poses[np.argmax(seen[:, core].sum(axis=1))]
    points = few.points
    if few.motion is not None:  # all of the way
        points, core = np.concatenate([shape.points for shape in shapes]), np.tile(core, len(shapes))
    target = np.median(points[core], axis=0)
    toward = best[:3, 3] - target if timeline.camera.model == "pinhole" else -best[:3, 2]
    view = _view(points, core, toward, -poses[:, :3, 1].mean(axis=0))
    had_in_view = _in_image(timeline.camera, (points - best[:3, 3]) @ best[:3, :3]).mean()
    return view if had_in_view > _WHOLE else _not_a_sliver(view, points, core)


def _shows(view: View, points: npt.NDArray[np.float32]) -> bool:
    """Say whether a point is in view: else a file was moved, and what it says is of where it was."""
    return bool((np.linalg.norm(points - view.target.astype(np.float32), axis=1) <= view.radius).any())


_DOWN, _FORWARD = np.array([0.0, 1, 0]), np.array([0.0, 0, 1])
_SKY, _OBLIQUE = np.array([0.0, 0, 1]), np.array([0.0, -1, 1])  # of surveys
_CLOSED = 0.05  # of the mean normal: a surface of a shorter one faces nowhere
_RAISED, _STEEP, _STEEPEST = np.radians([15, 30, 60])
_WHOLE = 0.5  # of the points
_LOW, _FULLER = 0.4, 1.5  # of a picture's height by its width; by which that must grow
_ROWS_AT_ONCE = 1 << 18  # for the sake of memory


def _mean_normal(cloud: Snapshot) -> Array:
    """Return the mean of a surface's unit normals, by area where it has triangles; 0 where it is closed."""
    total, area = np.zeros(3), 0.0
    for start in range(0, len(cloud.normals if cloud.triangles is None else cloud.triangles), _ROWS_AT_ONCE):
        rows = slice(start, start + _ROWS_AT_ONCE)
        if cloud.triangles is None:
            normals = cloud.normals[rows].astype(np.float64)
        else:
            a, b, c = cloud.points[cloud.triangles[rows]].astype(np.float64).transpose(1, 0, 2)
            normals = np.cross(b - a, c - a)
        total += normals.sum(axis=0)
        area += float(np.linalg.norm(normals, axis=1).sum())
    return total / area if area > 0 else total


def _in_front(normal: Array, toward: Array, up: Array) -> Array:
    """
    Return the direction from which to look at a surface of a mean normal.

    It is ``toward`` where the surface faces there, or nowhere; else the one to which it faces, raised
    a little; from high above where it lies on the ground, and from below where it hangs over who looks.
    """
    length, rise = float(np.linalg.norm(normal)), float(normal @ up)
    if length < _CLOSED or normal @ toward > np.cos(_RAISED) * length:
        return toward
    ahead = normal - rise * up
    ahead = ahead / np.linalg.norm(ahead) if np.linalg.norm(ahead) >= _CLOSED else toward
    elevation = np.arcsin(np.clip(rise, -1, 1))
    elevation = np.clip(elevation, _RAISED if elevation > -_STEEP else -_STEEPEST, _STEEPEST)
    return np.asarray(np.cos(elevation) * ahead + np.sin(elevation) * up)


def _main_part(cloud: Snapshot, num_views: npt.NDArray[np.integer] | Array) -> npt.NDArray[np.bool_]:
    """Return which points belong to the main thing."""
    often = num_views >= np.quantile(num_views, 0.6)
    if cloud.confidence is None:
        return often
    known: npt.NDArray[np.bool_] = cloud.confidence >= np.quantile(cloud.confidence[often], 0.4)
    return often & known


def _view(points: npt.NDArray[np.float32], core: npt.NDArray[np.bool_], toward: Array, up: Array) -> View:
    """Return a view of the core, with some of what is around it, which is in the middle of the picture."""
    middle = np.median(points[core], axis=0).astype(np.float64)
    distances = np.linalg.norm(points - middle, axis=1)
    radius = min(np.quantile(distances, 0.99), 2.1 * np.median(distances[core]))
    direction = _unit(toward, -_FORWARD)
    upward = _unit(up, -_DOWN)
    if abs(upward @ direction) > 0.98:
        upward = _unit(np.cross(direction, (1.0, 0, 0)), -_DOWN)
    right = _unit(np.cross(upward, direction), _DOWN)
    across = np.stack([right, np.cross(direction, right)])
    shown = (points[distances <= radius] - middle) @ across.T
    target = middle + np.quantile(shown, (0.02, 0.98), axis=0).mean(axis=0) @ across
    return View(target, direction, upward, max(float(radius), 1e-6))


def _not_a_sliver(view: View, points: npt.NDArray[np.float32], core: npt.NDArray[np.bool_]) -> View:
    """Return a view of low and wide points, as of a flat, from 45 degrees above, where that shows more."""
    level = view.direction - (view.direction @ view.up) * view.up
    above = _view(points, core, _unit(level, -_FORWARD) + view.up, view.up)
    low = _height_by_width(view, points)
    return above if low < _LOW and _height_by_width(above, points) > _FULLER * low else view


def _height_by_width(view: View, points: npt.NDArray[np.float32]) -> float:
    """Return how high the points of a view are in the picture, by how wide."""
    right = np.cross(view.up, view.direction)
    shown = points[np.linalg.norm(points - view.target, axis=1) <= view.radius] - view.target
    across = np.stack([_unit(right, _DOWN), np.cross(view.direction, _unit(right, _DOWN))])
    width, height = np.ptp(np.quantile(shown @ across.T, (0.02, 0.98), axis=0), axis=0)
    return float(height / max(width, 1e-9))


def _unit(vector: Array, otherwise: Array) -> Array:
    length = float(np.linalg.norm(vector))
    return vector / length if length > 1e-9 else otherwise


def _poses(timeline: Timeline, places: list[int]) -> Array:
    return np.array([timeline.frames[i].world_from_camera for i in places], np.float64)
