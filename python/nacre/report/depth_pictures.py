"""A depth image before and after cleaning, as pictures."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.pictures.colormap import category_rgb, reason_color, viridis
from nacre.report.data import DepthExample
from nacre.report.pictures import Picture, draw
from nacre.run_data.text import label, quantity

_MAX_DEPTH_WIDTH = 640


@dataclass(frozen=True)
class DepthPictures:
    """A depth image before and after cleaning, and what was removed."""

    pictures: tuple[Picture, ...]
    removed: tuple[tuple[str, int, int], ...]  #: reason, its colour's index, pixels
    num_measured: int
    num_pixels: int
    range: tuple[float, float]  #: nearest and farthest colour [m]


def draw_depth(example: DepthExample) -> DepthPictures:
    """Draw a depth image as it was measured, as it is used, and what was removed in between."""
    before, after = (np.asarray(image, dtype=np.float64) for image in (example.before, example.after))
    if before.ndim != 2 or before.shape != after.shape:
        raise ValueError(
            f"depth.before and depth.after must be images of one size, got {before.shape}, {after.shape}"
        )
    measured = np.isfinite(before) & (before > 0)
    kept = np.isfinite(after) & (after > 0)
    gone = measured & ~kept
    names = list(example.reason_names) or ["removed"]
    if example.reasons is None:
        reasons = gone.astype(np.int64)
        names = names[:1]
    else:
        reasons = np.where(gone, np.asarray(example.reasons), 0)
        if reasons.min() < 0 or reasons.max() > len(names):
            raise ValueError(
                f"depth.reasons must lie between 0 and the number of reason_names ({len(names)})"
            )

    shown = before[kept] if kept.any() else before[measured]
    low, high = (float(bound) for bound in np.percentile(shown, (1, 99))) if len(shown) else (1.0, 1.0)
    step = max(-(-before.shape[1] // _MAX_DEPTH_WIDTH), 1)

    def by_depth(visible: npt.NDArray[np.bool_]) -> npt.NDArray[np.uint8]:
        # By inverse depth: near things, which are measured best, get most of the colours.
        inverse = 1 / np.clip(np.where(measured, before, high), low, high)
        position = (inverse - 1 / high) / (1 / low - 1 / high) if high > low else np.ones_like(before)
        position = np.round(position * 127) / 127  # fewer colours make a smaller file
        return np.concatenate([viridis(position), _alpha(visible)], axis=2)

    marked = np.zeros((*before.shape, 4), dtype=np.uint8)
    marked[kept] = (160, 160, 160, 90)
    colors = [reason_color(name, i) for i, name in enumerate(names)]
    for i, color in enumerate(colors):
        marked[reasons == i + 1] = (*category_rgb(color), 255)
    removed = [(name, colors[i], int((reasons == i + 1).sum())) for i, name in enumerate(names)]
    of = f"depth image of frame {example.index}"
    part = quantity(gone.sum() / max(measured.sum(), 1), "fraction")
    causes = ", ".join(label(name).lower() for name, _, num in removed if num)
    pictures = (
        draw(
            "As measured",
            by_depth(measured)[::step, ::step],
            "depth",
            alt=f"The {of}: near yellow, {quantity(low, 'm')}, far violet, {quantity(high, 'm')}",
        ),
        draw(
            "What was removed",
            marked[::step, ::step],
            "depth",
            alt=f"The {of}, grey, with what cleaning removed in colour, {part}{f': {causes}' * bool(causes)}",
        ),
        draw("As used", by_depth(kept)[::step, ::step], "depth", alt=f"The {of} without what was removed"),
    )
    return DepthPictures(pictures, tuple(removed), int(measured.sum()), before.size, (low, high))


def _alpha(visible: npt.NDArray[Any]) -> npt.NDArray[np.uint8]:
    return (visible * np.uint8(255))[:, :, None]
