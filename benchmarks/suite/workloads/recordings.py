"""The loop on real recordings, beside loops and odometries of peers."""

from __future__ import annotations

import itertools
import os
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np

from suite.workload import Arrays, Contender, Lap, Run, Workload
from suite.workloads.loop import COMPOSED, check

FRAMES = 40
DATA = "NACRE_BENCHMARK_DATA"
"""The environment variable that names the folder of real recordings."""
VOXELS = {
    "tum-fr3-teddy": 0.01,
    "tum-fr1-rpy": 0.008,
    "d435-t265-shelf": 0.01,
    "realsense-robot-objects": 0.003,
}
"""Grids of the peers' models [m]."""


@cache
def recorded(name: str, voxel: float) -> dict[str, Any]:
    """Return a real recording; the first frame is given."""
    import nacre

    known = (frame for frame in nacre.open_sequence(Path(os.environ[DATA]) / name) if frame.truth is not None)
    sequence = list(itertools.islice(known, FRAMES + 1))
    camera = sequence[0].camera
    frames = np.array([np.asarray(frame.depth, np.float32) for frame in sequence])
    poses = np.array([frame.truth for frame in sequence])
    arrays = {
        "given": frames[:1],
        "given poses": poses[:1],
        "frames": frames[1:],
        "poses": poses[1:],
        "intrinsics": np.array([[camera.fx, 0, camera.cx], [0, camera.fy, camera.cy], [0, 0, 1]]),
        "spacing": np.array(0.0),
        "voxel": np.array(voxel),
    }
    if all(frame.color is not None for frame in sequence):
        colors = np.array([frame.color for frame in sequence])
        arrays |= {"given colors": colors[:1], "colors": colors[1:]}
    return arrays


def odometry(arrays: Arrays, threads: int, name: str) -> Run:
    """Take a peer's odometry from image to image, by depth alone."""
    from track import peers

    from nacre import Camera

    matrix, frames = arrays["intrinsics"], arrays["frames"]
    height, width = frames.shape[1:]
    camera = Camera(width, height, matrix[0, 0], matrix[1, 1], matrix[0, 2], matrix[1, 2])
    loop = peers.make(name, camera, arrays["given"][0])
    loop.add(arrays["given"][0])

    def run(lap: Lap) -> Arrays:
        found = [loop.add(depth) for depth in frames]
        lap("odometry")
        tracked = np.array([pose is not None for pose in found])
        poses = [arrays["given poses"][0]]
        for pose in found:
            poses.append(poses[-1] if pose is None else poses[0] @ pose)
        return {"poses": np.array(poses[1:]), "tracked": tracked, "points": loop.points()}

    return run


CONTENDERS = [
    *COMPOSED,
    Contender("Open3D", partial(odometry, name="open3d_odometry"), "odometry of depth, no model"),
    Contender("OpenCV", partial(odometry, name="opencv_odometry"), "odometry of depth, no model"),
]
WORKLOADS = [
    Workload(
        name=f"loop-{name}",
        title=f"The loop, the recording {name}: a frame",
        items=50_000,
        data=partial(recorded, name, voxel),
        contenders=CONTENDERS,
        check=check,
        limits={},
        goal=1,
        steps=FRAMES,
        quick=False,
        most_threads_only=True,
        note=f"Its first {FRAMES + 1} frames with a true pose; nacre has colours, too, where there are any.",
    )
    for name, voxel in VOXELS.items()
    if DATA in os.environ and (Path(os.environ[DATA]) / name).is_dir()
]
