"""Small pictures of the models of a batch, ``OUT/thumbnails/NAME.webp``."""

from __future__ import annotations

from pathlib import Path

from nacre.io.atomic import atomic_writer
from nacre.io.points import read_points
from nacre.reconstruction.batch.sources import thumbnail_path
from nacre.report.data import ModelCloud
from nacre.report.pictures import draw_thumbnail
from nacre.run_data.saved_run import SavedRun


def write_thumbnail(folder: Path) -> None:
    """Draw the model of a finished reconstruction, unless there is a picture of it already."""
    path, model = thumbnail_path(folder), folder / "model.ply"
    if path.is_file() and path.stat().st_mtime >= model.stat().st_mtime:
        return
    cloud = read_points(model)
    run = SavedRun(folder)
    confidence = cloud.attributes.get("confidence")
    shown = ModelCloud(cloud.points, cloud.normals, cloud.colors, confidence)
    data = draw_thumbnail(shown, run.frames, run.camera)
    if data is None:
        path.unlink(missing_ok=True)
        return
    path.parent.mkdir(exist_ok=True)
    with atomic_writer(path) as stream:
        stream.write(data)
