"""A depth image with what was removed from it."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from nacre.camera import Camera
from nacre.depth import PIXEL_LABELS, label_pixels
from nacre.parameters import DepthParameters
from nacre.pictures.colormap import CATEGORIES, category_rgb, reason_color, viridis


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
    step = max(-(-depth.shape[1] // max_width), 1)
    labels = label_pixels(depth, camera, parameters)[::step, ::step]
    depth = depth[::step, ::step]
    measured = np.isfinite(depth) & (depth > 0)
    kept = measured & (labels == 0)
    picture = np.full((*depth.shape, 3), 24, dtype=np.uint8)
    if kept.any():
        low, high = np.percentile(depth[kept], (1, 99))
        inverse = 1 / np.clip(depth[kept], low, high)  # near things get most of the colours, as in the report
        picture[kept] = viridis((inverse - 1 / high) / max(1 / low - 1 / high, 1e-9))
    for label, name in enumerate(PIXEL_LABELS):
        if label:
            picture[measured & (labels == label)] = category_rgb(reason_color(name, label))
    return picture


def depth_legend() -> str:
    """Return what the colours of removed pixels mean, as HTML."""
    box = "display:inline-block;width:9px;height:9px;border-radius:2px;margin-right:4px;background:"
    keys = "".join(
        f'<span style="white-space:nowrap"><span style="{box}{CATEGORIES[reason_color(name, label)]}"></span>'
        f"{name.replace('_', ' ')}</span>"
        for label, name in enumerate(PIXEL_LABELS)
        if label > 1
    )
    style = "display:flex;flex-wrap:wrap;gap:2px 10px;font-size:12px;padding:0 14px 6px"
    return f'<div style="{style}">removed: {keys}</div>'
