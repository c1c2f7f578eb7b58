"""Which parts of a surface a camera saw."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from nacre._internal.arrays import as_camera, as_number, as_poses
from nacre._internal.guided import guided
from nacre._internal.kinds import as_kind
from nacre.camera import Camera
from nacre.evaluation.surface import SurfaceSamples
from nacre.mesh import Mesh


@guided()
def seen_samples(
    mesh: Mesh,
    samples: SurfaceSamples,
    camera: Camera,
    poses: npt.ArrayLike,
    *,
    max_slant: float = 1.3089969,
) -> npt.NDArray[np.bool_]:
    """
    Return which points of a mesh some view shows: in the image, facing the camera, and nothing before them.

    Parameters
    ----------
    mesh : Mesh
        What the cameras look at [m].
    samples : SurfaceSamples
        Points on it; see :func:`sample_surface`.
    camera : Camera
        Of every view.
    poses : array_like, shape (N, 4, 4)
        ``world_from_camera`` of the views, in the frame of the mesh; one that is not finite sees nothing.
    max_slant : float, optional
        A surface whose normal is farther than this from the direction to the camera does not count as seen
        [rad]; 75 degrees.

    Returns
    -------
    (M,) bool
        One entry per sample.

    Raises
    ------
    ValueError
        When a pose or the slant is out of its range.
    """
    as_camera("camera", camera)
    as_kind("mesh", mesh, Mesh, "a nacre.Mesh")
    as_kind("samples", samples, SurfaceSamples, "nacre.evaluation.sample_surface(...)")
    if not 0 < as_number("max_slant", max_slant) <= math.pi / 2:
        raise ValueError(f"max_slant must be an angle from 0 to pi / 2, got {max_slant!r}")
    seen = np.zeros(len(samples.points), dtype=bool)
    for pose in as_poses("poses", poses):
        if np.isfinite(pose).all():
            rows = np.flatnonzero(~seen)
            seen[rows] = _seen_from(
                mesh, samples.points[rows], samples.normals[rows], camera, pose, max_slant
            )
    return seen


def _seen_from(
    mesh: Mesh,
    points: npt.NDArray[np.float64],
    normals: npt.NDArray[np.float64],
    camera: Camera,
    pose: npt.NDArray[np.float64],
    max_slant: float,
) -> npt.NDArray[np.bool_]:
    local = (points - pose[:3, 3]) @ pose[:3, :3]
    pixels = camera.project(local)
    with np.errstate(invalid="ignore"):
        inside = (
            np.abs(pixels - 0.5 * np.array([camera.width - 1, camera.height - 1]))
            <= (0.5 * np.array([camera.width, camera.height]))
        ).all(axis=1) & (local[:, 2] > 0)
    if camera.model == "orthographic":
        origins = points - local[:, 2:] * pose[:3, 2]
        pixel = np.full(len(points), camera.pixel_size)
    else:
        origins = np.broadcast_to(pose[:3, 3], points.shape)
        pixel = local[:, 2] / min(camera.fx, camera.fy)
    rays = points - origins
    lengths = np.linalg.norm(rays, axis=1)
    facing = -np.einsum("ij,ij->i", rays, normals) > math.cos(max_slant) * lengths
    rows = np.flatnonzero(inside & facing)
    hits = mesh.cast(origins[rows], rays[rows] / lengths[rows, None])
    seen = np.zeros(len(points), dtype=bool)
    seen[rows] = np.abs(hits.distances - lengths[rows]) < 1e-3 * pixel[rows]
    return seen
