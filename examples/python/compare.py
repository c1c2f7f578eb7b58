"""
Compare two scans of one thing: bring them together, and find where they differ.

    python compare.py [BEFORE.ply AFTER.ply]
"""

import sys

import numpy as np
import simulated

import nacre

if len(sys.argv) > 2:
    before, after = nacre.read_points(sys.argv[1]).points, nacre.read_points(sys.argv[2]).points
else:  # the second one is turned, and a part of it is missing
    before, after = simulated.scan(0).points, simulated.scan(1).points
    after = after[after[:, 0] < np.quantile(after[:, 0], 0.85)]

found = nacre.align_global(after, before)  # without a first guess
print(found)
if found.status == "not_found":
    sys.exit("the two scans do not fit onto each other")
moved = after @ found.target_from_source[:3, :3].T + found.target_from_source[:3, 3]

distances, _ = nacre.KdTree(moved).query(before)
typical = max(float(np.median(distances)), 1e-6)  # [m]: no scanner knows better
changed = distances > 5 * typical
print(f"typically {typical:.4g} apart; {changed.mean():.0%} of the first scan is more than five times that")
red_where_changed = np.where(changed[:, None], (220, 40, 40), (190, 190, 190)).astype(np.uint8)
nacre.write_points("differences.ply", before, colors=red_where_changed)
