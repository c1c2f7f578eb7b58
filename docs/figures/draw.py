"""Panels with captions, curves, and points of several colours, put together to pictures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from nacre.pictures.colormap import CATEGORIES, category_rgb, viridis
from nacre.rendering import View, render_points
from nacre.run_data.text import ticks

__all__ = [
    "Curve",
    "View",
    "by_value",
    "category_rgb",
    "chart",
    "image_panel",
    "points_panel",
    "save",
    "sheet",
    "two_colors",
]

BLUE, ORANGE, GREEN, PINK, SKY, RED, GREY = range(7)  # of CATEGORIES
INK, FAINT = (40, 40, 40), (215, 215, 215)
MARGIN, PAGE = 12, 760  # pixels


def font(size: int) -> ImageFont.ImageFont | ImageFont.FreeTypeFont:
    """Return the font of captions and axes."""
    return ImageFont.load_default(size)


def points_panel(points, normals=None, colors=None, *, view=None, view_from="front", size=(360, 360), **more):
    """Draw points as a closed, shaded surface: at twice the size, then smaller, for smooth edges."""
    large = (2 * size[0], 2 * size[1])
    if view is None:
        view = View.fit(points, view_from, size=large)
    else:
        view = View(view.view_from_model, view.center, view.metres_per_pixel / 2, large)
    picture = render_points(points, normals, colors, view=view, **more)
    return np.asarray(Image.fromarray(picture).resize(size, Image.Resampling.BOX))


def by_value(values, low: float, high: float):
    """Return colours of values between two bounds; what is not finite is white."""
    position = np.clip((np.asarray(values, dtype=np.float64) - low) / max(high - low, 1e-12), 0, 1)
    known = np.isfinite(position)
    colors = viridis(np.where(known, position, 0).ravel()).reshape(*position.shape, 3)
    return np.where(known[..., None], colors, 255).astype(np.uint8)


def two_colors(first, second):
    """Return a colour for each point of two clouds, one after the other."""
    parts = ((SKY, len(first)), (ORANGE, len(second)))
    return np.concatenate([np.tile(category_rgb(color), (count, 1)) for color, count in parts])


def image_panel(image, size: tuple[int, int], crop=None):
    """Show the pixels of an image (H, W, 3), each as a square, cropped to rows and columns."""
    if crop is not None:
        image = image[crop]
    scale = min(size[0] / image.shape[1], size[1] / image.shape[0])
    shape = (round(scale * image.shape[1]), round(scale * image.shape[0]))
    how = Image.Resampling.NEAREST if scale > 1 else Image.Resampling.BOX
    panel = Image.new("RGB", size, "white")
    panel.paste(
        Image.fromarray(image).resize(shape, how), ((size[0] - shape[0]) // 2, (size[1] - shape[1]) // 2)
    )
    return np.asarray(panel)


@dataclass(frozen=True)
class Curve:
    """A line or dots of a chart."""

    name: str
    x: Sequence[float]
    y: Sequence[float]
    color: int = BLUE
    style: str = "line"  # "line", "dots" or "both"


def chart(
    curves: Sequence[Curve],
    *,
    x_label: str,
    y_label: str,
    size: tuple[int, int] = (560, 320),
    limits: tuple[float, float, float, float] | None = None,
    level: tuple[float, str] | None = None,
):
    """Draw curves over common axes; ``limits``: x and y from and to; ``level``: a line across, named."""
    scale = 2
    xs, ys = (np.concatenate([np.asarray(getattr(c, axis), float) for c in curves]) for axis in "xy")
    x0, x1, y0, y1 = limits or (np.nanmin(xs), np.nanmax(xs), min(0.0, np.nanmin(ys)), 1.06 * np.nanmax(ys))
    left, right, top, bottom = 60, 14, 14, 42
    width, height = size[0] - left - right, size[1] - top - bottom
    named = [curve for curve in curves if curve.name]
    if limits is None:  # room for the names
        y1 += (y1 - y0) * (8 + 19 * len(named)) / height
    picture = Image.new("RGB", (scale * size[0], scale * size[1]), "white")
    pen = ImageDraw.Draw(picture)
    text = font(13 * scale)

    def at(x: float, y: float) -> tuple[float, float]:
        u, v = left + (x - x0) / (x1 - x0) * width, top + (y1 - y) / (y1 - y0) * height
        return scale * u, scale * v

    for tick in ticks(x0, x1, 6):
        pen.line([at(tick, y0), at(tick, y1)], fill=FAINT, width=scale)
        u, v = at(tick, y0)
        pen.text((u, v + 4 * scale), f"{tick:g}", INK, text, anchor="mt")
    for tick in ticks(y0, y1, 5):
        pen.line([at(x0, tick), at(x1, tick)], fill=FAINT, width=scale)
        u, v = at(x0, tick)
        pen.text((u - 6 * scale, v), f"{tick:g}", INK, text, anchor="rm")
    pen.text((scale * (left + width / 2), scale * (size[1] - 4)), x_label, INK, text, anchor="mb")
    label = Image.new("RGB", (scale * height, 20 * scale), "white")
    ImageDraw.Draw(label).text((scale * height / 2, 2 * scale), y_label, INK, text, anchor="mt")
    picture.paste(label.rotate(90, expand=True), (2, scale * top))
    if level is not None:
        pen.line([at(x0, level[0]), at(x1, level[0])], fill=INK, width=scale)
        u, v = at(x1, level[0])
        pen.text((u - 4 * scale, v - 3 * scale), level[1], INK, text, anchor="rb")
    for curve in curves:
        color = CATEGORIES[curve.color]
        xy = [at(x, y) for x, y in zip(curve.x, curve.y, strict=True)]
        if curve.style != "dots":
            pen.line(xy, fill=color, width=2 * scale, joint="curve")
        if curve.style != "line":
            for u, v in xy:
                pen.ellipse([u - 4 * scale, v - 4 * scale, u + 4 * scale, v + 4 * scale], fill=color)
    for row, curve in enumerate(named):
        u, v = scale * (left + 12), scale * (top + 14 + 19 * row)
        pen.rectangle([u, v - 2 * scale, u + 16 * scale, v + 2 * scale], fill=CATEGORIES[curve.color])
        pen.text((u + 22 * scale, v), curve.name, INK, text, anchor="lm")
    return np.asarray(picture.resize(size, Image.Resampling.LANCZOS))


def sheet(panels: Sequence[tuple[str, np.ndarray]], columns: int | None = None):
    """Put panels of one size beside and below each other, with captions that stay legible on a page."""
    columns = columns or len(panels)
    height, width = panels[0][1].shape[:2]
    rows = -(-len(panels) // columns)
    full_width = columns * (width + MARGIN) + MARGIN
    text = round(15 * max(1.0, full_width / PAGE))
    row_height = height + 2 * text + 4
    picture = Image.new("RGB", (full_width, rows * row_height + MARGIN), "white")
    pen = ImageDraw.Draw(picture)
    for i, (caption, panel) in enumerate(panels):
        u, v = MARGIN + (i % columns) * (width + MARGIN), MARGIN + (i // columns) * row_height
        picture.paste(Image.fromarray(panel), (u, v))
        pen.text((u + width / 2, v + height + text // 2), caption, INK, font(text), anchor="mt")
    return np.asarray(picture)


def save(path: Path, picture, quality: int = 82) -> None:
    """Write a picture as WebP, which for shaded surfaces is a fifth of a PNG."""
    path.parent.mkdir(parents=True, exist_ok=True)
    Image.fromarray(picture).save(path, "WEBP", quality=quality, method=6)
