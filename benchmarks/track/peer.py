"""
Run a peer over a recording: ``python -m track.peer NAME RECORDING OUT VOXEL``.

OUT gets what ``nacre reconstruct`` writes, as far as ``nacre evaluate`` reads it.
"""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

import nacre
from track.peers import make


def main(name: str, recording: str, out: str, voxel: str) -> None:
    """Track every frame; one that the peer fails on is lost."""
    sequence = nacre.open_sequence(recording).without_color()
    camera, folder = sequence.camera, Path(out)
    loop: Any = None
    frames: list[dict[str, Any]] = []
    seconds = []
    for index in range(len(sequence)):
        frame = sequence[index]
        depth = np.asarray(frame.depth, np.float32)
        loop = loop or make(name, camera, depth, float(voxel))
        start, reason = time.perf_counter(), ""
        try:
            pose = loop.add(depth)
        except RuntimeError as error:
            pose, reason = None, str(error).splitlines()[0]
        seconds.append(time.perf_counter() - start)
        frames.append(
            {
                "index": index,
                "status": "LOST" if pose is None else "TRACKED",
                "reason": reason,
                "timestamp": frame.timestamp,
                "world_from_camera": None if pose is None else np.asarray(pose).tolist(),
                "truth": None if frame.truth is None else frame.truth.tolist(),
            }
        )
    folder.mkdir(parents=True, exist_ok=True)
    points = loop.points()
    nacre.write_points(folder / "model.ply", points if len(points) else np.zeros((1, 3)))
    report = {
        "title": name,
        "recording": {"path": recording, "camera": camera_document(camera)},
        "milliseconds": {"median": 1e3 * float(np.median(seconds))},
        "has_model": bool(len(points)),
        "frames": frames,
    }
    (folder / "report.json").write_text(json.dumps(report))


def camera_document(camera: Any) -> dict[str, Any]:
    """Return the camera as nacre's reports have it."""
    names = ("model", "width", "height", "pixel_size")
    if camera.model != "orthographic":
        names = ("model", "width", "height", "fx", "fy", "cx", "cy")  # type: ignore[assignment]
    return {key: getattr(camera, key) for key in names}


if __name__ == "__main__":
    main(*sys.argv[1:])
