"""Triangle meshes that move: animated GLB files, by principal components of the motion."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre._internal import arrays
from nacre._internal.guided import guided
from nacre.io.cloud import check_cloud
from nacre.io.glb import VERTEX_BUFFER, document_of, store, unit
from nacre.io.mesh_arrays import MeshArrays

_RATE = 30.0  # frames a second, where no times are given


@guided(
    "the vertices at each frame, (F, N, 3), and the triangles that join them at all",
    faces="triangles",
    fps="times has the seconds of each frame: numpy.arange(F) / fps",
)
def write_animation(
    path: str | os.PathLike[str],
    vertices: npt.ArrayLike,
    triangles: npt.ArrayLike,
    *,
    normals: npt.ArrayLike | None = None,
    colors: npt.ArrayLike | None = None,
    times: npt.ArrayLike | None = None,
    tolerance: float = 1e-4,
    comments: Sequence[str] = (),
) -> None:
    """
    Write a mesh that moves to one animated GLB file, whole or not at all.

    Parameters
    ----------
    path : path-like
        A ``.glb`` file (glTF 2.0): viewers and modelling programs play it. A reader without animation, such
        as :func:`nacre.read_mesh`, gets the first frame.
    vertices : (F, N, 3) array
        The vertices at each frame [m].
    triangles : (M, 3) array of integers
        Indices of the corners, counted from 0; the same at every frame.
    normals : (F, N, 3) array, optional
        Of the vertices at each frame.
    colors : (N, 3) array of integers from 0 to 255, or of floats from 0 to 1, optional
        Red, green, blue of the vertices.
    times : (F,) array, optional
        When each frame is shown [s], increasing; by default 30 a second.
    tolerance : float
        No vertex of the file is farther from its place at any frame [m]; 0: as near as float32 gets.
    comments : sequence of str
        Lines for the header.

    Raises
    ------
    TypeError, ValueError
        When an argument does not fit; the message names it.
    OSError
        When the file cannot be written; it has the path.

    Notes
    -----
    The frames are the first one plus weighted sums of displacements (morph targets): the principal
    components of the motion, as many as the tolerance asks for (Alexa and Müller 2000). What jitters from
    frame to frame by more than that needs nearly one for each: with a tenth of the spacing, deforming models
    took 22 for 30 frames and 66 for 80. Between two frames vertices go straight. All frames must fit memory.

    References
    ----------
    .. [1] M. Alexa, W. Müller: Representing animations by principal components. Computer Graphics Forum
       19(3), 2000.
    """
    if Path(path).suffix.lower() != ".glb":
        raise ValueError(f"animations are written to .glb, got {os.fspath(path)!r}")
    shapes = _as_frames("vertices", vertices)
    corners = arrays.as_triangles("triangles", triangles, shapes.shape[1])
    shades = None if normals is None else _as_frames("normals", normals)
    if shades is not None and shades.shape != shapes.shape:
        raise ValueError(f"normals must have shape {shapes.shape} as vertices, got {shades.shape}")
    first = check_cloud(shapes[0], None if shades is None else shades[0], colors, None)
    seconds = _as_times(times, len(shapes))
    allowed = arrays.as_number("tolerance", tolerance)
    if not 0 <= allowed < np.inf:
        raise ValueError(f"tolerance must be a length in metres, got {tolerance!r}")
    document, buffer = document_of(MeshArrays(first.points, corners, first.normals, first.colors), comments)
    modes, weights = principal_components(shapes - shapes[0], allowed)
    if len(modes):
        targets = [
            {"POSITION": buffer.add(mode, "VEC3", VERTEX_BUFFER, min=_low(mode), max=_high(mode))}
            for mode in modes.astype(np.float32)
        ]
        if shades is not None:
            directions = np.stack([unit(shade) for shade in shades])
            turns = np.linalg.pinv(weights) @ (directions - directions[0]).reshape(len(shapes), -1)
            for target, turn in zip(targets, turns.reshape(modes.shape).astype(np.float32), strict=True):
                target["NORMAL"] = buffer.add(turn, "VEC3", VERTEX_BUFFER)
        mesh = document["meshes"][0]
        mesh["primitives"][0]["targets"] = targets
        mesh["weights"] = [0.0] * len(modes)
        moments = buffer.add(seconds, "SCALAR", min=[float(seconds[0])], max=[float(seconds[-1])])
        levels = buffer.add(weights.astype(np.float32).reshape(-1), "SCALAR")
        sampler = {"input": moments, "output": levels, "interpolation": "LINEAR"}
        channel = {"sampler": 0, "target": {"node": 0, "path": "weights"}}
        document["animations"] = [{"samplers": [sampler], "channels": [channel]}]
    store(path, document, buffer)


def principal_components(
    displacements: npt.NDArray[np.float64], tolerance: float
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """
    Return the fewest displacements whose weighted sums tell those of every frame.

    Parameters
    ----------
    displacements : (F, N, 3) float64
        Of each vertex at each frame [m].
    tolerance : float
        No vertex is farther from its place at any frame [m].

    Returns
    -------
    modes : (R, N, 3) float64
        [m]; the weights' largest magnitude is 1.
    weights : (F, R) float64
    """
    rest = displacements.reshape(len(displacements), -1).copy()
    _, axes = np.linalg.eigh(rest @ rest.T)
    modes, columns = [], []
    for axis in axes.T[::-1]:
        if np.linalg.norm(rest.reshape(displacements.shape), axis=2).max(initial=0.0) <= tolerance:
            break
        scale = float(np.abs(axis).max())
        modes.append(scale * (axis @ rest))
        columns.append(axis / scale)
        rest -= np.outer(columns[-1], modes[-1])
    shape = (len(modes), *displacements.shape[1:])
    weights = np.stack(columns, axis=1) if columns else np.zeros((len(displacements), 0))
    return np.array(modes, np.float64).reshape(shape), weights


def _as_frames(name: str, values: npt.ArrayLike) -> npt.NDArray[np.float64]:
    frames = arrays.as_real(name, values)
    if frames.ndim != 3 or frames.shape[2] != 3 or not frames.size:
        raise ValueError(f"{name} must have shape (F, N, 3), got {frames.shape}")
    found = frames.astype(np.float64)
    if not np.isfinite(found).all():
        raise ValueError(
            f"{name} must be finite, got {np.count_nonzero(~np.isfinite(found))} values that are not"
        )
    return found


def _as_times(times: npt.ArrayLike | None, count: int) -> npt.NDArray[np.float32]:
    if times is None:
        return np.asarray(np.arange(count) / _RATE, np.float32)
    given = arrays.as_real("times", times)
    if given.shape != (count,):
        raise ValueError(f"times must have one entry per frame ({count}), got shape {given.shape}")
    with np.errstate(over="ignore", invalid="ignore"):
        seconds = np.asarray(given.astype(np.float64) - float(given[0]), np.float32)
        steps = np.diff(seconds)
    wrong = np.flatnonzero(~(np.isfinite(steps) & (steps > 0)))
    if not np.isfinite(seconds[0]) or len(wrong):
        place = int(wrong[0]) + 1 if len(wrong) else 0
        raise ValueError(
            f"times must be finite and increase from frame to frame, got {given[place]} at frame {place}"
        )
    return seconds


def _low(values: npt.NDArray[Any]) -> list[float]:
    return [float(value) for value in values.min(axis=0)]


def _high(values: npt.NDArray[Any]) -> list[float]:
    return [float(value) for value in values.max(axis=0)]
