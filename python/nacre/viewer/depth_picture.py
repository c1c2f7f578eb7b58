"""A depth image with what was removed from it."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from nacre import Camera
from nacre.depth import PIXEL_LABELS, DepthParameters, label_pixels
from nacre.report.colormap import category_rgb, viridis
from nacre.report.depth_pictures import reason_color


def depth_picture(
    depth: npt.NDArray[np.float32],
    camera: Camera,
    parameters: DepthParameters | None = None,
    *,
    max_width: int = 400,
) -> npt.NDArray[np.uint8]:
    """
    Draw a depth image: near bright, far dark, removed pixels in the colours of the report's legend.

    Parameters
    ----------
    depth : (H, W) float32
        [m].
    camera : Camera
        Of the image.
    parameters : DepthParameters, optional
        What is removed.
    max_width : int
        Wider images are drawn with every second, third, ... pixel.

    Returns
    -------
    (H', W', 3) uint8
    """
    labels = label_pixels(depth, camera, parameters)
    measured = np.isfinite(depth) & (depth > 0)
    kept = measured & (labels == 0)
    picture = np.full((*depth.shape, 3), 24, dtype=np.uint8)
    if kept.any():
        low, high = np.percentile(depth[kept], (1, 99))
        position = (high - np.clip(depth[kept], low, high)) / max(high - low, 1e-9)
        picture[kept] = viridis(position)
    for label, name in enumerate(PIXEL_LABELS):
        if label:
            picture[measured & (labels == label)] = category_rgb(reason_color(name, label))
    step = max(-(-depth.shape[1] // max_width), 1)
    return picture[::step, ::step]
