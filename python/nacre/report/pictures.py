"""The model as pictures: from its sides, as cameras saw it, and with what its points tell as colour."""

from __future__ import annotations

import base64
import functools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre._internal.arrays import as_points
from nacre.camera import Camera
from nacre.kdtree import KdTree
from nacre.pictures.colormap import viridis
from nacre.pictures.image_files import encode_small
from nacre.rendering import OBLIQUE, SIDES, View, render_points
from nacre.report.data import ModelCloud
from nacre.report.deformation import deformation_figures
from nacre.report.first_view import disk_radii, first_view
from nacre.report.reverse_sides import ReverseParts, reverse_parts
from nacre.run_data.reported_frame import ReportedFrame
from nacre.run_data.text import length_unit, ticks

BEHIND = (0.75, -0.55, 1.0)

_SIZE = (560, 560)
_MAIN_SIZE = (680, 640)
_CAMERA_SIZE = (640, 480)
_THUMBNAIL_SIZE = (200, 150)
_MAX_POINTS = 300_000
_FITTED_POINTS = 50_000  # tell how far a model reaches
_MAX_BYTES = {
    "main": 70_000,
    "camera": 55_000,
    "side": 50_000,
    "attribute": 60_000,
    "depth": 24_000,
    "thumbnail": 8_000,
}


@dataclass(frozen=True)
class Picture:
    """A picture with what is to be said about it."""

    caption: str
    uri: str
    size: tuple[int, int]  #: width, height
    note: str = ""
    alt: str = ""  #: for those who do not see it


@dataclass(frozen=True)
class Attribute:
    """The model with a quantity of its points as colour."""

    pictures: tuple[Picture, ...]
    range: tuple[float, float]  #: of the colours
    typical: float  #: median

    @property
    def is_logarithmic(self) -> bool:
        """Whether the colours are by the logarithm."""
        return _is_logarithmic(*self.range)


@dataclass(frozen=True)
class ModelPictures:
    """The model as pictures, all sides at one scale."""

    main: Picture
    cameras: tuple[Picture, ...]  #: what some of the cameras saw; of scenes that surround the camera
    sides: tuple[Picture, ...]
    spacing: Attribute  #: distance of each point to its nearest neighbour [m]
    confidence: Attribute | None
    shape: tuple[Picture, ...]  #: without colours, where there are some
    scale_bar: tuple[str, float]  #: its length in words, and as a part of a side picture's width


def draw(caption: str, image: npt.NDArray[np.uint8], kind: str, *, note: str = "", alt: str = "") -> Picture:
    """Return an image as a picture whose file is as small as its kind asks for."""
    data = base64.b64encode(encode_small(image, _MAX_BYTES[kind], lossless=kind == "depth")).decode("ascii")
    return Picture(caption, f"data:image/webp;base64,{data}", (image.shape[1], image.shape[0]), note, alt)


def draw_model(
    model: ModelCloud, frames: Sequence[ReportedFrame] = (), camera: Camera | None = None
) -> ModelPictures | None:
    """
    Draw the model as the viewer shows it first, and from all sides; None where there is no point.

    A scene is also drawn as its cameras saw it, but one that bends, to which their poses are relative.
    """
    model, spacing = _thinned(model)
    points = model.points
    if not len(points):
        return None
    extent = points[:: -(-len(points) // _FITTED_POINTS)]
    sides, scale = _fit_sides(extent, 0.001)
    reverse = functools.cache(functools.partial(reverse_parts, points, model.normals))
    is_scene = _surrounds_its_cameras(reverse, sides) and deformation_figures(frames) is None
    if is_scene:
        sides, scale = _fit_sides(extent, 0.02)  # what lies far away would make the rest tiny
    reach = disk_radii(model)

    def picture(
        caption: str,
        view: View,
        kind: str,
        colors: npt.NDArray[np.uint8] | None = model.colors,
        by: str = "shaded grey" if model.colors is None else "in its colours",
        *,
        hide_reverse: bool = False,
    ) -> Picture:
        is_inside_out = reverse(view).inside_out
        image = render_points(
            points, model.normals, colors, view=view, spacing=reach,
            hide_reverse=hide_reverse or is_inside_out, background=None,
        )  # fmt: skip
        alt = f"The model, {by}: {caption.lower()}"
        return draw(caption, image, kind, note="reverse sides left out" if is_inside_out else "", alt=alt)

    poses = [f for f in frames if f.world_from_camera is not None and f.status.upper() != "LOST"]
    main = first_view(model, frames, camera, _MAIN_SIZE)
    views = {
        "from the front": View.fit(extent, OBLIQUE, size=_SIZE, outliers=0.004),
        "from behind": View.fit(extent, BEHIND, size=_SIZE, outliers=0.004),
    }
    cameras: dict[str, View] = {}
    if is_scene and poses:
        chosen = [poses[i] for i in sorted({0, len(poses) // 2, len(poses) - 1})]
        views = {
            f"as frame {frame.index} saw it": View.from_camera(
                extent, frame.world_from_camera, size=_CAMERA_SIZE
            )
            for frame in chosen
            if frame.world_from_camera is not None
        }
        cameras = views
    few = list(views.items())[:2]

    def attribute(name: str, values: npt.NDArray[np.float64]) -> Attribute:
        low, high = (float(bound) for bound in np.percentile(values, (2, 98)))
        shades = viridis(_positions(values, low, high))
        shown = [
            picture(f"{name}, {where}", view, "attribute", shades, f"{name.lower()} as colour")
            for where, view in few
        ]
        return Attribute(tuple(shown), (low, high), float(np.median(values)))

    confidence = None
    if model.confidence is not None:
        known = np.nan_to_num(np.asarray(model.confidence, dtype=np.float64).reshape(-1))
        confidence = attribute("Confidence", known)
    shape: tuple[Picture, ...] = ()
    if model.colors is not None:
        shape = tuple(
            picture(f"Shape, {where}", view, "attribute", None, "shaded grey") for where, view in few
        )
    return ModelPictures(
        main=picture("The model", main, "main", hide_reverse=bool(poses)),
        cameras=tuple(
            picture(_capital(name), view, "camera", hide_reverse=True) for name, view in cameras.items()
        ),
        sides=tuple(picture(side.capitalize(), view, "side") for side, view in sides.items()),
        spacing=attribute("Spacing", spacing),
        confidence=confidence,
        shape=shape,
        scale_bar=_scale_bar(scale * _SIZE[0]),
    )


def draw_thumbnail(
    model: ModelCloud, frames: Sequence[ReportedFrame] = (), camera: Camera | None = None
) -> bytes | None:
    """Return the model as a small WebP file, as the report shows it first; None where there is no point."""
    model, _ = _thinned(model, _FITTED_POINTS)
    if not len(model.points):
        return None
    view = first_view(model, frames, camera, _THUMBNAIL_SIZE)
    hidden = any(frame.world_from_camera is not None for frame in frames)
    image = render_points(
        model.points, model.normals, model.colors, view=view, spacing=disk_radii(model),
        hide_reverse=hidden or reverse_parts(model.points, model.normals, view).inside_out, background=None,
    )  # fmt: skip
    return encode_small(image, _MAX_BYTES["thumbnail"])


def _surrounds_its_cameras(reverse: Callable[[View], ReverseParts], sides: Mapping[str, View]) -> bool:
    """Return whether a model is a scene: two or more of its sides are seen from behind."""
    return sum(reverse(view).from_behind for view in sides.values()) >= 2


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]


def _fit_sides(points: npt.NDArray[Any], outliers: float) -> tuple[dict[str, View], float]:
    """Return the views of the six sides, no higher than needed, and their scale [m per pixel]."""
    scale = max(View.fit(points, side, size=_SIZE, outliers=outliers).metres_per_pixel for side in SIDES)
    low, high = np.percentile(points, (100 * outliers, 100 - 100 * outliers), axis=0)
    tallest = float(max(high[1] - low[1], high[2] - low[2]))  # y is down, but in the views along it
    height = int(np.clip(tallest / scale / 0.9, 0.5 * _SIZE[1], _SIZE[1]))
    sides = {
        side: View.fit(points, side, size=(_SIZE[0], height), metres_per_pixel=scale, outliers=outliers)
        for side in SIDES
    }
    return sides, scale


def _is_logarithmic(low: float, high: float) -> bool:
    """Return whether values between two bounds are coloured by their logarithm."""
    return 0 < 30 * low < high


def _positions(values: npt.NDArray[np.float64], low: float, high: float) -> npt.NDArray[np.float64]:
    """Return where values lie between two bounds, 0 to 1."""
    if high <= low:
        return np.ones(len(values))
    values = np.clip(values, low, high)
    if _is_logarithmic(low, high):
        return np.asarray(np.log(values / low) / np.log(high / low))
    return np.asarray((values - low) / (high - low))


def _thinned(model: ModelCloud, most: int = _MAX_POINTS) -> tuple[ModelCloud, npt.NDArray[np.float64]]:
    """
    Return the finite points of a model, as many as pictures can show.

    And how far each of them is from the nearest other point of the whole model [m].
    """
    points = as_points("model.points", model.points)
    rows = np.flatnonzero(np.isfinite(points).all(axis=1))
    spacing = np.zeros(len(points))
    spacing[rows] = _nearest_distances(points[rows])
    if len(rows) > most:
        rows = np.sort(np.random.default_rng(0).choice(rows, most, replace=False))

    def pick(name: str, values: Any) -> Any:
        if values is None:
            return None
        if len(values) != len(points):
            raise ValueError(f"model.{name} must have one row per point ({len(points)}), got {len(values)}")
        return np.asarray(values)[rows]

    thinned = ModelCloud(
        points[rows],
        pick("normals", model.normals),
        pick("colors", model.colors),
        pick("confidence", model.confidence),
    )
    return thinned, spacing[rows]


def _nearest_distances(points: npt.NDArray[np.floating[Any]]) -> npt.NDArray[np.float64]:
    """Return how far each point is from the nearest other one; 0 for a lone point."""
    if len(points) < 2:
        return np.zeros(len(points))
    return np.asarray(KdTree(points).query(points, k=2)[0], dtype=np.float64)[:, 1]


def _scale_bar(width: float) -> tuple[str, float]:
    length = ticks(0, width, 5)[1]
    unit, factor = length_unit(length)
    return f"{length * factor:.4g} {unit}", length / width
