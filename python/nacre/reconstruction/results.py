"""The files of ``OUT/``."""

from __future__ import annotations

import base64
import re
from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from nacre.io.atomic import atomic_writer
from nacre.io.json_files import to_json
from nacre.io.points import write_points
from nacre.io.trajectories import write_trajectory
from nacre.reconstruction.animation import write_model_animation
from nacre.reconstruction.comments import file_comments
from nacre.run_data.motion import write_model_motion

if TYPE_CHECKING:
    from nacre.reconstruction.reconstruction import Reconstruction

_ANIMATION = "animation.glb"
_PICTURE_NAMES = {
    "the-model": "model",
    "as-measured": "depth-before",
    "what-was-removed": "depth-removed",
    "as-used": "depth-after",
}


def write_results(
    folder: Path,
    done: Reconstruction,
    *,
    title: str,
    source: str,
    document: Mapping[str, Any],
    figures: Mapping[str, Any] | None = None,
    pictures: bool = False,
    page: bool = True,
    min_tracked: float = 0.5,
) -> dict[str, Any]:
    """
    Write the files of a run, the page if wanted, and return what report.json, the last one, holds.

    How what bends moved is written, too, of a mesh and of the points, when the run is finished. There is no
    trajectory where no frame was tracked.
    """
    comments = file_comments(done)
    write_points(folder / "model.ply", done.cloud, comments=comments)
    if len(done.trajectory):
        write_trajectory(folder / "trajectory.txt", done.trajectory)
    else:
        (folder / "trajectory.txt").unlink(missing_ok=True)  # of an earlier model
    interrupted = bool(document.get("interrupted"))
    write_animation = partial(write_model_animation, comments=comments)
    for name, write in ((_ANIMATION, write_animation), ("motion.npz", write_model_motion)):
        if done.model.parameters.deform and not interrupted:
            write(folder / name, done.model, done.frames, all_points=done.all_points)
        else:
            (folder / name).unlink(missing_ok=True)  # of an earlier model
    if page:
        from nacre.report import render_page

        data = done.report_data(title, source, figures, interrupted=interrupted, min_tracked=min_tracked)
        animation = _ANIMATION if (folder / _ANIMATION).exists() else ""
        text = render_page(replace(data, animation=animation))
        _write(folder / "report.html", text.encode())
        if pictures:
            _write_pictures(folder / "pictures", text)
    else:
        (folder / "report.html").unlink(missing_ok=True)  # of an earlier model
    report = done.as_dict(title=title, source=source, min_tracked=min_tracked, **document)
    _write(folder / "report.json", (to_json(report) + "\n").encode())
    return report


def _write(path: Path, data: bytes) -> None:
    with atomic_writer(path) as stream:
        stream.write(data)


def _write_pictures(folder: Path, page: str) -> None:
    """Write the pictures that a page holds as PNG files, as they are named there."""
    from nacre.pictures.image_files import as_png

    folder.mkdir(exist_ok=True)
    pattern = r'<img src="data:image/webp;base64,([^"]+)"[^>]* data-name="([^"]+)"'
    for data, name in reversed(re.findall(pattern, page)):  # of pictures of one name the first stays
        _write(folder / f"{_PICTURE_NAMES.get(name, name)}.png", as_png(base64.b64decode(data)))


def depth_rows(done: Reconstruction) -> list[tuple[str, str]]:
    """Return what there is to tell of a systematic error of the depth that was corrected."""
    if not done.model.corrects_depth:
        return []
    found = done.model.depth_calibration
    assert found is not None
    return [("depth corrected", f"its inverse is tilted by {found.tilt:.4f} ± {found.sigma:.4f} per metre")]
