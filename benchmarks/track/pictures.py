"""The pictures of the page: models as they were written, and what is removed from single depth images."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

import nacre
from nacre.pictures.image_files import encode_png, encode_small
from nacre.rendering import View, render_points
from nacre.report import ModelCloud
from nacre.report.first_view import disk_radii, first_view
from nacre.run_data.saved_run import SavedRun
from track.rows import Places

Image = npt.NDArray[np.uint8]

COLORS = {
    "edge": (230, 60, 40),
    "slanted": (240, 170, 30),
    "isolated": (60, 110, 230),
}
"""Of removed pixels; where nothing was measured is black, what is kept is grey, the nearer the lighter."""

MAX_BYTES = 60_000  # of a model's picture


def draw_labels(depth: npt.NDArray[np.float32], camera: Any) -> Image:
    """Return a depth image in grey, with its removed pixels in the colours of their reasons."""
    labels = nacre.label_pixels(depth, camera)
    near, far = np.nanquantile(depth[labels == 0], (0.01, 0.95))
    with np.errstate(invalid="ignore"):
        grey = np.nan_to_num(255 - 200 * np.clip((depth - near) / (far - near), 0, 1)).astype(np.uint8)
    image = np.repeat(grey[..., None], 3, axis=2)
    for name, color in COLORS.items():
        image[labels == nacre.PIXEL_LABELS.index(name)] = color
    image[labels == nacre.PIXEL_LABELS.index("invalid")] = 0
    return image


def draw_cloud(depth: npt.NDArray[np.float32], camera: Any, size: tuple[int, int] = (640, 480)) -> Image:
    """Return the points of a depth image seen from its side and above, where flying pixels show."""
    points = nacre.back_project(depth, camera)
    if len(points) > 150_000:
        points = points[:: len(points) // 150_000 + 1]
    near = points[points[:, 2] < np.quantile(points[:, 2], 0.9)]
    view = View.fit(near, (-1.0, -0.6, -0.5), size=size)
    return np.asarray(render_points(near, view=view, spacing=0.0012 * float(np.median(near[:, 2]))))


def before_and_after(depth: npt.NDArray[np.float32], camera: Any) -> Image:
    """Return the labelled image, and the points before and after, in a row."""
    clean = nacre.preprocess_depth(depth, camera)
    height = 480
    labelled = draw_labels(depth, camera)
    labelled = labelled[:: max(1, labelled.shape[0] // height), :: max(1, labelled.shape[0] // height)]
    parts = [labelled, draw_cloud(depth, camera), draw_cloud(clean, camera)]
    tall = max(part.shape[0] for part in parts)
    padded = [np.pad(p, ((0, tall - p.shape[0]), (0, 0), (0, 0)), constant_values=255) for p in parts]
    return np.ascontiguousarray(np.concatenate(padded, axis=1)[..., :3])


def depth_images(places: Places) -> Iterator[tuple[str, npt.NDArray[np.float32], Any]]:
    """Return the single images that are there: name, metres, camera."""
    singles = places.data / "depth-singles"
    xtion = nacre.Camera(640, 480, 1066.778, 1067.487, 312.9869, 241.3109)
    prime = nacre.Camera(640, 480, 525.0, 525.0, 319.5, 239.5)
    d435 = nacre.Camera(640, 480, 617.25, 617.55, 317.39, 245.98)
    dog = nacre.Camera(640, 480, 616.87, 617.06, 319.57, 233.06)
    for name, path, scale, camera in [
        ("xtion-1", singles / "000001-depth.png", 10000, xtion),
        ("xtion-2", singles / "000002-depth.png", 10000, xtion),
        ("d435", singles / "realsense-felix" / "000000.png", 1000, d435),
        ("primesense", singles / "open3d" / "depth" / "00000.png", 1000, prime),
        ("dog", places.data / "realsense-turntable-dog" / "data1" / "depth_0.png", 1000, dog),
    ]:
        if path.exists():
            from nacre.datasets.sequence import load_depth_metres

            yield name, load_depth_metres(path, scale), camera


def draw_model(out: Path, size: tuple[int, int] = (560, 480)) -> Image | None:
    """Return the model that was written to OUT, as the viewer shows it first; None where there is none."""
    if not (out / "model.ply").exists():
        return None
    cloud, run = nacre.read_points(out / "model.ply"), SavedRun(out)
    model = ModelCloud(cloud.points, cloud.normals, cloud.colors, cloud.attributes["confidence"])
    view = first_view(model, run.frames, run.camera, size)
    colors = None if cloud.colors is None else np.asarray(cloud.colors)
    radii = disk_radii(model)
    picture = render_points(cloud.points, cloud.normals, colors, view=view, spacing=radii, hide_reverse=True)
    return np.asarray(picture)[..., :3]


def write_all(places: Places, folder: Path) -> list[str]:
    """Write every picture that the data allows; return their names."""
    folder.mkdir(parents=True, exist_ok=True)
    names = []
    for name, depth, camera in depth_images(places):
        (folder / f"removed-{name}.png").write_bytes(encode_png(before_and_after(depth, camera)))
        names.append(f"removed-{name}.png")
    for row in ("bunny12", "bunny-kinect36", "homer12", "spot12", "fandisk12", "teddy", "rpy", "dog"):
        image = draw_model(places.work / "out" / row / "nacre")
        if image is not None:
            (folder / f"model-{row}.webp").write_bytes(encode_small(image, MAX_BYTES))
            names.append(f"model-{row}.webp")
    return names
