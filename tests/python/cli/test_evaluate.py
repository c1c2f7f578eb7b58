"""``nacre evaluate``."""

import numpy as np
import pytest
from command_line import fails, run, strict_json

import nacre


@pytest.fixture(scope="module")
def mesh(tmp_path_factory):
    path = tmp_path_factory.mktemp("cli") / "object.ply"
    mesh = nacre.built_in_object()
    nacre.write_mesh(path, mesh.vertices, mesh.triangles)
    return path


def test_model_against_mesh_through_the_true_poses(reconstructed, mesh):
    figures = run("evaluate", reconstructed[0], mesh, "--tau", 0.004, "--json").json
    assert figures["surface_accuracy"]["rms"] < 0.001
    assert figures["completeness"]["tau"] == [0.004]
    assert figures["normal_error"]["unoriented_mean"] < 0.3
    assert {"f_score", "uniformity"} <= set(figures)
    assert "true pose" in figures["world_from_model_from"]


def test_pose_from_a_file_and_by_icp(reconstructed, recording, mesh, tmp_path):
    model, pose = reconstructed[0] / "model.ply", tmp_path / "pose.txt"
    unmoved = run("evaluate", model, mesh, "--json").json
    np.savetxt(pose, nacre.open_sequence(recording).truth.poses[0])
    moved = run("evaluate", model, mesh, "--world-from-model", pose, "--json").json
    aligned = run("evaluate", model, mesh, "--world-from-model", pose, "--align", "--json").json
    assert unmoved["surface_accuracy"]["rms"] > 0.05
    assert aligned["surface_accuracy"]["rms"] <= moved["surface_accuracy"]["rms"] * 1.05 < 0.001


def test_model_against_points(reconstructed):
    model = reconstructed[0] / "model.ply"
    result = run("evaluate", model, model)
    assert result.code == 0
    assert "100 %" in result.out


def test_no_first_guess_is_far_away(reconstructed, tmp_path):
    nacre.write_points(tmp_path / "far.ply", np.random.default_rng(0).normal(size=(500, 3)) + 1000)
    assert "--align" in fails(1, "evaluate", reconstructed[0] / "model.ply", tmp_path / "far.ply", "--align")


def test_trajectory_three_ways(reconstructed, recording):
    out, _ = reconstructed
    known = strict_json(out / "report.json")["absolute_trajectory_error"]
    for arguments in ([out], [out, recording], [out / "trajectory.txt", recording / "groundtruth.txt"]):
        figures = run("evaluate", *arguments, "--json").json
        assert figures["absolute_trajectory_error"]["rmse"] == pytest.approx(known["rmse"], rel=1e-6)
        assert figures["relative_pose_error"]["num_pairs"] == 3


@pytest.mark.parametrize(
    "names", [["trajectory.txt"], ["model.ply"], ["missing"], ["report.html", "missing"]]
)
def test_wrong_usage(reconstructed, names):
    fails(2, "evaluate", *(reconstructed[0] / name for name in names))


def test_folder_without_report(tmp_path):
    assert "report.json" in fails(2, "evaluate", tmp_path)
    (tmp_path / "report.json").write_text("{}")
    fails(1, "evaluate", tmp_path)


def test_no_common_times(reconstructed, tmp_path):
    nacre.write_trajectory(tmp_path / "t.txt", [500.0], np.eye(4)[None])
    assert "--max-difference" in fails(1, "evaluate", reconstructed[0] / "trajectory.txt", tmp_path / "t.txt")
