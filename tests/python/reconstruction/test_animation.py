"""What bends is written as a mesh that moves, and its report tells how it was bent."""

from pathlib import Path

import numpy as np
import pytest
from bending_sheet import CAMERA, CURVATURES, sheet
from command_line import run, strict_json
from played_animation import played

import nacre
from nacre.datasets import write_recording


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a plain recording of a sheet that is rolled up, with a frame without anything in between."""
    folder = tmp_path_factory.mktemp("sheet") / "recording"
    depths = [
        sheet(curvature).simulate_depth(CAMERA, np.eye(4), noise="kinect", seed=index)
        for index, curvature in enumerate(CURVATURES)
    ]
    depths.insert(3, np.full_like(depths[0], np.nan))
    write_recording(folder, CAMERA, depths, depth_scale=10_000)
    return folder


def test_the_mesh_moves_as_the_model_does(recording: Path, tmp_path: Path) -> None:
    run("reconstruct", recording, "--deform", "-o", tmp_path, "--no-report")
    times, shapes, _ = played(tmp_path / "animation.glb")
    assert len(times) == len(shapes) == len(CURVATURES)
    poses = nacre.read_trajectory(tmp_path / "trajectory.txt").poses
    for shape, curvature, pose in zip(shapes, CURVATURES, poses, strict=True):
        in_camera = (shape - pose[:3, 3]) @ pose[:3, :3]
        distances = sheet(curvature).closest(in_camera.astype(np.float32)).distances
        assert np.sqrt((distances**2).mean()) < 0.0015


def test_what_is_rigid_has_none(recording: Path, tmp_path: Path) -> None:
    (tmp_path / "animation.glb").write_bytes(b"of an earlier model")
    run("reconstruct", recording, "-o", tmp_path, "--no-report", "--min-tracked", 0)
    assert not (tmp_path / "animation.glb").exists()


def test_the_report_tells_how_it_was_bent(
    recording: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("PIL")
    monkeypatch.setattr("nacre.report.page.draw_model", lambda *_: None)
    done = run("reconstruct", recording, "--deform", "-o", tmp_path)
    figures, page = strict_json(tmp_path / "report.json"), (tmp_path / "report.html").read_text()
    bent, frames = figures["deformation"], [frame["deformation"] for frame in figures["frames"]]
    assert bent["num_nodes"] == frames[-1]["num_nodes"]
    assert 0 < bent["num_bent"] < len(frames)
    assert 0.8 < bent["explained"] <= 1
    assert bent["strain_max"] == max(frame["strain"] for frame in frames)
    assert '<a href="animation.glb">' in page
    assert f'Nodes of the warp at the end</th><td class="number">{bent["num_nodes"]}<' in page
    assert "nothing contradicts" not in page + done.out
    assert "noise of points" in done.out
    assert "without the error of the warp" in done.out


def test_a_rigid_run_has_no_deformation(recording: Path, tmp_path: Path) -> None:
    pytest.importorskip("PIL")
    run("reconstruct", recording, "-o", tmp_path, "--last", 0)
    assert strict_json(tmp_path / "report.json")["deformation"] is None
    assert "Deformation" not in (tmp_path / "report.html").read_text()
