"""Memory is bounded, whatever the number of points."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hills import write

import nacre

PROGRAM = """
import re, sys
from nacre import out_of_core
source, output = sys.argv[1:]
out_of_core.estimate_normals(source, output, points_per_cell=100_000, memory="500MB")
print(re.search(r"VmHWM:\\s+(\\d+)", open("/proc/self/status").read())[1])
"""


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="the system does not tell it")
def test_memory_stays_the_same_for_more_points(tmp_path: Path) -> None:
    """Peak memory of 1.8 million points is that of 0.6 million, and within the bound."""
    peaks = []
    for count in (600_000, 1_800_000):
        xy = np.random.default_rng(0).uniform(0, np.sqrt(count) / 10, (count, 2))
        points = np.column_stack([xy, np.sin(xy[:, 0])]).astype(np.float32)
        write(tmp_path / "a.ply", nacre.Cloud(points))
        command = [sys.executable, "-c", PROGRAM, tmp_path / "a.ply", tmp_path / "o.ply"]
        peaks.append(int(subprocess.run(command, capture_output=True, text=True, check=True).stdout) * 1024)
    assert peaks[1] < 250e6
    assert peaks[1] - peaks[0] < 20e6  # the points and their normals alone are 29 MB more
