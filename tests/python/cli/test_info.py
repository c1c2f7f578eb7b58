"""``nacre info``."""

import re

import numpy as np
import pytest
from command_line import fails, run

import nacre


def test_recording(recording):
    figures = run("info", recording, "--json").json
    assert figures["kind"] == "recording"
    assert (figures["format"], figures["num_frames"], figures["depth_scale"]) == ("plain", 4, 50000)
    assert figures["truth"] is True
    assert figures["color"] is False
    assert 0.1 < figures["first_frame"]["median"] < 1
    text = run("info", recording).out
    assert re.search(r"true poses +yes, 4", text)


def test_points_mesh_and_model(reconstructed, tmp_path):
    figures = run("info", reconstructed[0] / "model.ply", "--json").json
    assert figures["kind"] == "points"
    assert figures["fields"] == ["normals"]
    assert "confidence" in figures["attributes"]
    mesh = nacre.built_in_object()
    nacre.write_mesh(tmp_path / "m.ply", mesh.vertices, mesh.triangles)
    figures = run("info", tmp_path / "m.ply", "--json").json
    assert (figures["kind"], figures["num_triangles"]) == ("mesh", len(mesh.triangles))
    np.testing.assert_allclose([figures["lower"], figures["upper"]], mesh.bounds, atol=1e-6)


def test_a_finished_run_tells_its_verdict(reconstructed):
    out = reconstructed[0]
    figures = run("info", out, "--json").json
    assert (figures["kind"], figures["num_frames"]) == ("run", 4)
    text = run("info", out).out
    assert figures["verdict"]["sentence"] in text
    assert f"nacre view {out}" in text


def test_empty_and_nan_points(tmp_path):
    nacre.write_points(tmp_path / "n.ply", np.full((4, 3), np.nan))
    assert run("info", tmp_path / "n.ply", "--json").json["spacing"] is None
    nacre.write_points(tmp_path / "e.pcd", np.zeros((0, 3)))
    assert run("info", tmp_path / "e.pcd").code == 0
    nacre.write_points(tmp_path / "one.pcd", np.zeros((1, 3)))
    assert run("info", tmp_path / "one.pcd", "--json").json["num_points"] == 1


def test_wrong_files(tmp_path):
    fails(2, "info", tmp_path / "no")
    (tmp_path / "x.txt").write_text("x")
    fails(2, "info", tmp_path / "x.txt")
    (tmp_path / "x.ply").write_text("x")
    fails(1, "info", tmp_path / "x.ply")


@pytest.mark.data
def test_malformed_points_are_told(recordings):
    codes = [run("info", path).code for path in sorted((recordings / "malformed-ply").glob("*.ply"))]
    assert codes.count(0) == 2
    assert codes.count(1) == len(codes) - 2
