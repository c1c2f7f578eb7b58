"""What a run says when it is done."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from nacre.cli.terminal import CommandError

if TYPE_CHECKING:
    from nacre.reconstruction import Reconstruction


def trajectory_rows(done: Reconstruction) -> list[tuple[str, str]]:
    """Return what a person wants to know of a run, in words."""
    import numpy as np

    from nacre.report.summary import told_trajectory_error
    from nacre.run_data.text import count, quantity

    counts = {name.lower(): number for name, number in done.counts.items() if number and name != "TRACKED"}
    extra = f" ({', '.join(f'{number} {name}' for name, number in counts.items())})" if counts else ""
    rows = [
        ("frames tracked", f"{count(done.num_tracked)} of {count(len(done.frames))}{extra}"),
        ("model", f"{count(len(done.cloud))} points, {quantity(done.model.spacing, 'm')} apart"),
    ]
    if done.loops:
        last = done.loops[-1]
        rows.append(("loops closed", f"{len(done.loops)}, the last at frame {last.index}"))
    ate: Any = done.evaluation.get("absolute_trajectory_error")
    if ate is not None:
        error, of = told_trajectory_error(ate)
        rows.append(("trajectory error", f"{error}: {of}" if error == "not known" else f"{error} {of} (ATE)"))
    rpe: Any = done.evaluation.get("relative_pose_error")
    if rpe is not None and rpe.num_pairs:
        text = f"{quantity(rpe.translation_rmse, 'm')}, {quantity(rpe.rotation_rmse, 'rad')}"
        rows.append(
            (
                "drift per frame",
                f"{text} RMSE over {count(rpe.num_pairs)} pair{'s' * (rpe.num_pairs > 1)} (RPE)",
            )
        )
    times = done.milliseconds
    if len(times):
        slow = quantity(float(np.percentile(times, 99)), "ms")
        rows.append(
            ("time per frame", f"{quantity(float(np.median(times)), 'ms')} (median; 99 % within {slow})")
        )
    return rows


def verdict_rows(report: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Return the verdict that report.json holds, what else was found, and how well the points are known."""
    from nacre.report.summary import noise_alone
    from nacre.run_data.text import quantity

    rows = []
    verdict, spread = report["verdict"], report["point_sigma"]
    if verdict is not None:
        rows.append(("verdict", verdict["sentence"]))
        rows += [("", f"{found['word']}: {found['statement']}.") for found in verdict["findings"][1:]]
        if verdict["next_step"]:
            rows.append(("next", verdict["next_step"]))
    if spread is not None:
        median, p95 = (quantity(spread[name], "m") for name in ("median", "p95"))
        is_bent = bool((report.get("deformation") or {}).get("num_bent"))
        counted = noise_alone(is_bent=is_bent)
        label = "noise of points" if is_bent else "points known to"
        rows.append((label, f"{median} (standard deviation {counted}: median; for 95 % at most {p95})"))
    return rows


def require_tracked(done: Reconstruction, min_tracked: float, advice: str = "") -> None:
    """Raise where too few frames were tracked of a run whose results are written all the same."""
    num_tracked, total = done.num_tracked, len(done.frames)
    if num_tracked >= min_tracked * total:
        return
    from nacre.report.lost_frames import most_common_reason

    reason = most_common_reason(frame.reason for frame in done.frames if frame.status == "LOST")
    told = "every frame was lost"
    if num_tracked:
        told = f"only {num_tracked} of {total} frames were tracked, less than {min_tracked:g} of them"
    raise CommandError(f"{told}: {reason}{advice}", 3)


def file_rows(folder: Path, *, page: bool = True) -> list[tuple[str, str]]:
    """Return where the files are."""
    return [
        ("model", str(folder / "model.ply")),
        *([("as it moved", str(folder / "animation.glb"))] if (folder / "animation.glb").exists() else []),
        *([("trajectory", str(folder / "trajectory.txt"))] if (folder / "trajectory.txt").exists() else []),
        ("figures", str(folder / "report.json")),
        *([("report", str(folder / "report.html"))] if page else []),
    ]
