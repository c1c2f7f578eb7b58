"""``nacre mesh --texture``."""

import json
import shutil

import numpy as np
import pytest
from command_line import fails, run
from painted_sheet import CAMERA, TRIANGLES, VERTICES, VIEWS, lookup, paint

import nacre
from nacre.meshing import Texture


@pytest.fixture(scope="module")
def painted_run(tmp_path_factory):
    """Return the folder of a run whose model is the sheet; its views were taken in two exposures."""
    folder = tmp_path_factory.mktemp("mesh")
    exposures = (0.8, 1.0, 1.0)
    colors = [np.rint(f * view.color).astype(np.uint8) for f, view in zip(exposures, VIEWS, strict=True)]
    poses = [view.world_from_camera for view in VIEWS]
    depths = [view.depth for view in VIEWS]
    nacre.write_recording(folder / "recording", CAMERA, depths, depth_scale=1000, colors=colors, poses=poses)
    out = folder / "out"
    out.mkdir()
    gray = np.full(VERTICES.shape, 90, np.uint8)
    nacre.write_points(
        out / "model.ply", VERTICES, normals=np.tile((0, 0, -1.0), (len(VERTICES), 1)), colors=gray
    )
    frames = [
        {"index": i, "status": "TRACKED", "world_from_camera": pose.tolist()} for i, pose in enumerate(poses)
    ]
    recording = {"path": str(folder / "recording"), "format": "plain", "depth_scale": 1000.0}
    (out / "report.json").write_text(json.dumps({"frames": frames, "recording": recording}))
    return out


def seen_by_trimesh(path):
    """Return a mesh as another program sees it, and the texture with v upwards."""
    trimesh = pytest.importorskip("trimesh")
    seen = trimesh.load(path, process=False, force="mesh")
    material = seen.visual.material
    image = material.baseColorTexture if path.suffix == ".glb" else material.image
    uv = seen.visual.uv * (1, -1) + (0, 1)
    return seen, Texture(np.asarray(image.convert("RGB")), uv.astype(np.float32), seen.faces.astype(np.int32))


@pytest.mark.parametrize("name", ["mesh.glb", "a sheet.obj"])
@pytest.mark.parametrize("options", [(), ("--simplify", "1500", "--keep", "largest")])
def test_another_program_sees_the_paint(painted_run, tmp_path, name, options):
    path = tmp_path / name
    told = run("mesh", painted_run, "--texture", "-o", path, *options, "--json").json
    assert told["images"] == 3
    seen, texture = seen_by_trimesh(path)
    assert list(texture.image.shape[1::-1]) == told["texture"]
    assert len(seen.faces) == told["triangles"]
    colors = lookup(texture, texture.uv[texture.triangles].mean(axis=1).astype(float))
    middle = (np.abs(seen.triangles[..., :2]) < 0.17).all(axis=(1, 2))
    errors = np.abs(colors - 0.8 ** (1 / 3) * paint(seen.triangles.mean(axis=1)))[middle]
    assert np.median(errors) < 2
    assert np.quantile(errors, 0.95) < 6


def test_a_closed_mesh_is_painted_where_it_was_seen(painted_run, tmp_path):
    pytest.importorskip("gpytoolbox")
    told = run("mesh", painted_run, "--texture", "--closed", "-o", tmp_path / "a.glb", "--json").json
    assert 0.2 < told["seen"] < 0.95
    seen, texture = seen_by_trimesh(tmp_path / "a.glb")
    colors = lookup(texture, texture.uv[texture.triangles].mean(axis=1).astype(float))
    away = nacre.Mesh(VERTICES, TRIANGLES).distance(seen.triangles.mean(axis=1)) > 0.04
    assert away.any()
    assert np.quantile(np.abs(colors[away] - 128), 0.95) < 8
    assert colors[~away].std() > 20


def test_what_it_says(painted_run, tmp_path):
    folder = shutil.copytree(painted_run, tmp_path / "out")
    out = run("mesh", folder, "--texture").out
    assert "images     3\n" in out
    assert f"mesh       {folder / 'mesh.glb'}\n" in out


def test_weak_frames_paint_where_there_are_no_others(painted_run, tmp_path):
    folder = shutil.copytree(painted_run, tmp_path / "out")
    report = json.loads((folder / "report.json").read_text())
    for weak, used in (([0], 2), ([0, 1, 2], 3)):
        for i in weak:
            report["frames"][i]["status"] = "WEAK"
        (folder / "report.json").write_text(json.dumps(report))
        assert run("mesh", folder, "--texture", "--json").json["images"] == used


@pytest.mark.parametrize("suffix", [".ply", ".stl"])
def test_formats_without_textures(painted_run, tmp_path, suffix):
    message = f"textured meshes are written to .glb, .obj, got '{tmp_path / 'a'}{suffix}'"
    assert message in fails(2, "mesh", painted_run, "--texture", "-o", tmp_path / f"a{suffix}")
    assert not list(tmp_path.iterdir())


def test_points_know_no_images(painted_run, tmp_path):
    said = fails(2, "mesh", painted_run / "model.ply", "--texture", "-o", tmp_path / "a.glb")
    assert "--texture needs the folder of nacre reconstruct, which knows the images" in said


def test_a_recording_that_is_gone_or_gray(painted_run, tmp_path):
    folder = shutil.copytree(painted_run, tmp_path / "out")
    report = json.loads((folder / "report.json").read_text())
    recording = shutil.copytree(report["recording"]["path"], tmp_path / "recording")
    report["recording"]["path"] = str(recording)
    (folder / "report.json").write_text(json.dumps(report))
    shutil.rmtree(recording / "color")
    assert "has no colour images, which --texture paints with" in fails(1, "mesh", folder, "--texture")
    shutil.rmtree(recording)
    assert f"is no longer at {recording}" in fails(1, "mesh", folder, "--texture")
    report["recording"] = None  # as after nacre demo, whose views are simulated
    (folder / "report.json").write_text(json.dumps(report))
    assert f"{folder} is not of a recording, which would have the images" in fails(
        2, "mesh", folder, "--texture"
    )
    (folder / "report.json").unlink()
    assert "has no report.json" in fails(2, "mesh", folder, "--texture")
    assert not (folder / "mesh.glb").exists()


def test_a_texture_of_no_mesh_is_refused(tmp_path):
    good = Texture(np.zeros((2, 3, 3), np.uint8), np.zeros((4, 2), np.float32), np.zeros((1, 3), np.int32))
    with pytest.raises(ValueError, match=r"texture.triangles must have one row per triangle \(3872\), got 1"):
        nacre.write_mesh(tmp_path / "a.glb", VERTICES, TRIANGLES, texture=good)
