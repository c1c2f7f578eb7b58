"""Unit quaternions x y z w, and rotation matrices."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Float64 = npt.NDArray[np.float64]


def matrix_from_quaternion(quaternions: npt.ArrayLike) -> Float64:
    """
    Convert quaternions x y z w (N, 4), of any length but 0, to rotations (N, 3, 3); (4,) gives (3, 3).

    Raises
    ------
    ValueError
        A quaternion is 0 or not finite.
    """
    q = np.asarray(quaternions, dtype=np.float64)
    if q.ndim not in (1, 2) or q.shape[-1] != 4:
        raise ValueError(f"quaternions must have shape (N, 4) or (4,), got {q.shape}")
    scale = np.abs(q).max(axis=-1, keepdims=True)
    if not np.isfinite(scale).all() or (scale == 0).any():
        raise ValueError("quaternions must be finite and not 0")
    q = q / scale
    x, y, z, w = np.moveaxis(q / np.linalg.norm(q, axis=-1, keepdims=True), -1, 0)
    rows = (
        (1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)),
        (2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)),
        (2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)),
    )
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def quaternion_from_matrix(rotations: npt.ArrayLike) -> Float64:
    """
    Convert rotation matrices (N, 3, 3) to unit quaternions x y z w (N, 4) with w >= 0; one (3, 3) gives (4,).

    Of the four equivalent formulas the one with the largest divisor is used for each matrix (Shepperd 1978).
    """
    r = np.asarray(rotations, dtype=np.float64)
    if r.ndim not in (2, 3) or r.shape[-2:] != (3, 3):
        raise ValueError(f"rotations must have shape (N, 3, 3) or (3, 3), got {r.shape}")
    m = r.reshape(-1, 3, 3)
    xx, yy, zz = m[:, 0, 0], m[:, 1, 1], m[:, 2, 2]
    sums = {(0, 1): m[:, 0, 1] + m[:, 1, 0], (0, 2): m[:, 0, 2] + m[:, 2, 0], (1, 2): m[:, 1, 2] + m[:, 2, 1]}
    turns = (m[:, 2, 1] - m[:, 1, 2], m[:, 0, 2] - m[:, 2, 0], m[:, 1, 0] - m[:, 0, 1])
    # Row k is 4 q_k q, so its k-th entry is 4 q_k^2.
    products = np.stack(
        [
            np.stack([1 + xx - yy - zz, sums[0, 1], sums[0, 2], turns[0]], axis=-1),
            np.stack([sums[0, 1], 1 - xx + yy - zz, sums[1, 2], turns[1]], axis=-1),
            np.stack([sums[0, 2], sums[1, 2], 1 - xx - yy + zz, turns[2]], axis=-1),
            np.stack([turns[0], turns[1], turns[2], 1 + xx + yy + zz], axis=-1),
        ],
        axis=1,
    )
    best = np.argmax(np.diagonal(products, axis1=1, axis2=2), axis=1)
    q = products[np.arange(len(m)), best]
    q = q / np.linalg.norm(q, axis=-1, keepdims=True)
    result: Float64 = np.where(q[:, 3:] < 0, -q, q).reshape(*r.shape[:-2], 4)
    return result
