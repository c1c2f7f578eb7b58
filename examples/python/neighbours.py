"""
Use nacre's k-d tree in place of SciPy's.

    python neighbours.py [POINTS.ply]
"""

import sys
import time

import numpy as np
import simulated

import nacre

points = nacre.read_points(sys.argv[1]).points if len(sys.argv) > 1 else simulated.scan(0, 200_000).points

start = time.perf_counter()
distances, indices = nacre.KdTree(points).query(points, k=16)
print(f"nacre: {time.perf_counter() - start:.3f} s for 16 neighbours of {len(points)} points")

try:
    from scipy.spatial import cKDTree
except ImportError:
    sys.exit("SciPy is not here to compare with: pip install scipy")
start = time.perf_counter()
expected, _ = cKDTree(points).query(points, k=16, workers=-1)
print(f"SciPy: {time.perf_counter() - start:.3f} s")
print(f"largest difference of a distance: {np.abs(distances - expected).max():.1g}")
