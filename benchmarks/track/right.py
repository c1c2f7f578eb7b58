"""How many of the frames that a contender claims are right: the same for nacre and its peers."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
from cases import RIGHT_SHIFT, RIGHT_TURN, best_fit, middle_depth

import nacre
from track.rows import Figures


def right_frames(recording: Path, out: Path) -> Figures:
    """
    Compare the claimed poses with the truth, after the rigid motion that makes most of them right.

    ``far`` are those more than 10 degrees or a tenth of the median depth off.
    """
    frames = json.loads((out / "report.json").read_text())["frames"]
    claimed = [frame for frame in frames if frame["status"] in ("TRACKED", "RELOCALISED")]
    known = [frame for frame in claimed if frame["truth"] is not None]
    figures: Figures = {"claimed": len(claimed)}
    if not known:
        return figures
    sequence = nacre.open_sequence(recording).without_color()
    depth = middle_depth([sequence[i].depth for i in range(0, len(sequence), max(1, len(sequence) // 20))])
    poses, truths = (np.array([frame[key] for frame in known]) for key in ("world_from_camera", "truth"))
    _, shifts, turns = best_fit(poses, truths, RIGHT_SHIFT * depth, RIGHT_TURN)
    right = int(np.sum((shifts < RIGHT_SHIFT * depth) & (turns < RIGHT_TURN)))
    far = int(np.sum((shifts > 0.1 * depth) | (turns > 10.0)))
    return {**figures, "right": right, "wrong": len(known) - right, "far": far}
