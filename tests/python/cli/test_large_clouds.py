"""Commands over clouds of any size."""

import inspect

import numpy as np
import pytest
from command_line import fails, run
from hills import NUM_POINTS, hills, write

import nacre
from nacre import out_of_core
from nacre.cli.consolidate import consolidate
from nacre.cli.downsample import downsample
from nacre.cli.normals import normals
from nacre.cli.outliers import outliers


@pytest.fixture(scope="module")
def scan(tmp_path_factory):
    return write(tmp_path_factory.mktemp("cli") / "hills.ply", hills())


@pytest.mark.parametrize(
    ("words", "num_points"),
    [
        (("consolidate", "--num-points", 500, "--iterations", 1, "--memory", "1GB"), 500),
        (("normals", "--k", 8, "--viewpoint", 0, 0, 1e4, "--points-per-cell", 6000), NUM_POINTS),
        (("downsample", "--voxel-size", 1000), 1),
        (("outliers", "--std-ratio", 1000), NUM_POINTS),
    ],
)
def test_commands(words, num_points, scan, tmp_path):
    out = tmp_path / "o.ply"
    done = run(words[0], scan, out, *words[1:], "--json")
    assert done.code == 0, done.err
    assert (done.json["num_input"], done.json["num_points"]) == (NUM_POINTS, num_points)
    assert (done.json["num_cells"] > 1) == (words[0] == "normals")
    found = nacre.read_points(out)
    assert len(found) == num_points
    assert set(found.attributes) == {"intensity", "classification", "gps_time"}
    assert (found.normals is not None) == (words[0] == "normals")


def test_a_folder_of_files_is_one_cloud(scan, tmp_path):
    folder = tmp_path / "scans"
    folder.mkdir()
    cloud = hills()
    write(folder / "a.ply", cloud[:5000])
    write(folder / "b.ply", cloud[5000:])
    options = ("--num-points", 500, "--iterations", 1)
    assert run("consolidate", folder, tmp_path / "a.ply", *options).code == 0
    assert run("consolidate", scan, tmp_path / "b.ply", *options, "--memory", "1GB").code == 0
    assert (tmp_path / "a.ply").read_bytes() == (tmp_path / "b.ply").read_bytes()


def test_alignment(scan, tmp_path):
    cloud = hills()
    write(tmp_path / "b.ply", nacre.Cloud(cloud.points + np.array([0.05, 0, 0])))
    words = (
        "align",
        tmp_path / "b.ply",
        scan,
        "-o",
        tmp_path / "o.ply",
        "--memory",
        "1GB",
        "--max-distance",
        1,
    )
    assert run(*words, "--json").json["converged"]
    np.testing.assert_allclose(nacre.read_points(tmp_path / "o.ply").points, cloud.points, rtol=0, atol=0.005)
    assert "--global needs both clouds in memory" in fails(2, *words, "--global")


def test_evaluation(scan):
    figures = run("evaluate", scan, scan, "--memory", "1GB", "--tau", 0.1, "--json").json
    assert figures["surface_accuracy"]["max"] == 0
    assert figures["f_score"]["f_score"] == [1.0]
    assert "cannot be moved" in fails(2, "evaluate", scan, scan, "--memory", "1GB", "--align")


def test_wrong_usage(scan, tmp_path):
    assert "memory must be a size" in fails(2, "normals", scan, tmp_path / "o.ply", "--memory", "much")
    assert "output must end in" in fails(2, "outliers", scan, tmp_path / "o.npz")
    fails(2, "downsample", scan, tmp_path / "o.ply")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("command", "function"),
    [
        (consolidate, out_of_core.consolidate),
        (downsample, out_of_core.voxel_downsample),
        (normals, out_of_core.estimate_normals),
        (outliers, out_of_core.remove_outliers),
    ],
)
def test_commands_and_functions_have_the_same_defaults(command, function):
    ours, theirs = (inspect.signature(each).parameters for each in (command, function))
    shared = {
        name for name in ours.keys() & theirs.keys() if theirs[name].default is not inspect.Parameter.empty
    }
    assert {"memory", "points_per_cell", "workers", "scheduler"} <= shared
    assert {name: ours[name].default for name in shared} == {name: theirs[name].default for name in shared}
