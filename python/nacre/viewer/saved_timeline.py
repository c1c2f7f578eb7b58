"""The timeline of what ``nacre reconstruct`` wrote, or of the points of a file."""

from __future__ import annotations

import os
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre._internal.guided import guided
from nacre._internal.warned import warn
from nacre.errors import FileFormatError
from nacre.io.cloud import Cloud
from nacre.io.copc import SUFFIX, is_copc
from nacre.io.glb_reader import read_painting
from nacre.io.mesh_arrays import MeshArrays, vertex_normals
from nacre.io.meshes import READ_SUFFIXES, read_mesh_arrays
from nacre.io.obj_painting import read_painted
from nacre.io.painting import Painting
from nacre.io.ply_header import read_header
from nacre.io.points import count_points, read_points
from nacre.io.raw import read_head
from nacre.kdtree import KdTree
from nacre.normals import estimate_normals
from nacre.run_data.motion import Motion, read_motion
from nacre.run_data.saved_run import SavedRun
from nacre.run_data.text import count
from nacre.viewer.copc_levels import CopcLevels
from nacre.viewer.snapshot import Snapshot
from nacre.viewer.timeline import CAMERA_FRAME, Timeline
from nacre.viewer.view import View

_SURVEYS = (".las", ".laz", ".e57")  # formats of them: z is up
_COARSE_POINTS = 1_000_000
_MOST_POINTS = 50_000_000
_SAMPLES = 10_000
_FAR = 8.0  # sides of the points' box from 0: more, and float32 has no millionth of a side


@guided()
def read_timeline(path: str | os.PathLike[str]) -> Timeline:
    """
    Read what a reconstruction wrote, or the points or the mesh of a file.

    Depth images are shown where the recording is still in its place; on the mesh of a GLB or OBJ file, or of
    ``OUT/mesh.glb``, the image that is painted on it. The points of a run with ``--deform`` are at each frame
    where they were.

    Parameters
    ----------
    path : path-like
        ``OUT``, which holds ``model.ply`` and ``report.json``; or a file of points or of a mesh. Where it has
        no normals, they come from the triangles, or else are estimated; y is up, or z in LAS, LAZ and E57
        files, unless a comment says that it is nacre's, and another may say from where to look first. Of a
        COPC file (``.copc.laz``, extra ``las``) only coarse levels are read; it stays open, and the viewer
        reads nodes of its octree as they are looked at.

    Raises
    ------
    FileFormatError, OSError
        When a file is damaged or missing, or no COPC file and has more than 50 million points.
    ImportError
        When the format needs a package that is not installed; the message says how to install it.
    """
    path = Path(path)
    if path.is_file():
        return _streamed(path) if is_copc(path) else _of_file(path)
    out = SavedRun(path)
    timeline = Timeline(
        out.report.get("title") or path.name,
        out.camera,
        depth_of=_recorded_depth(out),
        depth_range=out.depth_range,
    )
    placed = out.truth_from_world
    world_from_truth = None if placed is None else np.asarray(np.linalg.inv(placed), np.float64)
    for frame in out.frames:
        if frame.truth is not None:
            frame.figures["truth"] = None if world_from_truth is None else world_from_truth @ frame.truth
        timeline.add(frame)
    model = read_points(path / "model.ply")
    if model.normals is None:
        raise FileFormatError(path / "model.ply", "a model of nacre reconstruct has normals")
    motion = _motion(path / "motion.npz", len(timeline.frames), len(model.points))
    timeline.set_snapshot(_cloud(model, out.report.get("spacing"), motion=motion))
    if (path / "mesh.glb").is_file():
        file, triangles, painting = _read(path / "mesh.glb")
        timeline.painted = None if painting is None else _cloud(file, None, triangles, painting)
    return timeline


def _of_file(path: Path) -> Timeline:
    """Return the points or the mesh of a file; those far from the origin about one of their own."""
    file, triangles, painting = _read(path)
    timeline = _timeline(path, file.comments, _origin(file.points))
    near = file if not timeline.origin.any() else replace(file, points=file.points - timeline.origin)
    timeline.set_snapshot(_cloud(near, None, triangles, painting))
    return timeline


def _streamed(path: Path) -> Timeline:
    """Return the coarse points of a COPC file, and its levels of detail."""
    levels = CopcLevels(path)
    timeline = _timeline(path, levels.comments, levels.origin)
    timeline.set_snapshot(levels.coarsest(_COARSE_POINTS))
    timeline.levels = levels
    return timeline


def _timeline(path: Path, comments: tuple[str, ...], origin: npt.NDArray[np.float64]) -> Timeline:
    """Return a timeline without points, upright as the comments of a file or else its format say."""
    is_nacre_s = any(CAMERA_FRAME in comment for comment in comments)
    is_survey = not is_nacre_s and path.suffix.lower() in _SURVEYS
    timeline = Timeline(path.name, None, is_upright=not (is_nacre_s or is_survey), is_survey=is_survey)
    timeline.origin = origin
    view = View.of_comments(comments)
    timeline.view = None if view is None else view._replace(target=view.target - origin)
    return timeline


def _origin(points: npt.NDArray[np.floating[Any]]) -> npt.NDArray[np.float64]:
    """Return the middle of points that are far from 0, as surveys are, to a metre; else 0."""
    sample = points[:: max(len(points) // _SAMPLES, 1)]
    sample = sample[np.isfinite(sample).all(axis=1)]
    if points.dtype != np.float64 or not len(sample):
        return np.zeros(3)
    lower, upper = sample.min(axis=0), sample.max(axis=0)
    middle = np.round(lower / 2 + upper / 2)
    return middle if np.abs(middle).max() > _FAR * (upper - lower).max() else np.zeros(3)


def _cloud(
    file: Cloud,
    spacing: float | None,
    triangles: npt.NDArray[np.int32] | None = None,
    painting: Painting | None = None,
    motion: Motion | None = None,
) -> Snapshot:
    """Return the finite points of a file, triangles between them, what is painted there, how they moved."""
    kept = np.flatnonzero(np.isfinite(file.points).all(axis=1))
    points = np.asarray(file.points, np.float32)
    spacing = max(float(spacing or usual_spacing(points[kept])), 1e-6)
    if file.normals is not None:
        normals = file.normals
    elif triangles is not None:
        normals = vertex_normals(points, triangles)
    else:
        normals = np.full(points.shape, np.nan)
        normals[kept] = _estimated_normals(points[kept])
    known = np.isfinite(normals).all(axis=1, keepdims=True)
    normals = np.where(known, normals, (0, 0, -1)).astype(np.float32)
    known_of = file.attributes.get
    columns = (known_of("confidence"), known_of("last_seen"), known_of("sigma"))
    cloud = Snapshot(points, normals, spacing, file.colors, *columns, triangles, painting, motion)
    return cloud.rows(kept, spacing)


def _motion(path: Path, num_frames: int, num_points: int) -> Motion | None:
    """Return how the points of a run moved, where a file tells; what is damaged is left out."""
    if not path.is_file():
        return None
    try:
        motion = read_motion(path)
        frames, points = len(motion.moments), motion.points.shape[1]
        if (frames, points) != (num_frames, num_points):
            told = f"{frames} frames of {points} points, the run {num_frames} of {num_points}"
            raise FileFormatError(path, f"it has {told}")
    except FileFormatError as error:
        warn(f"the motion is left out: {error}")
        return None
    return motion


def _read(path: Path) -> tuple[Cloud, npt.NDArray[np.int32] | None, Painting | None]:
    """Return the points of a file, or the vertices of a mesh, its triangles, and what is painted on these."""
    if path.suffix.lower() in set(READ_SUFFIXES) - {".ply"}:
        colors = None
        try:
            mesh, painting = _painted(path)
            with suppress(ImportError):  # without pillow only the page decodes the image
                colors = None if painting is None else painting.colors(path)
        except FileFormatError as error:
            mesh, painting = read_mesh_arrays(path), None
            warn(f"the texture is left out: {error}")
        colors = mesh.colors if mesh.colors is not None else colors
        cloud = Cloud(mesh.vertices, mesh.normals, colors, comments=mesh.comments)
        return cloud, mesh.triangles, painting
    triangles = _triangles(path)
    if triangles is None:
        _check_number(path)
    return read_points(path), triangles, None


def _check_number(path: Path) -> None:
    """Refuse more points than are read at once."""
    found = count_points(path)
    if found is not None and found > _MOST_POINTS:
        reason = (
            f"{count(found)} points are more than the {count(_MOST_POINTS)} that are read at once: "
            f"nacre convert {path.name} {path.stem}{SUFFIX} writes a file of which nacre view reads what is "
            "looked at"
        )
        raise FileFormatError(path, reason)


def _painted(path: Path) -> tuple[MeshArrays, Painting | None]:
    """Return the mesh of a file, and what is painted on it."""
    if path.suffix.lower() == ".obj":
        return read_painted(path)
    return read_mesh_arrays(path), read_painting(path) if path.suffix.lower() == ".glb" else None


def _triangles(path: Path) -> npt.NDArray[np.int32] | None:
    """Return the triangles of a file of points, where it has any that can be used."""
    if path.suffix.lower() != ".ply":
        return None
    elements = read_header(path, read_head(path, b"end_header")).elements
    if not any(element.name == "face" and element.num_rows for element in elements):
        return None
    try:
        return read_mesh_arrays(path).triangles
    except FileFormatError:
        return None


def _estimated_normals(points: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
    """Return normals that point to who looks along -z from afar, as at files of other programs."""
    if not len(points):
        return np.zeros((0, 3), np.float32)
    afar = np.array([0, 0, 1000 * np.abs(points).max()])
    return np.asarray(estimate_normals(points, viewpoint=afar), np.float32)


def usual_spacing(points: npt.NDArray[np.float32]) -> float:
    """Return the median distance of a point to its nearest neighbor elsewhere, of a sample of them."""
    sample = points[:: max(len(points) // _SAMPLES, 1)]
    if len(points) < 2:
        return 0.001
    distances, _ = KdTree(points).query(sample, k=2)
    apart = distances[:, 1][distances[:, 1] > 0]  # not from itself at another place of an image
    return float(np.median(apart)) if len(apart) else 0.001


def _recorded_depth(out: SavedRun) -> Any:
    """Return what reads a depth image of the recording, or None where the recording is gone."""
    recording = out.report.get("recording") or {}
    path = recording.get("path")
    from nacre.datasets import open_sequence

    try:
        if path is None or not Path(path).exists():
            return None
        sequence = open_sequence(path, format=recording.get("format"))
    except (FileFormatError, ValueError, OSError):
        return None
    return lambda index: sequence[index].depth
