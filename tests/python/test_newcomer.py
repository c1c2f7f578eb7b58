"""What a newcomer does wrong, on the command line and in Python, and what is then said to do."""

from __future__ import annotations

import contextlib
import dataclasses
import io
import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import nacre
from nacre.cli import main
from nacre.datasets.sanity_check import depth_oddity

pytest.importorskip("typer")
Image = pytest.importorskip("PIL.Image")

CAMERA = {"model": "pinhole", "width": 64, "height": 48, "fx": 80, "fy": 80, "cx": 31.5, "cy": 23.5}


def metres() -> np.ndarray:
    y, x = np.mgrid[:48, :64] / 48.0
    return 0.6 + 0.05 * np.sin(5 * x) * np.cos(4 * y)


def images(folder: Path, stored: np.ndarray, names: tuple[str, ...] = ("0001", "0002")) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    for name in names:
        Image.fromarray(stored).save(folder / f"{name}.png")
    return folder


def camera_file(folder: Path, **changes: object) -> Path:
    path = folder / "given.json"
    document = {**CAMERA, "depth_scale": 1000, **changes}
    path.write_text(json.dumps({key: value for key, value in document.items() if value is not None}))
    return path


def said(*arguments: object) -> str:
    """Run a command that fails, and return all that it says on stderr."""
    err = io.StringIO()
    with (
        contextlib.redirect_stderr(err),
        contextlib.redirect_stdout(io.StringIO()),
        pytest.raises(SystemExit) as stopped,
    ):
        main([str(word) for word in arguments])
    assert stopped.value.code in (1, 2, 3)
    assert "Traceback" not in err.getvalue()
    return err.getvalue()


def reconstruct(source: Path, *arguments: object) -> str:
    return said("reconstruct", source, "-o", source.parent / "out", *arguments)


MISTAKES: dict[str, tuple[Callable[[Path], str], list[str]]] = {
    "millimetres read as metres": (
        lambda d: reconstruct(
            images(d / "r", (1000 * metres()).astype(np.uint16)), "--camera", camera_file(d, depth_scale=1)
        ),
        ["give --depth-scale", "it was read with 1, and would make sense with 1000 (0."],
    ),
    "metres read as micrometres": (
        lambda d: reconstruct(
            images(d / "r", (1000 * metres()).astype(np.uint16)), "--camera", camera_file(d, depth_scale=1e6)
        ),
        ["it was read with 1e+06, and would make sense with 1000 (0."],
    ),
    "all-zero depth": (
        lambda d: reconstruct(
            images(d / "r", np.zeros((48, 64), np.uint16)), "--camera", camera_file(d)
        ),
        ["warning: ", "no pixel has a measurement", "are these the depth images"],
    ),
    "8-bit depth": (
        lambda d: reconstruct(
            images(d / "r", (255 * metres()).astype(np.uint8)), "--camera", camera_file(d)
        ),
        ["none of its 2 depth images can be read", "8-bit", "save the depth itself"],
    ),
    "no camera": (
        lambda d: reconstruct(images(d / "r", np.ones((48, 64), np.uint16))),
        ["--camera and --depth-scale are needed", '"fx": 525'],
    ),
    "a camera file that is not there": (
        lambda d: reconstruct(images(d / "r", np.ones((48, 64), np.uint16)), "--camera", d / "no.json"),
        ["no such file or directory", "no.json"],
    ),
    "an incomplete camera file": (
        lambda d: reconstruct(
            images(d / "r", np.ones((48, 64), np.uint16)), "--camera", camera_file(d, fy=None)
        ),
        ["'fy' is missing; a pinhole camera has model, width, height, fx, fy, cx and cy"],
    ),
    "a camera of another resolution": (
        lambda d: reconstruct(
            images(d / "r", np.ones((48, 64), np.uint16)), "--camera", camera_file(d, width=640)
        ),
        ["is 64 wide and 48 high, but the camera is 640 by 48; give the camera that took it"],
    ),
    "a TUM recording without depth.txt": (
        lambda d: reconstruct(
            images(d / "r" / "depth", np.ones((48, 64), np.uint16), ("1305031.10", "1305031.13")).parent
        ),
        ["almost a TUM recording", "> depth.txt) makes it"],
    ),
    "a TUM list of other names": (
        lambda d: (
            images(d / "r" / "depth", np.ones((48, 64), np.uint16)),
            (d / "r" / "depth.txt").write_text("1.0 depth/a.png\n2.0 depth/b.png\n"),
            reconstruct(d / "r"),
        )[-1],
        ["none of the 2 files that it lists is there, 'depth/a.png' the first", "depth/ (2 entries)"],
    ),
    "the folder above": (
        lambda d: (camera_folder(d / "r" / "inner"), reconstruct(d / "r"))[-1],
        ["Give one of the folders in it: inner"],
    ),
    "an empty folder": (
        lambda d: ((d / "r").mkdir(), reconstruct(d / "r"))[-1],
        ["the folder is empty: give the one that holds the depth images"],
    ),
    "colour alone": (
        lambda d: reconstruct(images(d / "r" / "rgb", np.zeros((48, 64, 3), np.uint8)).parent),
        ["There are colour images (in rgb/), but nothing that looks like depth"],
    ),
    "a name mistyped": (
        lambda d: (camera_folder(d / "kitchen"), reconstruct(d / "kitchn"))[-1],
        ["no such recording", "did you mean 'kitchen'?"],
    ),
    "an output that is a file": (
        lambda d: ((d / "out").write_text(""), camera_folder(d / "r"), reconstruct(d / "r"))[-1],
        ["it is a file; give another folder"],
    ),
    "an unknown parameter": (
        lambda d: reconstruct(camera_folder(d / "r"), "--set", "registration.max_angel=1"),
        ["did you mean registration.max_angle?"],
    ),
    "an unknown choice": (
        lambda d: reconstruct(camera_folder(d / "r"), "--set", "registration.method=symetric"),
        ["did you mean 'symmetric'?"],
    ),
    "an unknown preset": (
        lambda d: reconstruct(camera_folder(d / "r"), "--preset", "papre"),
        ["'papre' is not one of 'default', 'paper' (did you mean 'paper'?)"],
    ),
    "an unknown format": (
        lambda d: reconstruct(camera_folder(d / "r"), "--format", "tmu"),
        ["did you mean 'tum'?"],
    ),
    "a mesh that is none": (
        lambda d: (
            (d / "m.ply").write_text("ply\nformat ascii 1.0\n"),
            said("simulate", d / "m.ply", "-o", d / "s"),
        )[-1],
        ["m.ply", "end_header"],
    ),
    "evaluation without truth": (
        lambda d: ((d / "m.ply").write_text(""), said("evaluate", d / "m.ply"))[-1],
        ["a mesh or a point file must follow it"],
    ),
    "a mesh of nothing": (
        lambda d: said("mesh", d),
        ["has no model.ply; give the folder that nacre reconstruct wrote to (its -o)"],
    ),
    "a view of nothing": (
        lambda d: said("view", d / "no"),
        ["there is no folder", "give the folder that nacre reconstruct wrote to"],
    ),
}  # fmt: skip


def camera_folder(folder: Path) -> Path:
    """Write a small recording that is as it should be."""
    camera = nacre.Camera(*(CAMERA[name] for name in ("width", "height", "fx", "fy", "cx", "cy")))
    nacre.write_recording(folder, camera, [metres()], depth_scale=1000)
    return folder


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_is_answered_by_what_to_do(mistake: str, tmp_path: Path) -> None:
    make, words = MISTAKES[mistake]
    text = make(tmp_path)
    for word in words:
        assert word in text, text
    assert text.splitlines()[-1].startswith("error: ")


def test_saturated_depth_is_doubted() -> None:
    assert depth_oddity(metres()) is None
    assert depth_oddity(np.round(metres(), 3)) is None
    constant = np.where(metres() > 0.56, 4.095, np.nan).astype(np.float32)
    assert "the same, 4.095 m" in str(depth_oddity(constant))
    assert "no pixel has a measurement" in str(depth_oddity(np.full((4, 4), np.nan)))


def test_parameters_and_choices_are_suggested_in_python_too() -> None:
    camera = nacre.default_camera(nacre.built_in_object())
    with pytest.raises(ValueError, match=r"'spacng' in ModelParameters \(did you mean 'spacing'\?\)"):
        nacre.Model(camera, spacng=0.01)
    with pytest.raises(ValueError, match=r"got 'wolp' \(did you mean 'wlop'\?\)"):
        nacre.consolidate(np.zeros((3, 3)), method="wolp")


@pytest.fixture(scope="module")
def known(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """Return what names stand for in guesses."""
    folder = tmp_path_factory.mktemp("guesses")
    recording = camera_folder(folder / "recording")
    done = nacre.reconstruct(recording)
    cloud = done.model.cloud(all_points=True)
    return {
        "np": np, "nacre": nacre, "dataclasses": dataclasses, "recording": recording, "done": done,
        "model": done.model, "cloud": cloud, "points": cloud.points, "mesh": nacre.built_in_object(),
        "camera": done.model.camera, "K": done.model.camera.matrix, "tree": nacre.KdTree(cloud.points),
        "result": nacre.align(cloud, cloud), "stl": folder / "m.stl", "glb": folder / "m.glb",
        "txt": folder / "t.txt",
    }  # fmt: skip


EVERY_25TH = "nacre.open_sequence(path)[::25]"

GUESSES = {
    # Some of a recording's frames.
    "nacre.reconstruct(recording, every=25)": ["no argument 'every'", EVERY_25TH],
    "nacre.reconstruct(recording, first=1)": ["no argument 'first'", EVERY_25TH],
    "nacre.reconstruct(recording, spacing=0.01, last=2)": ["no argument 'last'", "[-100:]"],
    "nacre.open_sequence(recording, every=10)": ["no argument 'every'", EVERY_25TH],
    "nacre.open_sequence(recording, last=3)": ["no argument 'last'", "[-100:]"],
    "nacre.open_sequence(recording, 'tum')": ["the rest by name: format"],
    "nacre.reconstruct(spacing=0.01)": ["reconstruct needs source"],
    # Meshes.
    "model.to_mesh(closed=True)": ["to_mesh has no argument 'closed'", "nacre.meshing.close_surface"],
    "model.to_mesh(simplify=10)": ["to_mesh has no argument 'simplify'", "nacre.meshing.simplify"],
    "nacre.write_mesh(stl, model)": ["triangles must be", "got None", "give model.to_mesh()"],
    "nacre.write_mesh(stl, done)": ["give its .model.to_mesh()"],
    "nacre.write_mesh(stl, cloud)": ["nacre.meshing.mesh_points(cloud.points, cloud.normals)"],
    "nacre.write_mesh(stl, points)": ["nacre.meshing.mesh_points(cloud.points, cloud.normals)"],
    "nacre.write_mesh(stl, nacre.meshing.ClosedSurface(points, None, None, None))": [
        "give its .vertices and its .triangles"
    ],
    "nacre.simplify(mesh, 10)": ["nacre.meshing.simplify(mesh.vertices, mesh.triangles, num_triangles)"],
    "mesh.simplify(10)": ["nacre.meshing.simplify(mesh.vertices, mesh.triangles, num_triangles)"],
    "mesh.vertex_colors": ["it is colors"],
    # Clouds.
    "cloud.to_mesh()": ["nacre.meshing.mesh_points(cloud.points, cloud.normals)"],
    "cloud.voxel_downsample(0.1)": ["nacre.voxel_downsample(cloud, voxel_size)"],
    "cloud.write('a.ply')": ["nacre.write_points(path, cloud)"],
    "cloud.confidence": ["it is attributes['confidence']"],
    "cloud['confidence']": ["rows must be", "got 'confidence'", "cloud.attributes"],
    "cloud.paint_uniform_color([1, 0, 0])": ["dataclasses.replace(cloud, colors=numpy.full("],
    # Cameras.
    "nacre.Camera.from_matrix(K, 64, 48)": ["matrix must have shape (3, 3)", "from_matrix(width, height, K)"],
    "nacre.Camera.from_matrix(K)": ["needs height and matrix too", "from_matrix(width, height, K)"],
    "nacre.Camera.from_matrix(64, 48, K=K)": ["it is matrix"],
    "nacre.Camera.from_json('camera.json')": ["a Camera has no", "nacre.read_camera(path).camera"],
    "nacre.Camera.load('camera.json')": ["nacre.read_camera(path).camera"],
    "nacre.Camera.from_intrinsics(K)": ["Camera.from_matrix(width, height, K)"],
    "nacre.Camera.from_fv(64, 48, 60)": ["did you mean 'from_fov'?"],
    "camera.from_json('camera.json')": ["nacre.read_camera(path).camera"],
    # Trajectories.
    "nacre.write_trajectory(txt, done)": ["timestamps be a", "got Reconstruction", "give its .trajectory"],
    "nacre.write_trajectory(txt, model.poses)": ["got ndarray", "the times first, then the poses"],
    # Names of the package.
    "nacre.draw(cloud)": ["nacre view"],
    "nacre.visualize(cloud)": ["nacre view"],
    "nacre.save('a.ply', cloud)": ["nacre.write_points", "nacre.write_mesh", "model.save"],
    "nacre.open(recording)": ["nacre.open_sequence", "nacre.read_points", "nacre.read_mesh"],
    "nacre.convert('a.pcd', 'b.ply')": ["nacre.write_points(path, nacre.read_points(other))"],
    "nacre.RealSense()": ["nacre.datasets.RealSense"],
    "nacre.close_surface(points, points)": ["nacre.meshing.close_surface"],
    "nacre.f_score(points, mesh)": ["nacre.evaluation.f_score"],
    "nacre.remove_outliers(points)": ["nacre.KdTree(points).query", "nacre.out_of_core.remove_outliers"],
    "nacre.statistical_outlier_removal(points)": ["nacre.KdTree(points).query"],
    "nacre.depth_to_points(np.ones((48, 64)), camera)": ["nacre.back_project(depth, camera,"],
    "nacre.read_depth('a.png')": ["nacre.io.images.read_depth(path)"],
    "nacre.io.read_depth('a.png')": ["nacre.io.images.read_depth(path)"],
    "nacre.evaluate(cloud, mesh)": ["nacre.evaluation.surface_accuracy(points, mesh)"],
    # Others.
    "tree.query(points, k=[1, 3])": ["k must be an integer, got [1, 3]", "a column for each neighbour"],
    "tree.query(points, k=np.array([1, 3]))": ["k must be an integer", "a column for each neighbour"],
    "result.foo": ["an AlignResult has no attribute 'foo'"],
}


@pytest.mark.parametrize("guess", GUESSES)
def test_a_guess_in_python_is_answered_by_what_to_do(guess: str, known: dict[str, Any]) -> None:
    with pytest.raises((TypeError, ValueError, AttributeError)) as told:
        eval(guess, dict(known))
    for word in GUESSES[guess]:
        assert word in str(told.value)


# What the answers say to do, and what is then true of its value, which is called `it`.
ANSWERS = {
    "nacre.reconstruct(nacre.open_sequence(recording)[::25])": "len(it.frames) == 1",
    "nacre.write_mesh(glb, model.to_mesh())": "len(nacre.read_mesh(glb).triangles) > 100",
    "nacre.meshing.mesh_points(cloud.points, cloud.normals)": "len(it.triangles) > 100",
    "cloud.attributes['confidence']": "it.shape == (len(cloud),)",
    "dataclasses.replace(cloud, colors=np.full(cloud.points.shape, (9, 0, 0), np.uint8))": "it.colors.any()",
    "nacre.write_trajectory(txt, done.trajectory)": "len(nacre.read_trajectory(txt)) == 1",
    "nacre.write_trajectory(txt, [0.0], model.poses)": "len(nacre.read_trajectory(txt)) == 1",
    "tree.query(points, 3)[1][:, [0, 2]]": "(it[:, 0] == np.arange(len(points))).all()",
}


@pytest.mark.parametrize("call", ANSWERS)
def test_what_an_answer_says_works(call: str, known: dict[str, Any]) -> None:
    it = eval(call, dict(known))
    assert eval(ANSWERS[call], {**known, "it": it}), it


# What needs a package that is not there, and the command that brings it.
LAZY = {
    "PIL": ("nacre.io.images.read_depth('a.png')", 'pip install "nacre[images]"'),
    "jinja2": ("nacre.report.render_page(nacre.report.ReportData('empty'))", 'pip install "nacre[report]"'),
    "OpenEXR": ("nacre.io.images.read_depth('a.exr')", 'pip install "nacre[exr]"'),
    "rosbags": ("nacre.open_sequence('a.bag')", 'pip install "nacre[ros]"'),
    "open3d": ("model.to_open3d()", "pip install open3d"),
    "trimesh": ("model.to_trimesh()", "pip install trimesh"),
}


@pytest.mark.parametrize("package", LAZY)
def test_a_missing_package_comes_with_the_command_that_brings_it(package: str, tmp_path: Path) -> None:
    call, command = LAZY[package]
    for name in ("a.png", "a.exr"):
        (tmp_path / name).write_bytes(b"")
    (tmp_path / "a.bag").write_bytes(b"#ROSBAG V2.0\n")
    program = f"""
import os, sys; sys.modules[{package!r}] = None
import numpy as np, nacre, nacre.io.images, nacre.report, nacre.viewer
os.chdir({str(tmp_path)!r})
model = nacre.Model(nacre.Camera(8, 8, 8, 8, 4, 4))
{call}
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert done.returncode == 1
    last = done.stderr.splitlines()[-1]
    assert last.startswith("ImportError: ")
    assert last.endswith(command)
