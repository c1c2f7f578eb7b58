"""
Thin and denoise somebody's scan, and measure what that did.

    python consolidate.py [SCAN.ply]
"""

import sys

import numpy as np
import simulated

import nacre
from nacre.evaluation import uniformity

scan = nacre.read_points(sys.argv[1]) if len(sys.argv) > 1 else simulated.scan()
before = uniformity(scan.points)

# Within ten times the distance between neighbours are some hundreds of points to average over.
spacing = float(np.median(nacre.KdTree(scan.points).query(scan.points, k=2)[0][:, 1]))
thin = nacre.consolidate(scan.points, radius=10 * spacing, num_points=len(scan) // 5, method="wlop+")

after = uniformity(thin.points)
print(f"{len(scan)} points to {len(thin)}, within {10 * spacing:.4g} of each other")
print(f"variation of the spacing {before.coefficient_of_variation:.2f} before, "
      f"{after.coefficient_of_variation:.2f} after (random points: 0.52)")  # fmt: skip
if len(sys.argv) == 1:  # the built-in object is known: how far are the points from its surface?
    pose = nacre.turntable_poses(simulated.THING, 1)[0]
    for name, points in (("before", scan.points), ("after", thin.points)):
        distances = simulated.THING.distance(points @ pose[:3, :3].T + pose[:3, 3])
        print(f"{1000 * np.sqrt(np.mean(distances**2)):.3f} mm from the surface {name}")
nacre.write_points("thin.ply", thin.points, normals=nacre.estimate_normals(thin.points))
