"""Depth images that can be read, and are still not what they should be."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

_ONE_VALUE = 0.9  # of the measurements: sensors' noise, and a millimetre's steps, spread even a wall more


def depth_oddity(depth: npt.NDArray[np.floating[Any]]) -> str | None:
    """Say what is strange about a depth image [m; NaN: no measurement], or None."""
    measured = depth[np.isfinite(depth)]
    if not len(measured):
        return (
            "no pixel has a measurement (0 and 65535 mean none); are these the depth images, and was the "
            "camera near enough?"
        )
    middle = float(np.median(measured))
    part = float(np.mean(measured == np.float32(middle)))
    if part > _ONE_VALUE and len(measured) > 1000:
        return (
            f"{part:.0%} of the measurements are the same, {middle:.4g} m: is that the largest value that "
            "the camera or the file can hold? A max_depth (--max-depth) below it leaves them out"
        )
    return None
