"""How two pieces lie to each other, as the frames say that both have tracked."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from nacre.reconstruction.known_motions import Poses

Pose = npt.NDArray[np.float64]
_OUTLYING = 3 * 1.4826  # median distances: three standard deviations, where errors are normal


def joint(first: Poses, second: Poses) -> Pose | None:
    """
    Return ``first_from_second``, from the frames that both have; None where there is none.

    Each shared frame measures it. The measurement that the others come nearest to is taken, and the mean of
    those that agree with it: a frame that one of the pieces has wrong does not count.
    """
    shared = sorted(first.keys() & second.keys())
    if not shared:
        return None
    measured = np.array([first[index] @ np.linalg.inv(second[index]) for index in shared])
    # What a camera sees before it, as each measurement places it.
    seen = np.array([second[index] @ np.array([[0, 0, 0, 1], [0, 0, 1, 1]], float).T for index in shared])
    placed = np.einsum("mij,njk->mnik", measured, seen)[:, :, :3]
    own = np.einsum("nij,njk->nik", measured, seen)[:, :3]
    distances = np.linalg.norm(placed - own, axis=2).max(axis=2)
    medians = np.median(distances, axis=1)
    best = int(np.argmin(medians))
    agreeing = distances[best] <= max(_OUTLYING * medians[best], np.finfo(np.float32).eps)
    return _mean(measured[agreeing], seen[agreeing, :3, 0])


def _mean(motions: npt.NDArray[np.float64], places: npt.NDArray[np.float64]) -> Pose:
    """Return the mean of motions, which places nearby are moved by."""
    left, _, right = np.linalg.svd(motions[:, :3, :3].mean(axis=0))
    mean = np.eye(4)
    mean[:3, :3] = left @ np.diag([1, 1, np.linalg.det(left @ right)]) @ right
    middle = places.mean(axis=0)
    moved = (motions[:, :3, :3] @ middle + motions[:, :3, 3]).mean(axis=0)
    mean[:3, 3] = moved - mean[:3, :3] @ middle
    return mean
