"""``nacre align``."""

import math

import numpy as np
import pytest
from command_line import fails, run

import nacre


@pytest.fixture(scope="module")
def clouds(tmp_path_factory):
    folder = tmp_path_factory.mktemp("cli")
    mesh = nacre.built_in_object()
    turn = np.eye(4)
    turn[:2, :2] = [[math.cos(0.05), -math.sin(0.05)], [math.sin(0.05), math.cos(0.05)]]
    turn[:3, 3] = 0.002, -0.001, 0.003
    points = mesh.vertices[::7]
    target = points @ turn[:3, :3].T + turn[:3, 3]
    nacre.write_points(folder / "s.ply", points, attributes={"label": np.arange(len(points), dtype=np.int32)})
    nacre.write_points(folder / "t.ply", target)
    nacre.write_points(folder / "far.ply", points + 1000)
    return folder, turn


@pytest.mark.parametrize("method", ["symmetric", "point_to_plane", "point_to_point", "paper"])
def test_finds_the_motion(clouds, tmp_path, method):
    folder, turn = clouds
    arguments = ("--method", method, "--max-iterations", 200)
    result = run("align", folder / "s.ply", folder / "t.ply", "-o", tmp_path / "m.ply", "--json", *arguments)
    assert result.code == 0, result
    np.testing.assert_allclose(result.json["target_from_source"], turn, atol=2e-4)
    moved, target = nacre.read_points(tmp_path / "m.ply"), nacre.read_points(folder / "t.ply")
    np.testing.assert_allclose(moved.points, target.points, atol=1e-4)
    assert moved.attributes["label"].tolist() == list(range(len(target)))


def test_starts_from_a_file(clouds, tmp_path):
    folder, turn = clouds
    np.savetxt(tmp_path / "g.txt", turn)
    result = run("align", folder / "s.ply", folder / "t.ply", "--initial", tmp_path / "g.txt")
    assert result.code == 0
    assert "converged" in result.out
    (tmp_path / "bad.txt").write_text("1 2\n")
    fails(1, "align", folder / "s.ply", folder / "t.ply", "--initial", tmp_path / "bad.txt")


def test_nothing_matched_or_still_moving(clouds, tmp_path):
    folder, _ = clouds
    arguments = ("--json", "-o", tmp_path / "m.ply")
    result = run("align", folder / "s.ply", folder / "far.ply", "--max-distance", 0.1, *arguments)
    assert result.code == 1
    assert result.json["converged"] is False
    assert result.json["rmse"] is None
    assert not (tmp_path / "m.ply").exists()
    assert run("align", folder / "s.ply", folder / "t.ply", "--max-iterations", 1).code == 1


def test_wrong_files(clouds, tmp_path):
    folder, _ = clouds
    fails(2, "align", folder / "s.ply", tmp_path / "no.ply")
    fails(2, "align", folder / "s.ply", folder / "t.ply", "-o", tmp_path / "no" / "m.ply")
    fails(2, "align", folder / "s.ply", folder / "t.ply", "--method", "foo")


def test_without_a_first_guess(clouds, tmp_path):
    folder, turn = clouds
    out = tmp_path / "m.ply"
    result = run("align", folder / "s.ply", folder / "t.ply", "--global", "-o", out, "--json")
    assert result.json["status"] == "found"
    assert result.code == 0
    assert result.json["found"]
    np.testing.assert_allclose(result.json["target_from_source"], turn, atol=2e-3)
    assert out.exists()
    (tmp_path / "g.txt").write_text("1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n")
    arguments = (folder / "s.ply", folder / "t.ply", "--initial", tmp_path / "g.txt", "--global")
    assert "--initial" in fails(2, "align", *arguments)
    assert "--global" in fails(2, "align", folder / "s.ply", folder / "t.ply", "--seen-from-origin")
