"""The page: one self-contained HTML file."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Sequence
from typing import Any, NamedTuple

from nacre._internal.guided import guided
from nacre._internal.kinds import as_kind
from nacre.errors import printable
from nacre.io.atomic import atomic_writer
from nacre.report.charts import status_strip
from nacre.report.data import ReportData
from nacre.report.depth_pictures import draw_depth
from nacre.report.frame_charts import deformation_charts, registration_charts, time_chart, trajectory_charts
from nacre.report.lost_frames import stretches
from nacre.report.pictures import ModelPictures, draw_model
from nacre.report.pixel_counts import pixel_counts, removed_chart
from nacre.report.summary import Summary, summarize
from nacre.report.tables import frame_table, result_tables
from nacre.report.templating import render
from nacre.run_data.reported_frame import ReportedFrame
from nacre.run_data.text import flatten, ranges
from nacre.system import __version__


class Section(NamedTuple):
    """A folded part of the page; ``templates/NAME.html`` shows its content."""

    name: str
    title: str
    lead: str  #: what it holds
    content: Any


@guided()
def write_report(path: str | os.PathLike[str], data: ReportData) -> None:
    """
    Write a reconstruction's report: one HTML file with its pictures inside, without network or script.

    Parameters
    ----------
    path : path-like
        The file to write, usually ``report.html``; its folder must exist. It appears only when it is
        complete.
    data : ReportData
        What to show. Whatever is missing is left out.

    Raises
    ------
    ImportError
        When jinja2 or pillow is missing, with the command that installs it.

    Notes
    -----
    The same data gives the same bytes, 2 MB at most for any number of frames and points. Errors of the poses
    are worked out from ``frames`` where ``evaluation`` holds no trajectory error.
    """
    page = render_page(data)
    with atomic_writer(path) as stream:
        stream.write(page.encode())


def render_page(data: ReportData) -> str:
    """Return the report as HTML text."""
    as_kind("data", data, ReportData, "nacre.report.ReportData, as done.report_data(title=...) makes it")
    summary = summarize(data)
    model = None if data.model is None else draw_model(data.model, data.frames, data.camera)
    page = render(
        "page.html",
        data=data,
        summary=summary,
        model=model,
        states=_states(data.frames),
        sections=_sections(data, summary, model),
        version=__version__,
    )
    return printable(page)


def _sections(data: ReportData, summary: Summary, model: ModelPictures | None) -> list[Section]:
    """Return the folded parts that have something to show."""
    frames = data.frames
    views = "six sides, point spacing, confidence" + ", shape" * bool(model and model.shape)
    path = trajectory_charts(frames, summary.trajectory)
    registration = registration_charts(frames, data.parameters)
    depth = {
        "examples": [(example, draw_depth(example)) for example in data.depth],
        "removed": removed_chart(frames),
    }
    sections = [
        Section("look", "Frames not fused", "where, and why", stretches(frames)),
        Section("model", "Model", views, model),
        Section("deformation", "Deformation", "how the shape was bent", _deformation(data, summary)),
        Section("trajectory", "Trajectory", "path of the camera, errors", path),
        Section("frames", "Registration", "of each frame: inliers, score, residual", registration),
        Section("depth", "Depth cleaning", "images before and after", depth if data.depth else None),
        Section("funnel", "Pixels", "how many were measured, kept and fused", pixel_counts(frames)),
        Section("time", "Time", "of each step in each frame", time_chart(frames)),
        Section("figures", "Evaluation", "all figures", result_tables(data, summary.trajectory)),
        Section("table", "Frames", "a row for each", frame_table(frames)),
        Section("parameters", "Parameters", "all of them", flatten(data.parameters)),
    ]
    return [section for section in sections if section.content]


def _deformation(data: ReportData, summary: Summary) -> dict[str, Any] | None:
    """Return how the model was bent, and where it can be seen to move."""
    if summary.deformation is None:
        return None
    return {
        "figures": summary.deformation,
        "drawn": deformation_charts(data.frames),
        "animation": data.animation,
    }


def _states(frames: Sequence[ReportedFrame]) -> dict[str, Any] | None:
    """Return the statuses of all frames, in the order in which they came."""
    if len(frames) < 2:
        return None
    states = [frame.status for frame in frames]
    counts = Counter(states)
    shown = [(name, counts[name]) for name in ("TRACKED", "RELOCALISED", "WEAK", "LOST") if counts[name]]
    lost = [frame.index for frame in frames if frame.status == "LOST"]
    words = ", ".join(f"{num} {name}" for name, num in shown) + (f"; lost: {ranges(lost)}" if lost else "")
    return {"paths": status_strip(states), "counts": shown, "in_words": words}
