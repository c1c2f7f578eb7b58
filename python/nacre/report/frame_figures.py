"""A frame of a run, as the written report tells of it."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from nacre.frame_report import FrameReport
    from nacre.reconstruction.frame_record import FrameRecord
    from nacre.report import FrameEntry


def _removed(report: FrameReport | None) -> dict[str, int]:
    if report is None:
        return {}
    depth = dataclasses.asdict(report.depth)
    removed = {
        name.removeprefix("num_"): count
        for name, count in depth.items()
        if name not in ("num_pixels", "num_invalid", "num_kept")
    }
    return {**removed, "outside": report.region.num_outside}


def frame_dict(
    frame: FrameRecord,
    translation_error: float | None,
    rotation_error: float | None,
    loop_frame: int | None,
) -> dict[str, Any]:
    """Return what ``report.json`` says of a frame."""
    report = frame.report
    figures: dict[str, Any] = {
        "index": frame.index,
        "status": frame.status,
        "reason": frame.reason,
        "timestamp": frame.timestamp,
        "world_from_camera": frame.world_from_camera,
        "truth": frame.truth,
        "translation_error": translation_error,
        "rotation_error": rotation_error,
    }
    for name in (
        "num_inliers", "overlap", "consistency", "evidence", "rmse", "weak_directions", "loop_distance",
        "num_updated", "num_inserted", "num_removed", "num_points", "spacing", "milliseconds",
    ):  # fmt: skip
        figures[name] = None if report is None else getattr(report, name)
    figures["loop_frame"] = loop_frame
    figures["depth"] = None if report is None else dataclasses.asdict(report.depth)
    figures["region"] = None if report is None else dataclasses.asdict(report.region)
    figures["removed"] = _removed(report)
    return figures


def frame_entry(
    frame: FrameRecord,
    translation_error: float | None,
    rotation_error: float | None,
    loop_frame: int | None,
) -> FrameEntry:
    """Return what ``report.html`` says of a frame."""
    from nacre.report import FrameEntry

    report = frame.report
    return FrameEntry(
        index=frame.index,
        status=frame.status,
        reason=frame.reason,
        milliseconds={} if report is None else report.milliseconds,
        num_inliers=None if report is None else report.num_inliers,
        overlap=None if report is None else report.overlap,
        rmse=None if report is None or not np.isfinite(report.rmse) else report.rmse,
        world_from_camera=frame.world_from_camera,
        truth=frame.truth,
        translation_error=translation_error,
        rotation_error=rotation_error,
        consistency=None if report is None else report.consistency,
        evidence=None if report is None else report.evidence,
        num_points=None if report is None else report.num_points,
        num_pixels=None if report is None else report.depth.num_pixels,
        num_measured=None if report is None else report.depth.num_pixels - report.depth.num_invalid,
        removed=_removed(report),
        num_updated=None if report is None else report.num_updated,
        num_inserted=None if report is None else report.num_inserted,
        loop_frame=loop_frame,
    )
