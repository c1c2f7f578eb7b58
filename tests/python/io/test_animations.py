"""Animated GLB files: what they play is what was written, frame by frame."""

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from played_animation import played

import nacre

Array = npt.NDArray[Any]
SQUARE = np.array([[0, 1, 3], [0, 3, 2]])


def bending_strip(num_frames: int = 20, num_points: int = 30) -> tuple[Array, Array]:
    """Return the vertices of a strip that bends to an arc, at each frame, and its triangles."""
    s = np.repeat(np.linspace(-0.1, 0.1, num_points), 2)
    width = np.tile([0.0, 0.02], num_points)
    frames = []
    for bend in np.linspace(1e-3, 2.0, num_frames):
        angle = bend * s / 0.2
        frames.append(np.stack([0.2 / bend * np.sin(angle), width, 0.2 / bend * (1 - np.cos(angle))], axis=1))
    rows = 2 * np.arange(num_points - 1)[:, None, None]
    return np.array(frames), (rows + SQUARE).reshape(-1, 3)


@pytest.mark.parametrize("tolerance", [1e-3, 1e-5])
def test_what_is_played_is_within_the_tolerance_of_every_frame(tmp_path: Path, tolerance: float) -> None:
    vertices, triangles = bending_strip()
    nacre.write_animation(tmp_path / "strip.glb", vertices, triangles, tolerance=tolerance)
    times, shapes, _ = played(tmp_path / "strip.glb")
    assert np.allclose(np.diff(times), 1 / 30)
    assert np.linalg.norm(shapes - vertices, axis=2).max() < tolerance + 1e-7


def test_a_simple_motion_needs_few_displacements_however_many_frames(tmp_path: Path) -> None:
    vertices, triangles = bending_strip(num_frames=100)
    nacre.write_animation(tmp_path / "strip.glb", vertices, triangles)
    _, _, document = played(tmp_path / "strip.glb")
    assert len(document["meshes"][0]["primitives"][0]["targets"]) <= 6


def test_far_from_the_origin_nothing_is_lost(tmp_path: Path) -> None:
    vertices, triangles = bending_strip()
    nacre.write_animation(tmp_path / "strip.glb", vertices + 1e6, triangles, tolerance=1e-5)
    assert np.abs(played(tmp_path / "strip.glb")[1] - vertices - 1e6).max() < 2e-5


def test_normals_and_colours_come_along(tmp_path: Path) -> None:
    vertices, triangles = bending_strip()
    normals = np.tile([0.0, 0.0, 1.0], (*vertices.shape[:2], 1))
    colors = np.full((vertices.shape[1], 3), 200, np.uint8)
    nacre.write_animation(tmp_path / "strip.glb", vertices, triangles, normals=normals, colors=colors)
    _, _, document = played(tmp_path / "strip.glb")
    (primitive,) = document["meshes"][0]["primitives"]
    assert {"POSITION", "NORMAL", "COLOR_0"} == set(primitive["attributes"])
    assert all({"POSITION", "NORMAL"} == set(target) for target in primitive["targets"])


def test_readers_without_animation_get_the_first_frame(tmp_path: Path) -> None:
    vertices, triangles = bending_strip()
    nacre.write_animation(tmp_path / "strip.glb", vertices, triangles)
    mesh = nacre.read_mesh(tmp_path / "strip.glb")
    assert np.allclose(mesh.vertices, vertices[0], atol=1e-6)
    assert (mesh.triangles == triangles).all()
    trimesh = pytest.importorskip("trimesh")
    other = trimesh.load(tmp_path / "strip.glb", force="mesh", process=False)
    assert np.allclose(other.vertices, vertices[0], atol=1e-6)


def test_what_stands_still_has_no_animation(tmp_path: Path) -> None:
    vertices, triangles = bending_strip(num_frames=1)
    nacre.write_animation(tmp_path / "still.glb", np.repeat(vertices, 3, axis=0), triangles)
    assert b"animations" not in (tmp_path / "still.glb").read_bytes()
    assert len(nacre.read_mesh(tmp_path / "still.glb").triangles) == len(triangles)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"vertices": np.zeros((4, 3))}, r"vertices must have shape \(F, N, 3\), got \(4, 3\)"),
        ({"vertices": np.full((2, 4, 3), np.nan)}, "vertices must be finite, got 24 values"),
        ({"normals": np.zeros((2, 3, 3))}, r"normals must have shape \(2, 4, 3\)"),
        ({"times": [0.0]}, r"times must have one entry per frame \(2\)"),
        ({"times": [1.0, 1.0]}, "times must be finite and increase"),
        ({"tolerance": -1.0}, "tolerance must be a length in metres, got -1.0"),
        ({"path": "moving.ply"}, "animations are written to .glb, got 'moving.ply'"),
    ],
)
def test_what_does_not_fit_is_named(tmp_path: Path, changes: dict[str, Any], message: str) -> None:
    given = {"path": tmp_path / "moving.glb", "vertices": np.zeros((2, 4, 3)), "triangles": SQUARE} | changes
    with pytest.raises(ValueError, match=message):
        nacre.write_animation(**given)
    assert not list(tmp_path.iterdir())
