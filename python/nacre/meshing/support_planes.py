"""Which points of a model lie on the plane that its object stands on."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from nacre.frame_report import FrameReport

_BEND = 0.008  # of the distance from the camera: of a plane that is put aside, cpp/src/region/limits.hpp
_CURL = 2.0  # bends, tuned: so high rises what is left of it, which is bent more; dog
_LEAST_COSINE = 0.9  # between normals of one plane, as there


def on_support(
    points: npt.NDArray[np.float32],
    normals: npt.NDArray[np.float32],
    last_seen: npt.NDArray[np.int32],
    frames: Sequence[FrameReport],
    *,
    margin: float = 0.0,
) -> npt.NDArray[np.bool_]:
    """
    Tell which points are most likely of the supporting plane of the frame that saw them last.

    Each frame put aside what lies within a bend of it, as cameras bend planes. What is left of it, as of a
    sheet of paper whose edge curls, lies little higher, and faces as the plane does.

    Parameters
    ----------
    points, normals : (N, 3) float32
        In the world frame [m], and unit vectors.
    last_seen : (N,) int32
        The index of a frame for each.
    frames : sequence of FrameReport
        All frames.
    margin : float
        What was put aside in place of a bend [m]; 0: a bend.

    Returns
    -------
    (N,) bool
        False, too, where that frame shows no supporting plane.
    """
    planes, eyes = np.full((len(frames), 4), np.nan), np.zeros((len(frames), 3))
    for index in np.unique(last_seen):
        region, pose = frames[index].region, frames[index].world_from_camera
        if region.support < 0:
            continue
        *normal, offset = region.planes[region.support]
        planes[index, :3], eyes[index] = pose[:3, :3] @ normal, pose[:3, 3]
        planes[index, 3] = offset + planes[index, :3] @ eyes[index]
    heights = np.einsum("ij,ij->i", points, planes[last_seen, :3]) - planes[last_seen, 3]
    bend = margin if margin > 0 else _BEND * np.linalg.norm(points - eyes[last_seen], axis=1)
    cosines = np.einsum("ij,ij->i", normals, planes[last_seen, :3])
    return np.asarray((heights <= _CURL * bend) & (cosines > _LEAST_COSINE))
