"""What the colours of a model's points tell."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.report.colormap import viridis
from nacre.report.text import count, quantity
from nacre.viewer.timeline import Snapshot

STATUS_COLORS = {
    "TRACKED": (90, 150, 220),
    "RELOCALISED": (40, 170, 110),
    "WEAK": (235, 160, 40),
    "LOST": (220, 60, 50),
}
"""Of frames, by their status."""


def color_kinds(cloud: Snapshot) -> tuple[str, ...]:
    """Return what the points of a model can be coloured by."""
    known = {
        "colour": cloud.colors is not None,
        "shading": True,
        "normal": True,
        "confidence": cloud.confidence is not None,
        "age": cloud.last_seen is not None,
    }
    return tuple(kind for kind, is_known in known.items() if is_known)


def point_colors(cloud: Snapshot, kind: str) -> npt.NDArray[np.uint8]:
    """
    Return the colours (N, 3) of a model's points.

    Parameters
    ----------
    cloud : Snapshot
        The model.
    kind : str
        "colour" as seen; "shading" by a light at the first camera; "normal" by direction; "confidence" and
        "age" from dark (little, long ago) to light. What is not known is shaded.
    """
    if kind == "colour" and cloud.colors is not None:
        return cloud.colors
    if kind == "normal":
        return np.asarray(127.5 * (cloud.normals * (1, -1, -1) + 1)).round().astype(np.uint8)
    if kind == "confidence" and cloud.confidence is not None:
        return viridis(_spread(np.log(np.maximum(cloud.confidence, 1e-3))))
    if kind == "age" and cloud.last_seen is not None:
        return viridis(_spread(cloud.last_seen))
    light = np.array([0.3, -0.5, -0.8]) / np.linalg.norm([0.3, -0.5, -0.8])
    shade = 0.35 + 0.65 * np.abs(cloud.normals @ light)
    return np.asarray(shade[:, None] * (205, 210, 215)).astype(np.uint8)


def color_range(cloud: Snapshot, kind: str) -> tuple[str, str]:
    """Return in words what the darkest and the lightest colour mean, where colours stand for a quantity."""
    if kind == "confidence" and cloud.confidence is not None and len(cloud.points):
        low, high = np.percentile(cloud.confidence, (2, 98))
        return quantity(float(f"{low:.2g}"), "number"), f"{count(round(high))} observations"
    if kind == "age" and cloud.last_seen is not None and len(cloud.points):
        low, high = np.percentile(cloud.last_seen, (2, 98))
        return f"last seen in frame {low:.0f}", f"{high:.0f}"
    return "", ""


def _spread(values: npt.NDArray[Any]) -> npt.NDArray[np.float64]:
    """Return values between 0 and 1, the middle 96 % of them spread over all of it."""
    if not len(values):
        return np.zeros(0)
    low, high = np.percentile(values, (2, 98))
    return np.asarray(np.clip((values - low) / max(high - low, 1e-12), 0, 1), np.float64)
