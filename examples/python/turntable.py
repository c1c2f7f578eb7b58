"""
Model an object that turns on a table, before a camera that stands still.

    python turntable.py [RECORDING]
"""

import sys

import simulated

import nacre

frames = nacre.open_sequence(sys.argv[1]) if len(sys.argv) > 1 else list(simulated.turntable())

# The table and the wall do not turn with the object: only the largest thing on a plane is of interest.
model = nacre.Model(frames[0].camera, region={"object": True})
for frame in frames:
    report = model.add_frame(frame.depth, color=frame.color)
    print(f"{report.index:3}  {report.status:11}  overlap {report.overlap:.2f}  {report.num_points} points")

nacre.write_points("object.ply", model.points, normals=model.normals, colors=model.colors)
print(f"{model} in object.ply")
