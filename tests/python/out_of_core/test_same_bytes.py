"""A result has the same bytes, whatever the tiles, the workers, the memory and the order of the points."""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from hills import CELLS, sha256

from nacre import out_of_core

FUNCTIONS: dict[str, Callable[..., out_of_core.CloudResult]] = {
    "wlop": partial(out_of_core.consolidate, num_points=2000, iterations=2),
    "wlop+": partial(out_of_core.consolidate, num_points=2000, iterations=2, method="wlop+"),
    "cgal": partial(out_of_core.consolidate, num_points=2000, iterations=2, method="cgal"),
    "normals": out_of_core.estimate_normals,
    "downsample": partial(out_of_core.voxel_downsample, voxel_size=0.3),
    "outliers": partial(out_of_core.remove_outliers, max_radius=1.0),
}


@pytest.mark.parametrize("name", FUNCTIONS)
def test_tiles_order_files_and_memory_change_nothing(
    name: str, scan: Path, parts: Path, tmp_path: Path
) -> None:
    function = FUNCTIONS[name]
    first = function(scan, tmp_path / "a.ply", **CELLS)
    assert first.num_cells > 4
    expected = sha256(tmp_path / "a.ply")
    for other in ({"cells_per_task": 3, "memory": "4GB"}, {"cells_per_task": 100}):
        function(scan, tmp_path / "b.ply", **{**CELLS, **other})
        assert sha256(tmp_path / "b.ply") == expected, other
    assert function(parts, tmp_path / "c.ply", **CELLS) == first
    assert sha256(tmp_path / "c.ply") == expected
    function(sorted(parts.iterdir(), reverse=True), tmp_path / "d.ply", **CELLS)
    assert sha256(tmp_path / "d.ply") == expected


def test_another_seed_is_another_choice(scan: Path, tmp_path: Path) -> None:
    for seed in (0, 1):
        options: dict[str, Any] = {**CELLS, "num_points": 500, "iterations": 0, "radius": 0.5, "seed": seed}
        assert out_of_core.consolidate(scan, tmp_path / f"{seed}.ply", **options).num_points == 500
    assert sha256(tmp_path / "0.ply") != sha256(tmp_path / "1.ply")


SCRIPT = """
import os, signal, sys
import psutil
from nacre import out_of_core

killed = []

def is_worker(process):
    try:
        return "spawn_main" in " ".join(process.cmdline())
    except psutil.Error:  # it has just ended
        return False

def kill_one(done, total):
    workers = [process for process in psutil.Process().children(recursive=True) if is_worker(process)]
    if not killed and len(workers) == 2:
        os.kill(workers[0].pid, signal.SIGKILL)
        killed.append(done)

if __name__ == "__main__":
    source, output = sys.argv[1:]
    out_of_core.consolidate(source, output, num_points=2000, iterations=2, workers=2, progress=kill_one,
                            points_per_cell=6000, memory="4GB")
    print("killed after", killed)
"""


@pytest.mark.slow
def test_two_workers_of_which_one_is_killed_change_nothing(scan: Path, tmp_path: Path) -> None:
    pytest.importorskip("distributed")
    script = tmp_path / "script.py"
    script.write_text(SCRIPT)
    command = [sys.executable, script, scan, tmp_path / "b.ply"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert re.fullmatch(r"killed after \[\d+\]\n", done.stdout)
    FUNCTIONS["wlop"](scan, tmp_path / "a.ply", **CELLS)
    assert sha256(tmp_path / "b.ply") == sha256(tmp_path / "a.ply")
    assert [path.name for path in tmp_path.iterdir() if path.name.startswith(".")] == []
