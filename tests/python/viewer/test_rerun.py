"""Files for the Rerun viewer, read by Rerun's own tools."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import nacre
import nacre.viewer
from nacre.cli.app import run
from nacre.report import ReportedFrame
from nacre.run_data.motion import Motion
from nacre.viewer import Snapshot, Timeline, export_rrd


def timeline() -> Timeline:
    """Tell of three frames, the second of them lost."""
    camera = nacre.Camera(96, 72, 90, 90, 47.5, 35.5)
    y, x = np.mgrid[0:72, 0:96]
    depth = (0.7 + 0.03 * np.sin(x / 6) * np.cos(y / 7)).astype(np.float32)
    told = Timeline("wave", camera, depth_of=lambda index: depth)
    points = nacre.back_project(depth, camera).reshape(-1, 3)
    for i in range(3):
        pose = np.eye(4)
        pose[0, 3] = 0.01 * i
        lost = i == 1
        told.add(
            ReportedFrame(i, "LOST", reason="too few pairs")
            if lost
            else ReportedFrame(i, "TRACKED", world_from_camera=pose, overlap=0.98)
        )
        told.set_snapshot(Snapshot(points, np.zeros_like(points) - (0, 0, 1), 0.005))
    return told


def rerun(*arguments: str | Path) -> str:
    done = subprocess.run(
        [sys.executable, "-m", "rerun", *map(str, arguments)], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout + done.stderr


def test_rerun_reads_what_was_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("rerun")
    monkeypatch.setattr(nacre.viewer, "read_timeline", lambda folder: timeline())
    (tmp_path / "report.json").touch()
    file = tmp_path / "view.rrd"
    assert run(["view", str(tmp_path), "--rrd", str(file)]) == 0
    assert str(file) in capsys.readouterr().out
    assert "verified without error" in rerun("rrd", "verify", file)
    told = rerun("rrd", "print", "-vvv", file)
    for entity in ("/world/model", "/world/path", "/world/camera", "/world/camera/depth", "/frames"):
        assert entity in told
    assert "LOST" in told


def test_each_shape_of_what_bends_is_there(tmp_path: Path) -> None:
    pytest.importorskip("rerun")
    wave = timeline()
    ((_, cloud),) = wave.snapshots[-1:]
    moments = np.array([0.0, 0.0, 1.0])
    steps = np.zeros((2, len(cloud.points), 3), np.uint16)
    moving = Motion(moments, steps, np.full((2, len(cloud.points), 2), 128, np.uint8), np.zeros(3), 1e-4)
    alone = Timeline("wave", None)
    for frame in wave.frames:
        alone.add(frame)
    alone.set_snapshot(replace(cloud, motion=moving))
    export_rrd(alone, tmp_path / "view.rrd")
    told = rerun("rrd", "print", "-vvv", "--entity", "/world/model", tmp_path / "view.rrd")
    assert "with 2 rows" in told


def test_without_the_library(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "rerun", None)
    with pytest.raises(ImportError, match=r'pip install "nacre\[rerun\]"'):
        export_rrd(timeline(), tmp_path / "view.rrd")


def test_a_folder_that_is_missing(tmp_path: Path) -> None:
    pytest.importorskip("rerun")
    with pytest.raises(FileNotFoundError):
        export_rrd(timeline(), tmp_path / "none" / "view.rrd")
