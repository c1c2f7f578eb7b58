"""Triangles over points: geometry that is known, open borders, misuse."""

from __future__ import annotations

import math
import sys
from pathlib import Path

import numpy as np
import pytest

import nacre
from nacre.cli import main

pytest.importorskip("skimage")
from nacre.meshing import mesh_points


def sphere(n: int, radius: float = 0.1) -> tuple[np.ndarray, np.ndarray]:
    """Return a Fibonacci lattice on a sphere, and its normals."""
    i = np.arange(n) + 0.5
    z, angle = 1 - 2 * i / n, math.pi * (1 + math.sqrt(5)) * i
    ring = np.sqrt(1 - z * z)
    normals = np.stack([ring * np.cos(angle), ring * np.sin(angle), z], axis=1)
    return radius * normals, normals


def edges(mesh: nacre.Mesh) -> np.ndarray:
    """Return how many triangles have each edge."""
    ends = np.concatenate([mesh.triangles[:, [i, (i + 1) % 3]] for i in range(3)])
    return np.unique(np.sort(ends, axis=1), axis=0, return_counts=True)[1]


def triangle_normals(mesh: nacre.Mesh) -> np.ndarray:
    a, b, c = (mesh.vertices[mesh.triangles[:, i]] for i in range(3))
    normals = np.cross(b - a, c - a)
    return normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)


def test_a_sphere_is_closed_round_and_faces_outwards() -> None:
    mesh = mesh_points(*sphere(6000))
    assert (edges(mesh) == 2).all()
    assert len(mesh.vertices) - len(edges(mesh)) + len(mesh.triangles) == 2  # Euler
    assert np.abs(np.linalg.norm(mesh.vertices, axis=1) - 0.1).max() < 1e-4
    middles = mesh.vertices[mesh.triangles].mean(axis=1)
    outwards = np.einsum("ij,ij->i", triangle_normals(mesh), middles)
    assert (outwards > 0).mean() > 0.999


def test_a_plane_ends_where_its_points_do() -> None:
    x, y = np.meshgrid(np.linspace(0, 0.1, 41), np.linspace(0, 0.05, 21))
    points = np.stack([x, y, np.zeros_like(x)], axis=-1).reshape(-1, 3)
    mesh = mesh_points(points, np.tile([0, 0, 1.0], (len(points), 1)))
    assert np.abs(mesh.vertices[:, 2]).max() < 1e-9
    low, high = mesh.bounds
    assert np.allclose(low[:2], [0, 0], atol=0.006)
    assert np.allclose(high[:2], [0.1, 0.05], atol=0.006)
    assert (edges(mesh) <= 2).all()


def test_two_sides_of_a_thin_sheet_stay_two() -> None:
    x, y = np.meshgrid(np.linspace(0, 0.1, 41), np.linspace(0, 0.1, 41))
    flat = np.stack([x, y, np.zeros_like(x)], axis=-1).reshape(-1, 3)
    up = np.tile([0, 0, 1.0], (len(flat), 1))
    mesh = mesh_points(np.concatenate([flat, flat - [0, 0, 0.0035]]), np.concatenate([up, -up]), cell=0.001)
    heights = mesh.vertices[:, 2]
    inside = (np.abs(mesh.vertices[:, :2] - 0.05) < 0.04).all(axis=1)
    assert np.minimum(np.abs(heights), np.abs(heights + 0.0035))[inside].max() < 2e-4


def test_smaller_cells_give_more_triangles_of_the_same_surface() -> None:
    points, normals = sphere(3000)
    coarse, fine = (mesh_points(points, normals, cell=cell) for cell in (0.006, 0.003))
    assert 3 * len(coarse.triangles) < len(fine.triangles)
    assert np.abs(np.linalg.norm(fine.vertices, axis=1) - 0.1).max() < 2e-4


def test_points_that_are_not_finite_do_not_count() -> None:
    points, normals = sphere(3000)
    points[::100] = np.nan
    assert len(mesh_points(points, normals).triangles) > 1000


def test_any_number_of_threads_gives_the_same_mesh() -> None:
    one, two = (mesh_points(*sphere(2000), num_threads=n) for n in (1, 2))
    assert np.array_equal(one.vertices, two.vertices)
    assert np.array_equal(one.triangles, two.triangles)


@pytest.mark.parametrize(
    ("points", "normals", "more", "message"),
    [
        (sphere(5)[0], sphere(5)[1], {}, "points must be at least 12 finite ones, got 5"),
        (sphere(50)[0], sphere(40)[1], {}, r"normals must have one row per point \(50\), got 40"),
        (*sphere(50), {"cell": -1.0}, r"cell must be positive \[m\], got -1.0"),
        (*sphere(50), {"cell": math.nan}, r"cell must be positive"),
        (*sphere(50), {"cell": 5.0}, "points are too sparse for cells of 5 m"),
    ],
)
def test_misuse(points: np.ndarray, normals: np.ndarray, more: dict[str, float], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        mesh_points(points, normals, **more)


def test_without_scikit_image_one_line_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "skimage.measure", None)
    with pytest.raises(ImportError, match=r'pip install "nacre\[mesh\]"'):
        mesh_points(*sphere(100))


class TestCommand:
    def test_it_writes_the_mesh(self, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
        points, normals = sphere(2000)
        nacre.write_points(tmp_path / "model.ply", points, normals=normals)
        with pytest.raises(SystemExit) as end:
            main(["mesh", str(tmp_path)])
        assert not end.value.code
        mesh = nacre.read_mesh(tmp_path / "mesh.ply")
        assert f"triangles  {len(mesh.triangles)}" in capsys.readouterr().out

    def test_points_without_normals_are_refused(
        self, tmp_path: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        nacre.write_points(tmp_path / "points.ply", sphere(200)[0])
        with pytest.raises(SystemExit) as end:
            main(["mesh", str(tmp_path / "points.ply")])
        assert end.value.code == 1
        assert "has no normals" in capsys.readouterr().err
        assert not (tmp_path / "mesh.ply").exists()
