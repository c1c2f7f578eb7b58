"""The pictures of a report: the model from its sides, and a depth image before and after cleaning."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.arrays import as_points
from nacre.report.charts import length_unit, ticks
from nacre.report.colormap import category_rgb, viridis
from nacre.report.data import DepthExample, FrameEntry, ModelCloud
from nacre.report.png import encode_png
from nacre.report.render import is_inside_out, measure_spacing, render_points, reverse_part
from nacre.report.view import SIDES, View

OBLIQUE = (-0.75, -0.55, -1.0)
BEHIND = (0.75, -0.55, 1.0)

_SIZE = (560, 560)
_MAIN_SIZE = (680, 640)
_CAMERA_SIZE = (640, 480)
_MAX_POINTS = 300_000
_REASON_COLORS = {
    "edge": 5,
    "slanted": 1,
    "isolated": 3,
    "out_of_range": 0,
    "masked": 4,
    "outside": 2,
    "removed": 5,
}
_MAX_DEPTH_WIDTH = 800


@dataclass(frozen=True)
class Picture:
    """A picture with what is to be said about it."""

    caption: str
    uri: str
    note: str = ""


@dataclass(frozen=True)
class ModelPictures:
    """The model as pictures, all sides at one scale."""

    main: Picture
    cameras: tuple[Picture, ...]  #: what some of the cameras saw; of scenes that surround the camera
    sides: tuple[Picture, ...]
    confidence: tuple[Picture, ...]
    confidence_range: tuple[float, float]
    colors: tuple[Picture, ...]
    scale_bar: tuple[str, float]  #: its length in words, and as a part of a side picture's width


def data_uri(image: npt.NDArray[np.uint8]) -> str:
    """Return an image as the text of a link."""
    return "data:image/png;base64," + base64.b64encode(encode_png(image)).decode("ascii")


def draw_model(model: ModelCloud, frames: Sequence[FrameEntry] = ()) -> ModelPictures | None:
    """Draw the model from all sides, a scene also as its cameras saw it; None where there is no point."""
    model = _thinned(model)
    points = model.points
    if not len(points):
        return None
    spacing = measure_spacing(points)

    def picture(caption: str, view: View, colors: npt.NDArray[np.uint8] | None = None) -> Picture:
        hidden = model.normals is not None and is_inside_out(points, model.normals, view)
        image = render_points(
            points, model.normals, colors, view=view, spacing=spacing, hide_reverse=hidden, background=None
        )
        return Picture(caption, data_uri(image), "reverse sides left out" if hidden else "")

    scale = max(View.fit(points, side, size=_SIZE).metres_per_pixel for side in SIDES)
    sides = {side: View.fit(points, side, size=_SIZE, metres_per_pixel=scale) for side in SIDES}
    poses = [
        frame for frame in frames if frame.world_from_camera is not None and frame.status.upper() != "LOST"
    ]
    main = View.fit(points, OBLIQUE, size=_MAIN_SIZE)
    views = {
        "from the front": View.fit(points, OBLIQUE, size=_SIZE),
        "from behind": View.fit(points, BEHIND, size=_SIZE),
    }
    cameras: dict[str, View] = {}
    if poses and model.normals is not None and _is_scene(points, model.normals, sides):
        chosen = [poses[i] for i in sorted({0, len(poses) // 2, len(poses) - 1})]
        views = {
            f"as frame {frame.index} saw it": View.from_camera(
                points, frame.world_from_camera, size=_CAMERA_SIZE
            )
            for frame in chosen
            if frame.world_from_camera is not None
        }
        main, cameras = View.from_camera(points, np.eye(4), size=_MAIN_SIZE), views

    confidence: tuple[Picture, ...] = ()
    low = high = 0.0
    if model.confidence is not None:
        values = np.nan_to_num(np.asarray(model.confidence, dtype=np.float64).reshape(-1))
        low, high = (float(bound) for bound in np.percentile(values, (2, 98)))
        shades = viridis(_positions(values, low, high))
        confidence = tuple(
            picture(f"Confidence, {name}", view, shades) for name, view in list(views.items())[:2]
        )
    colors: tuple[Picture, ...] = ()
    if model.colors is not None:
        colors = tuple(
            picture(f"Colour, {name}", view, model.colors) for name, view in list(views.items())[:2]
        )
    return ModelPictures(
        main=picture("The model", main),
        cameras=tuple(picture(name[:1].upper() + name[1:], view) for name, view in cameras.items()),
        sides=tuple(picture(side.capitalize(), view) for side, view in sides.items()),
        confidence=confidence,
        confidence_range=(low, high),
        colors=colors,
        scale_bar=_scale_bar(scale * _SIZE[0]),
    )


def is_logarithmic(low: float, high: float) -> bool:
    """Return whether values between two bounds are coloured by their logarithm."""
    return 0 < 30 * low < high


def _positions(values: npt.NDArray[np.float64], low: float, high: float) -> npt.NDArray[np.float64]:
    """Return where values lie between two bounds, 0 to 1."""
    if high <= low:
        return np.ones(len(values))
    values = np.clip(values, low, high)
    if is_logarithmic(low, high):
        return np.asarray(np.log(values / low) / np.log(high / low))
    return np.asarray((values - low) / (high - low))


def _thinned(model: ModelCloud) -> ModelCloud:
    """Return the finite points of a model, as many as pictures of this size can show."""
    points = as_points("model.points", model.points)
    rows = np.flatnonzero(np.isfinite(points).all(axis=1))
    if len(rows) > _MAX_POINTS:
        rows = np.sort(np.random.default_rng(0).choice(rows, _MAX_POINTS, replace=False))

    def pick(name: str, values: Any) -> Any:
        if values is None:
            return None
        if len(values) != len(points):
            raise ValueError(f"model.{name} must have one row per point ({len(points)}), got {len(values)}")
        return np.asarray(values)[rows]

    return ModelCloud(
        points[rows],
        pick("normals", model.normals),
        pick("colors", model.colors),
        pick("confidence", model.confidence),
    )


def _is_scene(points: npt.ArrayLike, normals: npt.ArrayLike, sides: dict[str, View]) -> bool:
    """Return whether a model surrounds its cameras: two or more of its sides are seen from behind."""
    return sum(reverse_part(points, normals, view) > 0.5 for view in sides.values()) >= 2


def _scale_bar(width: float) -> tuple[str, float]:
    length = ticks(0, width, 5)[1]
    unit, factor = length_unit(length)
    return f"{length * factor:.4g} {unit}", length / width


@dataclass(frozen=True)
class DepthPictures:
    """A depth image before and after cleaning, and what was removed."""

    pictures: tuple[Picture, ...]
    removed: tuple[tuple[str, int, int], ...]  #: reason, its colour's index, pixels
    num_measured: int
    range: tuple[float, float]  #: nearest and farthest colour [m]


def reason_color(name: str, index: int) -> int:
    """Return the index of the colour that stands for a reason to remove pixels."""
    return _REASON_COLORS.get(name, index)


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
        position = np.round(position * 95) / 95  # fewer colours make a smaller file
        return np.concatenate([viridis(position), _alpha(visible)], axis=2)

    marked = np.zeros((*before.shape, 4), dtype=np.uint8)
    marked[kept] = (160, 160, 160, 90)
    colors = [reason_color(name, i) for i, name in enumerate(names)]
    for i, color in enumerate(colors):
        marked[reasons == i + 1] = (*category_rgb(color), 255)
    pictures = (
        Picture("As measured", data_uri(by_depth(measured)[::step, ::step])),
        Picture("What was removed", data_uri(marked[::step, ::step])),
        Picture("As used", data_uri(by_depth(kept)[::step, ::step])),
    )
    removed = [(name, colors[i], int((reasons == i + 1).sum())) for i, name in enumerate(names)]
    return DepthPictures(pictures, tuple(removed), int(measured.sum()), (low, high))


def _alpha(visible: npt.NDArray[Any]) -> npt.NDArray[np.uint8]:
    return (visible * np.uint8(255))[:, :, None]
