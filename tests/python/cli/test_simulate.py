"""``nacre simulate``."""

import math

import numpy as np
import pytest
from command_line import SIMULATION, fails, run

import nacre


def test_writes_a_recording_with_truth(made):
    folder, result = made
    assert result.code == 0
    assert f"nacre reconstruct {folder}" in result.out
    sequence = nacre.open_sequence(folder)
    assert len(sequence) == 4
    assert sequence.camera.model == "orthographic"
    assert sequence.camera.pixel_size == 0.002
    assert sequence.depth_scale == 50000
    mesh = nacre.built_in_object()
    expected = nacre.turntable_poses(mesh, 4, math.radians(12), camera=sequence.camera)
    np.testing.assert_allclose(sequence.truth.poses, expected, atol=1e-9)
    exact = mesh.simulate_depth(sequence.camera, expected[2])
    error = sequence[2].depth - exact
    assert 0.00025 < np.nanstd(error) < 0.00035


def test_views_have_different_noise(tmp_path):
    run("simulate", "built-in", "-o", tmp_path / "r", *SIMULATION, "--step", 0, "--views", 2)
    first, second = (frame.depth for frame in nacre.open_sequence(tmp_path / "r"))
    assert np.nanstd(first - second) > 0.0003


def test_pinhole_and_json(tmp_path):
    result = run(
        "simulate", "built-in", "-o", tmp_path / "r", "--views", 1, "--noise", "kinect", "--width", 160,
        "--height", 120, "--fx", 150, "--distance", 0.5, "--json",
    )  # fmt: skip
    assert result.json["views"] == 1
    camera = nacre.open_sequence(tmp_path / "r").camera
    assert (camera.model, camera.fx, camera.fy, camera.cx) == ("pinhole", 150, 150, 79.5)


def test_a_sensor(tmp_path):
    views = ("--views", 2, "--step", 0, "--width", 160, "--height", 120, "--distance", 0.4)
    run("simulate", "built-in", "-o", tmp_path / "r", *views, "--sensor", "stereo")
    first, second = nacre.open_sequence(tmp_path / "r")
    expected = nacre.built_in_object().simulate_depth(first.camera, first.truth, sensor="stereo", seed=0)
    np.testing.assert_allclose(first.depth, expected, atol=2e-5)
    assert np.nanstd(first.depth - second.depth) > 0.001


def test_errors_beyond_what_a_file_holds_are_no_measurement(tmp_path):
    views = ("--views", 1, "--width", 160, "--height", 120, "--fx", 150, "--distance", 1)
    run("simulate", "built-in", "-o", tmp_path / "r", *views, "--noise", 0.5)
    sequence = nacre.open_sequence(tmp_path / "r")
    assert 1.2 < np.nanmax(sequence[0].depth) <= 65534 / sequence.depth_scale


def test_a_mesh_in_millimetres_is_told_and_scaled(tmp_path):
    mesh = nacre.built_in_object()
    path = tmp_path / "mm.ply"
    nacre.write_mesh(path, 1000 * mesh.vertices, mesh.triangles)
    assert "--scale" in fails(2, "simulate", path, "-o", tmp_path / "r", *SIMULATION)
    assert not (tmp_path / "r").exists()
    assert run("simulate", path, "-o", tmp_path / "r", *SIMULATION, "--scale", 0.001).code == 0


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--noise", "foo"], "kinect"),
        (["--sensor", "radar"], "--sensor must be one of none, stereo, structured_light"),
        (["--sensor", "stereo", "--orthographic"], "--orthographic"),
        (["--sensor", "stereo", "--edge-mixing"], "--edge-mixing"),
        (["--scale", "0"], "--scale"),
        (["--pixel-size", "0.001"], "--orthographic"),
        (["--orthographic", "--fx", "500"], "--fx"),
        (["--elevation", "100"], "elevation"),
    ],
)
def test_wrong_options(tmp_path, arguments, words):
    assert words in fails(2, "simulate", "built-in", "-o", tmp_path / "r", *arguments)


def test_a_recording_is_not_overwritten(recording):
    assert "holds a recording already" in run("simulate", "built-in", "-o", recording).err


def test_missing_and_broken_meshes(tmp_path):
    fails(2, "simulate", tmp_path / "no.ply", "-o", tmp_path / "r")
    fails(2, "simulate", tmp_path / "no.xyz", "-o", tmp_path / "r")
    (tmp_path / "broken.ply").write_bytes(b"ply\nformat ascii 1.0\nelement vertex 9\n")
    fails(1, "simulate", tmp_path / "broken.ply", "-o", tmp_path / "r")


def test_nothing_in_view_is_told(tmp_path):
    error = run("simulate", "built-in", "-o", tmp_path / "r", "--views", 1, "--cx", 5000, "--distance", 0.5)
    assert error.code == 1
    assert "no view shows anything" in error.err
