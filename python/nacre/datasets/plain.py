"""
The plain recording: camera.json, depth/; color/, mask/, confidence/, groundtruth.txt, timestamps.txt if any.

Colour images, masks (black: not used) and how sure the camera is of its pixels (0 to 255; 0: not used) have
the stems of the depth images, as have images of anything else that pixels have, in attributes/NAME/.

``timestamps.txt`` has one time [s] for each depth image, in name order. Without it the time is its index.
"""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre._internal import arrays
from nacre._internal.guided import guided
from nacre._internal.kinds import as_items
from nacre.camera import Camera
from nacre.datasets.listing import describe, files, require_order
from nacre.datasets.overrides import Overrides
from nacre.datasets.sequence import FrameSource, Sequence
from nacre.datasets.tum import lines_of, read_truth, time_of
from nacre.errors import FileFormatError
from nacre.io.atomic import atomic_writer
from nacre.io.cameras import write_camera
from nacre.io.images import (
    ATTRIBUTE_SUFFIXES,
    COLOR_SUFFIXES,
    DEPTH_SUFFIXES,
    write_color_png,
    write_depth_png,
)
from nacre.io.raw import excerpt
from nacre.io.trajectories import write_trajectory

FORMAT = "plain"
LAYOUT = "camera.json and depth/, optionally color/, mask/, confidence/, groundtruth.txt and timestamps.txt"

_LARGEST_STORED = 65534


def recognise(folder: Path) -> bool:
    """Say whether a folder looks like this format."""
    return (folder / "camera.json").is_file()


def read(folder: Path, given: Overrides) -> Sequence:
    """Open a folder of this format."""
    if (folder / "camera.json").is_file():
        given = given.filled_from(folder / "camera.json")
    camera, depth_scale = given.required(folder, "a plain recording says it in camera.json")
    depth = files(folder / "depth", DEPTH_SUFFIXES)
    if not depth:
        raise FileFormatError(
            folder, f"a plain recording needs depth images in depth/; the folder holds {describe(folder)}"
        )
    colors = {path.stem: path for path in files(folder / "color", COLOR_SUFFIXES)}
    masks = {path.stem: path for path in files(folder / "mask", COLOR_SUFFIXES)}
    confidence = {path.stem: path for path in files(folder / "confidence", COLOR_SUFFIXES)}
    attributes = {
        inside.name: {path.stem: path for path in files(inside, ATTRIBUTE_SUFFIXES)}
        for inside in sorted((folder / "attributes").glob("*/"))
    }
    timestamps = _read_timestamps(folder / "timestamps.txt", len(depth))
    times = np.arange(len(depth), dtype=np.float64) if timestamps is None else timestamps
    truth, poses = read_truth(folder / "groundtruth.txt", times, given.max_difference)
    return Sequence(
        folder,
        format=FORMAT,
        camera=camera,
        depth_scale=depth_scale,
        sources=[
            FrameSource(
                i,
                path,
                colors.get(path.stem),
                None if timestamps is None else float(times[i]),
                poses[i],
                masks.get(path.stem),
                {name: images[path.stem] for name, images in attributes.items() if path.stem in images},
                confidence.get(path.stem),
            )
            for i, path in enumerate(depth)
        ],
        truth=truth,
    )


@guided(
    "it is write_recording(path, camera, depth_images, depth_scale=...); a Sequence has its camera, its "
    "depth_scale and frames with depth"
)
def write_recording(
    path: str | os.PathLike[str],
    camera: Camera,
    depth_images: Iterable[npt.ArrayLike],
    *,
    depth_scale: float,
    colors: Iterable[npt.ArrayLike] | None = None,
    poses: Iterable[npt.ArrayLike] | None = None,
    timestamps: Iterable[float] | None = None,
) -> int:
    """
    Write a plain recording: ``camera.json``, ``depth/000000.png`` and so on, as 16-bit PNG.

    All iterables are read one view at a time, so a recording may be longer than memory. ``camera.json`` comes
    last: a recording that was cut short is not taken for a whole one.

    Parameters
    ----------
    path : path-like
        The folder; it is made where it does not exist. A recording that is already there is not touched.
    camera : Camera
        The depth camera.
    depth_images : iterable of (H, W) arrays
        At least one. Metres; 0, negative and not finite values mean no measurement.
    depth_scale : float
        Stored units per metre. The depth is rounded to the nearest unit.
    colors : iterable of (H, W, 3) arrays, optional
        RGB, integers from 0 to 255 or floats from 0 to 1, one for each depth image.
    poses : iterable of (4, 4) arrays, optional
        True ``world_from_camera``, one for each depth image.
    timestamps : iterable of float, optional
        Seconds, one for each depth image.

    Returns
    -------
    int
        How many views were written.

    Raises
    ------
    ValueError
        A depth does not fit 16 bits at this ``depth_scale``, an image has not the camera's size, the
        iterables have different lengths, or there is no image.
    FileExistsError
        The folder holds a recording already.
    """
    folder = Path(path)
    arrays.as_camera("camera", camera)
    depth_scale = arrays.as_scale("depth_scale", depth_scale)
    require_no_recording(folder)

    given = {"depth_images": depth_images, "colors": colors, "poses": poses, "timestamps": timestamps}
    iterators = {name: iter(as_items(name, values)) for name, values in given.items() if values is not None}
    view = _next_view(iterators, 0)
    if not view:
        raise ValueError("depth_images must have at least one image, got none")
    (folder / "depth").mkdir(parents=True, exist_ok=True)
    if colors is not None:
        (folder / "color").mkdir(exist_ok=True)
    times: list[float] = []
    truth: list[npt.NDArray[np.float64]] = []
    index = 0
    while view:
        write_depth_png(
            folder / "depth" / f"{index:06d}.png", _stored(view["depth_images"], camera, depth_scale, index)
        )
        if "colors" in view:
            color = arrays.as_colors(f"colors[{index}]", view["colors"], (camera.height, camera.width, 3))
            write_color_png(folder / "color" / f"{index:06d}.png", color)
        times.append(arrays.as_number(f"timestamps[{index}]", view.get("timestamps", index)))
        if "poses" in view:
            truth.append(arrays.as_pose(f"poses[{index}]", view["poses"]))
        index += 1
        view = _next_view(iterators, index)

    if poses is not None:
        write_trajectory(folder / "groundtruth.txt", times, truth)
    if timestamps is not None:
        with atomic_writer(folder / "timestamps.txt") as stream:
            stream.write("".join(f"{time!r}\n" for time in times).encode())
    write_camera(folder / "camera.json", camera, depth_scale)
    return index


def require_no_recording(folder: Path) -> None:
    """Raise where a folder holds a recording already."""
    if (folder / "camera.json").exists() or any(folder.glob("depth/*")):
        raise FileExistsError(f"{folder} holds a recording already; give another folder or remove it first")


def _next_view(iterators: dict[str, Any], index: int) -> dict[str, Any]:
    """Return one item of each iterator, or {} when all of them end together."""
    view = {}
    for name, iterator in iterators.items():
        try:
            view[name] = next(iterator)
        except StopIteration:
            continue
    if view and len(view) < len(iterators):
        short = next(name for name in iterators if name not in view)
        raise ValueError(f"{short} must have one item for each view, but it ends after {index}")
    return view


def _stored(depth: Any, camera: Camera, depth_scale: float, index: int) -> npt.NDArray[np.uint16]:
    name, shape = f"depth_images[{index}]", (camera.height, camera.width)
    metres = arrays.as_rows(arrays.as_real(name, depth), np.float64)
    if metres.shape != shape:
        raise ValueError(f"{name} must have the camera's shape {shape}, got {metres.shape}")
    valid = np.isfinite(metres) & (metres > 0)
    with np.errstate(over="ignore"):
        units = np.rint(np.where(valid, metres, 0.0) * depth_scale)
    if units.max() > _LARGEST_STORED:
        raise ValueError(
            f"{name} must fit 16 bits at depth_scale={depth_scale:g} "
            f"(at most {_LARGEST_STORED / depth_scale:g} m), got {metres[valid].max():g} m; "
            f"give a smaller scale"
        )
    if (units[valid] == 0).any():
        raise ValueError(
            f"{name} must not round to 0 (no measurement) at depth_scale={depth_scale:g}, got "
            f"{metres[valid].min():g} m; give a larger scale"
        )
    return units.astype(np.uint16)


def _read_timestamps(path: Path, count: int) -> npt.NDArray[np.float64] | None:
    if not path.is_file():
        return None
    times: list[float] = []
    for number, line in lines_of(path):
        time = time_of(line)
        if not np.isfinite(time):
            reason = f"expected a time in seconds, a finite number, got {excerpt(line.encode())}"
            raise FileFormatError(path, reason, line=number)
        require_order(path, number, time, times[-1] if times else None)
        times.append(time)
    if len(times) != count:
        raise FileFormatError(
            path, f"expected {count} finite times, one for each depth image, got {len(times)}"
        )
    return np.array(times)
