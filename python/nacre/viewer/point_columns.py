"""What the page reads of each point, but its place."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.io.quantization import octahedral
from nacre.viewer.disks import disk_radii
from nacre.viewer.packing import rounded
from nacre.viewer.snapshot import Snapshot


def point_columns(cloud: Snapshot, largest: float = np.inf) -> dict[str, npt.NDArray[Any]]:
    """
    Return columns for :func:`nacre.viewer.packing.pack`; what is not known of the points is left out.

    Parameters
    ----------
    cloud : Snapshot
    largest : float
        Radius of a disk [spacings].
    """
    columns: dict[str, npt.NDArray[Any]] = {
        "normals": octahedral(cloud.normals),
        "sizes": _logarithms(np.minimum(disk_radii(cloud) / cloud.spacing, largest)),
    }
    if cloud.colors is not None:
        columns["colors"] = cloud.colors
    if cloud.confidence is not None:
        columns["confidence"] = rounded(np.maximum(np.nan_to_num(cloud.confidence), 0))
    if cloud.sigma is not None and np.isfinite(cloud.sigma).any():
        columns["sigma"] = rounded(_known_sigma(cloud.sigma))
    if cloud.last_seen is not None:
        columns["lastSeen"] = np.maximum(cloud.last_seen, 0).astype(np.uint32)
    return columns


def _logarithms(factors: npt.NDArray[np.float32]) -> npt.NDArray[np.uint8]:
    """Return factors from 1/4 to 4000, true to 2 %, as 18 times their binary logarithms above that of 1/4."""
    return np.asarray(np.rint(np.clip(18 * (np.log2(factors) + 2), 0, 255)), np.uint8)


def _known_sigma(sigma: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Return standard deviations of a micrometre at least; those that are not known as the largest."""
    known = np.isfinite(sigma)
    return np.maximum(np.where(known, sigma, sigma[known].max()), 1e-6)
