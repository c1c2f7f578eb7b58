"""What a newcomer does wrong, and what the command line then says to do."""

from __future__ import annotations

import contextlib
import io
import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

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
