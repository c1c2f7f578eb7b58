"""
Compare how far registrations are off with what they say of themselves.

Simulated cameras go through scenes, as in `other_cameras.py`, whose true poses are exact. From one tracked
frame to the next the motion is off by a twist; twice the covariance that the second frame's `information`
tells is what it should have. The excess is the square of the twist in that measure, by the median that a
Gaussian's would have: 1 where the covariance is right, 4 where deviations are twice as large as it says.

    python benchmarks/covariances.py
"""

from __future__ import annotations

from itertools import product

import numpy as np
import other_cameras
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

import nacre

SCENES = [("flat", 30), ("table", 8), ("shelf", 3), ("spot", 7), ("room", 6)]
SENSORS = ["structured_light", "time_of_flight", "stereo", "phone_lidar"]
FRAMES = 30


def excesses(scene: str, sensor: str, speed: int) -> list[float]:
    """Return that of each tracked frame after a tracked one."""
    case = other_cameras.make(scene, sensor, speed, FRAMES)
    model = nacre.Model(case.camera)
    found: list[float] = []
    before: tuple[np.ndarray, np.ndarray] | None = None
    for depth, truth in zip(case.depths, case.truths, strict=True):
        assert truth is not None  # it is simulated
        report = model.add_frame(depth)
        pose = report.world_from_camera
        if before is not None and report.status == "TRACKED":
            last, last_truth = before
            error = np.linalg.inv(np.linalg.inv(last_truth) @ truth) @ np.linalg.inv(last) @ pose
            to_center = np.eye(4)
            to_center[:3, 3] = -report.center
            off = to_center @ pose @ error @ np.linalg.inv(to_center @ pose)
            twist = np.concatenate([Rotation.from_matrix(off[:3, :3]).as_rotvec(), off[:3, 3]])
            found.append(float(twist @ report.information @ twist) / 2.0 / float(chi2.median(6)))
        before = (pose, truth) if report.status == "TRACKED" else None
    return found


def main() -> None:
    """Print a row for each case, and the median of all."""
    medians = []
    print("| scene | sensor | excess: a tenth | median | nine tenths |\n| --- | --- | --- | --- | --- |")
    for (scene, speed), sensor in product(SCENES, SENSORS):
        low, middle, high = np.quantile(excesses(scene, sensor, speed), [0.1, 0.5, 0.9])
        medians.append(middle)
        print(f"| {scene} | {sensor} | {low:.2f} | {middle:.2f} | {high:.1f} |", flush=True)
    print(f"\nMedian of the medians: {np.median(medians):.1f}, from {min(medians):.1f} to {max(medians):.1f}")


if __name__ == "__main__":
    main()
