"""
Model what a camera saw on its way around, and say where it was lost.

    python hand_held.py [RECORDING]
"""

import sys

import simulated

import nacre
from nacre.evaluation import AbsoluteTrajectoryError
from nacre.reconstruction import FrameRecord


def tell(frame: FrameRecord) -> bool:
    """Say what became of a frame; False would end the run here, with what there is."""
    if frame.status != "TRACKED":
        print(f"frame {frame.index}: {frame.status} {frame.reason}")
    return True


source = sys.argv[1] if len(sys.argv) > 1 else list(simulated.hand_held())
done = nacre.reconstruct(source, progress=tell)

print(f"{done.num_tracked} of {len(done.frames)} frames tracked, {len(done.loops)} loops closed")
error = done.evaluation.get("absolute_trajectory_error")  # where the recording knows the truth
if isinstance(error, AbsoluteTrajectoryError):
    print(f"the camera is {1000 * error.rmse:.2f} mm from where it was (RMS)")
nacre.write_points("scan.ply", done.model.points, normals=done.model.normals, colors=done.model.colors)
nacre.write_trajectory("trajectory.txt", done.trajectory.timestamps, done.trajectory.poses)
print(f"{done.model} in scan.ply, the camera's way in trajectory.txt")
