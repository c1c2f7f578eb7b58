"""The files of ``OUT/``."""

from __future__ import annotations

import base64
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from nacre.cli.terminal import to_json

if TYPE_CHECKING:
    from nacre.reconstruction import Reconstruction


def write_results(
    folder: Path,
    done: Reconstruction,
    *,
    title: str,
    source: str,
    document: Mapping[str, Any],
    figures: Mapping[str, Any] | None = None,
) -> dict[str, Any]:
    """Write model.ply, trajectory.txt, report.html and report.json; return what the last one holds."""
    import nacre
    from nacre.io.atomic import atomic_writer
    from nacre.report import write_report

    model = done.model
    nacre.write_points(
        folder / "model.ply",
        model.points,
        normals=model.normals,
        colors=model.colors,
        attributes={"confidence": model.confidence},
        comments=[f"nacre {nacre.__version__}", "metres; the world is the first camera's frame"],
    )
    trajectory = done.trajectory
    nacre.write_trajectory(folder / "trajectory.txt", trajectory.timestamps, trajectory.poses)
    write_report(folder / "report.html", done.report_data(title, source, figures))
    report = done.as_dict(title=title, source=source, **document)
    with atomic_writer(folder / "report.json") as stream:
        stream.write((to_json(report) + "\n").encode())
    return report


def write_pictures(folder: Path, done: Reconstruction) -> None:
    """Write PNG pictures of the model from its sides, and of a depth image before and after cleaning."""
    from nacre.io.atomic import atomic_writer
    from nacre.report.pictures import draw_depth, draw_model

    data = done.report_data("", "")
    pictures = {}
    if data.model is not None and (model := draw_model(data.model, data.frames)) is not None:
        pictures["model"] = model.main
        pictures |= {f"model-{p.caption.lower().replace(' ', '-')}": p for p in (*model.cameras, *model.sides)}
    if data.depth is not None:
        names = ("depth-before", "depth-removed", "depth-after")
        pictures |= dict(zip(names, draw_depth(data.depth).pictures, strict=True))
    folder.mkdir(exist_ok=True)
    for name, picture in pictures.items():
        with atomic_writer(folder / f"{name}.png") as stream:
            stream.write(base64.b64decode(picture.uri.partition(",")[2]))


def trajectory_rows(done: Reconstruction) -> list[tuple[str, str]]:
    """Return what a person wants to know of a run, in words."""
    import numpy as np

    from nacre.report.text import count, quantity

    counts = {name.lower(): number for name, number in done.counts.items() if number and name != "TRACKED"}
    extra = f" ({', '.join(f'{number} {name}' for name, number in counts.items())})" if counts else ""
    rows = [
        ("frames tracked", f"{done.num_tracked} of {len(done.frames)}{extra}"),
        ("model", f"{count(len(done.model))} points, {quantity(done.model.spacing, 'm')} apart"),
    ]
    ate: Any = done.evaluation.get("absolute_trajectory_error")
    if ate is not None and ate.num_compared:
        rows.append(("trajectory error", f"{quantity(ate.rmse, 'm')} RMS, {quantity(ate.max, 'm')} at most (ATE)"))
    rpe: Any = done.evaluation.get("relative_pose_error")
    if rpe is not None and rpe.num_pairs:
        text = f"{quantity(rpe.translation_rmse, 'm')}, {quantity(rpe.rotation_rmse, 'rad')}"
        rows.append(("drift per frame", f"{text} RMS (RPE)"))
    times = done.milliseconds
    if len(times):
        slow = quantity(float(np.percentile(times, 99)), "ms")
        rows.append(("time per frame", f"{quantity(float(np.median(times)), 'ms')} (median; 99 % within {slow})"))
    return rows


def file_rows(folder: Path) -> list[tuple[str, str]]:
    """Return where the files are."""
    return [
        ("model", str(folder / "model.ply")),
        ("trajectory", str(folder / "trajectory.txt")),
        ("figures", str(folder / "report.json")),
        ("report", str(folder / "report.html")),
    ]
