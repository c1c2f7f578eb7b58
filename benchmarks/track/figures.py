"""The figures of the table, from what ``nacre evaluate`` prints and the report of the run."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

TAU = 0.003


@dataclass(frozen=True)
class Figure:
    """Where a figure of the table is found, and how it is shown: value times factor, to so many digits."""

    name: str
    head: str
    path: str
    factor: float = 1.0
    digits: int = 2


FIGURES = [
    Figure("frames", "frames", "frames.num_frames", digits=0),
    Figure("tracked", "tracked", "frames.num_tracked", digits=0),
    Figure("relocalised", "relocalised", "frames.num_relocalised", digits=0),
    Figure("weak", "weak", "frames.num_weak", digits=0),
    Figure("lost", "lost", "frames.num_lost", digits=0),
    Figure("claimed", "claimed", "", digits=0),
    Figure("right", "right", "", digits=0),
    Figure("wrong", "wrong", "", digits=0),
    Figure("far", "far off", "", digits=0),
    Figure("rotation", "greatest rotation error [deg]", "pose_error.rotation_max", math.degrees(1), 3),
    Figure("translation", "greatest shift at the object [mm]", "pose_error.translation_max", 1e3, 3),
    Figure("final_rotation", "final rotation error [deg]", "pose_error.rotation_final", math.degrees(1), 3),
    Figure("final_translation", "final shift [mm]", "pose_error.translation_final", 1e3, 3),
    Figure("ate", "ATE RMSE [mm]", "absolute_trajectory_error.rmse", 1e3, 1),
    Figure("ate_max", "ATE, greatest [mm]", "absolute_trajectory_error.max", 1e3, 1),
    Figure("rpe", "RPE [mm]", "relative_pose_error.translation_rmse", 1e3, 1),
    Figure("rpe_rotation", "RPE [deg]", "relative_pose_error.rotation_rmse", math.degrees(1), 2),
    Figure("rms", "model RMS [mm]", "surface_accuracy.rms", 1e3, 3),
    Figure("bias", "bias [mm]", "surface_accuracy.bias", 1e3, 3),
    Figure("complete", "seen surface covered [%]", "completeness.fraction.0", 100, 1),
    Figure("cov", "NN CoV", "uniformity.coefficient_of_variation", 1, 3),
    Figure("points", "points", "uniformity.num_points", digits=0),
    Figure("more_points", "more points than at frame 400 [%]", "", digits=1),
    Figure("more_time", "more time a frame than in turns 3 to 7 [%]", "", digits=1),
    Figure("more_memory", "more memory than at frame 400 [MB]", "", digits=1),
    Figure("milliseconds", "ms a frame", "run.milliseconds", digits=1),
    Figure("processor", "CPU s", "run.processor", digits=1),
]
BY_NAME = {figure.name: figure for figure in FIGURES}


def collect(evaluation: Mapping[str, Any], out: Path, processor: float) -> dict[str, Any]:
    """Return the figures of a contender by name, in the table's units; unknown ones are left out."""
    report = json.loads((out / "report.json").read_text())
    status = [frame["status"] for frame in report["frames"]]
    counts = {
        f"num_{name}": status.count(name.upper()) for name in ("tracked", "relocalised", "weak", "lost")
    }
    known = {
        "frames": {"num_frames": len(status), **counts},
        **evaluation,
        "run": {"milliseconds": report["milliseconds"]["median"], "processor": processor},
    }
    found = {figure.name: _value(known, figure) for figure in FIGURES}
    return {name: value for name, value in found.items() if value is not None}


def _value(known: Any, figure: Figure) -> float | None:
    for step in figure.path.split("."):
        if isinstance(known, list):
            known = known[int(step)]
        elif isinstance(known, Mapping) and step in known:
            known = known[step]
        else:
            return None
    return None if known is None else known * figure.factor
