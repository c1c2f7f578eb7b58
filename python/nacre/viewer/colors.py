"""Colours of frames and points."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from nacre.viewer.snapshot import Snapshot

STATUS_COLORS = {
    "TRACKED": (90, 150, 220),
    "RELOCALISED": (40, 170, 110),
    "WEAK": (235, 160, 40),
    "LOST": (220, 60, 50),
}
"""Of frames, by their status."""


def point_colors(cloud: Snapshot) -> npt.NDArray[np.uint8]:
    """Return the colours (N, 3) of a model's points: as seen, or else lit from the first camera."""
    if cloud.colors is not None:
        return cloud.colors
    light = np.array([0.3, -0.5, -0.8]) / np.linalg.norm([0.3, -0.5, -0.8])
    shade = 0.35 + 0.65 * np.abs(cloud.normals @ light)
    return np.asarray(shade[:, None] * (205, 210, 215)).astype(np.uint8)
