"""``nacre convert``."""

import json
import shutil

import numpy as np
import pytest
from command_line import fails, run

import nacre

RNG = np.random.default_rng(2)
POINTS = RNG.normal(size=(30, 3))
NORMALS = POINTS / np.linalg.norm(POINTS, axis=1, keepdims=True)
COLORS = RNG.integers(0, 256, (30, 3)).astype(np.uint8)
TRIANGLES = [[0, 1, 2], [2, 3, 4]]
POSES = np.stack([np.eye(4)] * 3)


@pytest.fixture
def cloud(tmp_path):
    path = tmp_path / "cloud.ply"
    attributes = {"intensity": np.arange(30, dtype=np.uint16)}
    nacre.write_points(path, POINTS, normals=NORMALS, colors=COLORS, attributes=attributes, comments=["mine"])
    return path


@pytest.fixture
def mesh(tmp_path):
    nacre.write_mesh(tmp_path / "mesh.ply", POINTS[:5], TRIANGLES, normals=NORMALS[:5], colors=COLORS[:5])
    return tmp_path / "mesh.ply"


@pytest.fixture
def trajectory(tmp_path):
    nacre.write_trajectory(tmp_path / "t.txt", [0.5, 1.5, 2.5], POSES)
    return tmp_path / "t.txt"


@pytest.fixture(scope="module")
def colored_run(tmp_path_factory):
    """Return the folder of a run that lost one of three frames; the recording beside it has true poses."""
    folder = tmp_path_factory.mktemp("convert")
    camera = nacre.Camera(16, 12, 15.0, 15.0, 7.5, 5.5)
    depths, colors = np.ones((3, 12, 16)), np.zeros((3, 12, 16, 3), np.uint8)
    nacre.write_recording(folder / "recording", camera, depths, depth_scale=1000, colors=colors, poses=POSES)
    out = folder / "out"
    out.mkdir()
    nacre.write_points(out / "model.ply", POINTS, normals=NORMALS, colors=COLORS)
    nacre.write_trajectory(out / "trajectory.txt", [0, 2], POSES[:2])
    frames = [{"index": i, "status": "TRACKED", "world_from_camera": np.eye(4).tolist()} for i in (0, 2)]
    frames.insert(1, {"index": 1, "status": "LOST", "world_from_camera": None})
    recording = {"path": str(folder / "recording"), "format": "plain", "depth_scale": 1000.0}
    (out / "report.json").write_text(json.dumps({"frames": frames, "recording": recording}))
    return out


@pytest.mark.parametrize("suffix", [".pcd", ".xyz", ".npz", ".ply"])
def test_points_with_all_that_belongs_to_them(cloud, tmp_path, suffix):
    told = run("convert", cloud, tmp_path / f"b{suffix}", "--json").json
    assert told == {
        "out": str(tmp_path / f"b{suffix}"), "kind": "points", "num_points": 30,
        "fields": ["normals", "colors", "intensity"],
    }  # fmt: skip
    found = nacre.read_points(tmp_path / f"b{suffix}")
    np.testing.assert_array_equal(found.points, POINTS)
    np.testing.assert_array_equal(found.normals, NORMALS)
    np.testing.assert_array_equal(found.colors, COLORS)
    assert found.attributes["intensity"].tolist() == list(range(30))
    assert found.comments == ("mine",)


def test_what_a_format_has_no_place_for_is_told(tmp_path):
    pytest.importorskip("pye57")
    nacre.write_points(tmp_path / "a.ply", POINTS, colors=COLORS, attributes={"heat": np.arange(30.0)})
    done = run("convert", tmp_path / "a.ply", tmp_path / "b.e57", "--json")
    assert done.json["fields"] == ["colors"]
    assert "no place for heat" in done.err


def test_points_that_are_not_finite_stay_behind_where_they_must(tmp_path):
    pytest.importorskip("laspy")
    nacre.write_points(tmp_path / "a.pcd", [[0, 0, 0], [np.nan, 0, 0], [1, 2, 3]], normals=np.eye(3))
    assert run("convert", tmp_path / "a.pcd", tmp_path / "a.las", "--json").json["not_finite_left_out"] == 1
    assert nacre.read_points(tmp_path / "a.las").points.tolist() == [[0, 0, 0], [1, 2, 3]]
    run("convert", tmp_path / "a.pcd", tmp_path / "a.ply")
    assert len(nacre.read_points(tmp_path / "a.ply")) == 3


def test_lists_are_left_out(tmp_path):
    text = "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\n"
    text += "property list uchar int seen_by\nend_header\n0 0 0 1 5\n1 1 1 2 5 6\n"
    (tmp_path / "a.ply").write_text(text)
    assert run("convert", tmp_path / "a.ply", tmp_path / "a.pcd", "--json").json["not_numbers_left_out"] == [
        "seen_by"
    ]


@pytest.mark.parametrize("suffix", [".glb", ".obj", ".stl"])
def test_meshes(mesh, tmp_path, suffix):
    trimesh = pytest.importorskip("trimesh")
    told = run("convert", mesh, tmp_path / f"b{suffix}", "--json").json
    assert (told["kind"], told["num_vertices"], told["num_triangles"]) == ("mesh", 5, 2)
    found = trimesh.load(tmp_path / f"b{suffix}", force="mesh", process=False)
    np.testing.assert_allclose(found.triangles, POINTS[TRIANGLES], rtol=1e-6)


def test_a_mesh_stays_one_in_ply_and_becomes_points_in_other_formats(mesh, tmp_path):
    assert run("convert", mesh, tmp_path / "b.ply", "--json").json["kind"] == "mesh"
    assert run("convert", mesh, tmp_path / "b.pcd", "--json").json["fields"] == ["normals", "colors"]
    np.testing.assert_array_equal(nacre.read_points(tmp_path / "b.pcd").points, POINTS[:5])


@pytest.mark.parametrize(
    ("name", "options", "first_line"),
    [
        ("b.txt", [], "# timestamp tx ty tz qx qy qz qw"),
        ("b.log", [], "0 0 1"),
        ("b.log", ["--to", "tum"], "# timestamp tx ty tz qx qy qz qw"),
        ("b.any", ["--to", "kitti"], "1 0 0 0 0 1 0 0 0 0 1 0"),
    ],
)
def test_trajectories(trajectory, tmp_path, name, options, first_line):
    assert run("convert", trajectory, tmp_path / name, *options, "--json").json["num_poses"] == 3
    assert (tmp_path / name).read_text().splitlines()[0] == first_line


def test_a_runs_model_and_trajectory(colored_run, tmp_path):
    assert run("convert", colored_run, tmp_path / "m.xyz", "--json").json["num_points"] == 30
    assert run("convert", colored_run, tmp_path / "t.txt", "--to", "kitti", "--json").json["num_poses"] == 2


def test_a_runs_images_with_the_poses_that_were_found(colored_run, tmp_path):
    pytest.importorskip("PIL")
    told = run("convert", colored_run, tmp_path / "c", "--to", "colmap", "--json").json
    assert (told["kind"], told["num_images"], told["num_points"]) == ("images", 2, 30)
    lines = (tmp_path / "c" / "sparse" / "0" / "images.txt").read_text().splitlines()
    assert [line.split()[-1] for line in lines[1::2]] == ["frame_000000.png", "frame_000002.png"]
    run("convert", colored_run, tmp_path / "n", "--to", "nerfstudio")
    assert len(json.loads((tmp_path / "n" / "transforms.json").read_text())["frames"]) == 2


def test_a_recordings_images_with_the_true_poses(colored_run, tmp_path):
    pytest.importorskip("PIL")
    source = colored_run.parent / "recording"
    assert run("convert", source, tmp_path / "c", "--to", "colmap", "--json").json["num_images"] == 3
    assert run("convert", source, tmp_path / "t.txt", "--json").json["num_poses"] == 3


def test_what_makes_no_sense_is_told(cloud, mesh, trajectory, colored_run, recording, tmp_path):
    source = colored_run.parent / "recording"
    for arguments, message in (
        ((tmp_path / "none.ply", tmp_path / "b.las"), "no such file or folder"),
        ((cloud, tmp_path / "b.usd"), r"expected an ending of .ply, .pcd, .las"),
        ((cloud, tmp_path / "b"), "or a folder with --to colmap"),
        ((cloud, tmp_path / "b.glb"), "a point file has no triangles: nacre mesh"),
        ((cloud, tmp_path / "b.txt"), "a point file cannot become a trajectory"),
        ((colored_run, tmp_path / "b.glb"), "a run has no triangles: nacre mesh"),
        ((mesh, tmp_path / "b", "--to", "colmap"), "images with poses come from a recording"),
        ((trajectory, tmp_path / "b.ply"), "a trajectory cannot become a point file"),
        ((source, tmp_path / "b.ply"), "a recording has no points: nacre reconstruct"),
        ((cloud, tmp_path / "b.ply", "--to", "usd"), "'usd' is not one of"),
        ((cloud, tmp_path / "nowhere" / "b.pcd"), "cannot write"),
    ):
        assert message in fails(2, "convert", *arguments), arguments
    (tmp_path / "a.abc").write_text("")
    assert "expected a folder or a file that ends in .ply" in fails(
        2, "convert", tmp_path / "a.abc", tmp_path / "b.ply"
    )
    assert "has no colour images" in fails(1, "convert", recording, tmp_path / "b", "--to", "colmap")


def test_a_recording_that_is_gone_or_has_shrunk(colored_run, tmp_path):
    run_folder = shutil.copytree(colored_run, tmp_path / "out")
    report = json.loads((run_folder / "report.json").read_text())
    report["frames"][2]["index"] = 99
    (run_folder / "report.json").write_text(json.dumps(report))
    assert "has only 3 views by now" in fails(1, "convert", run_folder, tmp_path / "c", "--to", "colmap")
    report["recording"]["path"] = str(tmp_path / "moved")
    (run_folder / "report.json").write_text(json.dumps(report))
    assert "is no longer at" in fails(1, "convert", run_folder, tmp_path / "c", "--to", "colmap")
    assert not (tmp_path / "c").exists()


def test_a_recording_without_true_poses_asks_for_a_run(colored_run, tmp_path):
    source = shutil.copytree(colored_run.parent / "recording", tmp_path / "recording")
    (source / "groundtruth.txt").unlink()
    for options in (["--to", "colmap"], ["--to", "tum"]):
        assert "has no true poses: nacre reconstruct" in fails(1, "convert", source, tmp_path / "c", *options)
