"""A run, as its reports tell of it."""

from __future__ import annotations

import dataclasses
import platform
from collections.abc import Mapping
from typing import Any

import numpy as np

from nacre.depth import PIXEL_LABELS, label_pixels
from nacre.errors import FileFormatError
from nacre.evaluation.result import plain, result_dict
from nacre.frame_report import STATUSES
from nacre.reconstruction.run_record import RunRecord
from nacre.report.data import DepthExample, ModelCloud, ReportData
from nacre.report.limits import MIN_TRACKED
from nacre.report.summary import sigma_statistics, summarize
from nacre.run_data.frame_record import FrameRecord
from nacre.run_data.reported_frame import ReportedFrame
from nacre.run_data.text import label
from nacre.system import __version__


def run_dict(run: RunRecord, *, min_tracked: float = MIN_TRACKED, **more: Any) -> dict[str, Any]:
    """Return what ``report.json`` says of a run."""
    counts = run.counts
    times = run.milliseconds
    told = run_report(run, "", "", interrupted=bool(more.get("interrupted")), min_tracked=min_tracked)
    summary, sigma = summarize(told), None if told.model is None else told.model.sigma
    verdict, bent = summary.verdict, summary.deformation
    figures: dict[str, Any] = plain(
        {
            "nacre": __version__,
            "versions": {
                "nacre": __version__,
                "python": platform.python_version(),
                "numpy": np.__version__,
            },
            **more,
            "verdict": None if verdict is None else dataclasses.asdict(verdict),
            "num_frames": len(run.frames),
            "num_tracked": run.num_tracked,
            **{f"num_{name.lower()}": counts[name] for name in STATUSES[1:]},
            "num_loops": len(run.loops),
            "coverage": run.num_tracked / len(run.frames) if run.frames else None,
            "num_points": len(run.cloud),
            "spacing": run.model.spacing,
            "point_sigma": None if sigma is None else sigma_statistics(sigma),
            "doubled_surfaces": None if told.doubled is None else dataclasses.asdict(told.doubled),
            "deformation": None if bent is None else dataclasses.asdict(bent),
            "noise": dataclasses.asdict(run.model.noise),
            "milliseconds": {
                "mean": times.mean() if len(times) else None,
                "median": np.median(times) if len(times) else None,
                "p99": np.percentile(times, 99) if len(times) else None,
            },
            **{name: result_dict(result) for name, result in run.evaluation.items()},
            "parameters": run.parameters,
            "frames": [frame.figures for frame in told.frames],
        }
    )
    return figures


def run_report(
    run: RunRecord,
    title: str,
    source: str,
    figures: Mapping[str, Any] | None = None,
    *,
    interrupted: bool,
    min_tracked: float = MIN_TRACKED,
    with_depth: bool = False,
) -> ReportData:
    """Return what ``report.html`` says of a run; ``with_depth`` reads some frames again."""
    model, cloud = None, run.cloud
    if len(cloud):
        assert cloud.normals is not None
        more = cloud.attributes
        model = ModelCloud(cloud.points, cloud.normals, cloud.colors, more["confidence"], more["sigma"])
    return ReportData(
        title=title,
        source=source,
        frames=_reported_frames(run),
        camera=run.model.camera,
        model=model,
        depth=_depth_examples(run) if with_depth else (),
        evaluation={label(name): result for name, result in run.evaluation.items()},
        figures=figures or {},
        parameters=run.parameters,
        interrupted=interrupted,
        doubled=None if interrupted else run.doubled_surfaces,  # who stops a run waits for it
        num_dropped=run.num_dropped,
        camera_doubt=run.camera_doubt,
        min_tracked=min_tracked,
    )


def _reported_frames(run: RunRecord) -> list[ReportedFrame]:
    """Return what became of each frame, with what only the whole run knows."""
    errors = _frame_errors(run)
    return [
        ReportedFrame(
            **frame.as_dict()
            | {
                "translation_error": translation,
                "rotation_error": rotation,
                "loop_frame": _loop_frame(run, frame),
            }
        )
        for frame, (translation, rotation) in zip(run.frames, errors, strict=True)
    ]


def _loop_frame(run: RunRecord, frame: FrameRecord) -> int | None:
    """Return the place in the recording of the frame that another closed a loop with."""
    if frame.report is None or frame.report.loop_frame is None:
        return None
    number = frame.report.loop_frame  # of the model, which counts frames that were tried again once more
    found = (f.index for f in run.frames if f.report is not None and f.report.index == number)
    return next(found, None)


def _depth_examples(run: RunRecord) -> list[DepthExample]:
    """Return the depth image of the first frame that was tracked and of the first one that was not."""
    examples = []
    for status in ("TRACKED", "LOST", "WEAK"):
        frame = next((frame for frame in run.frames if frame.status == status), None)
        if frame is None or frame.report is None:
            continue
        try:
            given = run.sequence[frame.index]
        except (FileFormatError, OSError, LookupError):
            continue
        labels = label_pixels(given.depth, run.model.camera, run.model.parameters.depth, mask=given.mask)
        reasons = np.where(labels > 1, labels - 1, 0)
        after = np.where(labels == 0, given.depth, np.nan)
        note = "" if frame.status == "TRACKED" else f"the first that is {frame.status}"
        examples.append(DepthExample(given.depth, after, reasons, PIXEL_LABELS[2:], frame.index, note))
    return examples


def _frame_errors(run: RunRecord) -> list[tuple[float | None, float | None]]:
    ate: Any = run.evaluation.get("absolute_trajectory_error")
    if ate is None:
        return [(None, None)] * len(run.frames)
    return [
        (float(t), float(r)) if np.isfinite(t) else (None, None)
        for t, r in zip(ate.errors, ate.rotation_errors, strict=True)
    ]
