"""
Merge the frames of a RealSense recording (record one with realsense-viewer).

    python realsense.py [RECORDING.bag]
"""

import sys

import simulated

import nacre

frames = nacre.open_sequence(sys.argv[1]) if len(sys.argv) > 1 else list(simulated.hand_held(12))
model = nacre.Model(frames[0].camera, depth={"noise": "stereo", "max_depth": 2.0})
for frame in frames:
    print(model.add_frame(frame.depth, color=frame.color, timestamp=frame.timestamp))
nacre.write_points("merged.ply", model.points, normals=model.normals, colors=model.colors)
