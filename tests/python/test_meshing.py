"""Triangles over points: geometry that is known, open borders, misuse."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import nacre
from nacre.cli import main
from nacre.meshing import mesh_points, on_surface, triangulate


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


def is_manifold(triangles: np.ndarray) -> bool:
    """Whether each edge has at most one triangle on each side."""
    ends = np.concatenate([triangles[:, [i, (i + 1) % 3]] for i in range(3)])
    return len(np.unique(ends, axis=0)) == len(ends)


def test_a_sphere_is_closed_round_and_faces_outwards() -> None:
    points, normals = sphere(6000)
    triangles = triangulate(points, normals)
    mesh = nacre.Mesh(points, triangles)
    assert is_manifold(triangles)
    assert (edges(mesh) == 2).all()
    assert len(points) - len(edges(mesh)) + len(triangles) == 2  # Euler: every point is a corner
    middles = points[triangles].mean(axis=1)
    assert (np.einsum("ij,ij->i", triangle_normals(mesh), middles) > 0.09).all()
    assert np.linalg.norm(middles, axis=1).min() > 0.1 - 2e-4


def test_they_are_delaunay() -> None:
    from scipy.spatial import Delaunay

    rng = np.random.default_rng(0)
    places = np.stack(np.meshgrid(np.arange(30.0), np.arange(30.0)), axis=-1).reshape(-1, 2)
    places += rng.uniform(-0.3, 0.3, places.shape)
    points = np.column_stack([places, np.zeros(len(places))])
    found = {tuple(sorted(t)) for t in triangulate(points, np.tile([0, 0, 1.0], (len(points), 1))).tolist()}
    inner = ((places > 3) & (places < 26)).all(axis=1)
    expected = {tuple(sorted(t)) for t in Delaunay(places).simplices.tolist() if inner[t].all()}
    assert expected <= found
    assert all(t in expected for t in found if inner[list(t)].all())


def test_a_plane_ends_where_its_points_do() -> None:
    """On a grid four points lie on a circle, and either diagonal is right."""
    x, y = np.meshgrid(np.linspace(0, 0.1, 41), np.linspace(0, 0.05, 21))
    points = np.stack([x, y, np.zeros_like(x)], axis=-1).reshape(-1, 3)
    mesh = mesh_points(points, np.tile([0, 0, 2.0], (len(points), 1)))
    assert len(mesh.triangles) == 2 * 40 * 20
    assert is_manifold(mesh.triangles)
    assert np.allclose(triangle_normals(mesh), [0, 0, 1])
    assert np.array_equal(mesh.vertices, points)


def test_what_was_not_seen_stays_open_and_small_holes_are_closed() -> None:
    x, y = np.meshgrid(np.arange(40.0), np.arange(40.0))
    flat = np.stack([x + 0.5 * (y % 2), 0.866 * y, np.zeros_like(x)], axis=-1).reshape(-1, 3)
    up = np.tile([0, 0, 1.0], (len(flat), 1))
    far = np.linalg.norm(flat - (20, 17, 0), axis=1)
    area = {}
    for name, kept in {"whole": far > -1, "one missing": far > 0.6, "a hole": far > 6}.items():
        mesh = mesh_points(flat[kept], up[kept])
        a, b, c = (mesh.vertices[mesh.triangles[:, i]] for i in range(3))
        is_inner = np.linalg.norm((a + b + c) / 3 - (20, 17, 0), axis=1) < 12
        area[name] = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)[is_inner].sum()
    assert area["one missing"] == pytest.approx(area["whole"], rel=0.005)
    assert area["a hole"] == pytest.approx(area["whole"] - math.pi * 6**2, rel=0.1)


def test_two_sides_of_a_thin_sheet_stay_two() -> None:
    x, y = np.meshgrid(np.linspace(0, 0.1, 41), np.linspace(0, 0.1, 41))
    flat = np.stack([x, y, np.zeros_like(x)], axis=-1).reshape(-1, 3)
    up = np.tile([0, 0, 1.0], (len(flat), 1))
    triangles = triangulate(np.concatenate([flat, flat - [0, 0, 0.001]]), np.concatenate([up, -up]))
    assert ((triangles < len(flat)).sum(axis=1) % 3 == 0).all()
    assert len(triangles) == 2 * 2 * 40 * 40


def test_far_from_the_origin_it_is_the_same() -> None:
    points, normals = sphere(2000)
    far = np.array([4e6, 5e6, 100.0])
    there = points + far
    assert np.array_equal(triangulate(there, normals), triangulate(there - far, normals))
    assert mesh_points(there, normals).vertices.dtype == np.float64


def test_points_that_are_not_finite_do_not_count() -> None:
    points, normals = sphere(3000)
    points[::100] = np.nan
    normals[1::100] = 0
    triangles = triangulate(points, normals)
    assert not np.isin(triangles, np.concatenate([np.arange(0, 3000, 100), np.arange(1, 3000, 100)])).any()
    mesh = mesh_points(points, normals)
    assert len(mesh.vertices) == 2940
    assert np.array_equal(mesh.vertices[0], points[2])


def test_points_in_one_place_make_no_triangle_without_an_area() -> None:
    points, normals = sphere(2000)
    mesh = mesh_points(np.repeat(points, 2, axis=0), np.repeat(normals, 2, axis=0))
    assert is_manifold(mesh.triangles)
    assert np.linalg.norm(triangle_normals(mesh), axis=1).min() > 0.5
    assert len(mesh.triangles) > 3000


def test_any_number_of_threads_gives_the_same_triangles() -> None:
    points, normals = sphere(5000)
    points += np.random.default_rng(0).normal(0, 0.0005, points.shape)
    one = triangulate(points, normals, num_threads=1)
    assert is_manifold(one)
    for n in (2, 5):
        assert np.array_equal(one, triangulate(points, normals, num_threads=n))


@pytest.mark.parametrize(
    ("points", "normals", "message"),
    [
        (sphere(5)[0], sphere(5)[1], "points are too few for a surface"),
        (*np.zeros((2, 0, 3)), "points are too few for a surface"),
        (*np.zeros((2, 50, 3)), "points are too few for a surface"),
        (sphere(50)[0], sphere(40)[1], r"normals must have one row per point of points \(50\), got 40"),
        (np.zeros((3, 2)), np.zeros((3, 2)), "points must have shape"),
    ],
)
def test_misuse(points: np.ndarray, normals: np.ndarray, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        mesh_points(points, normals)


class TestOnSurface:
    def test_a_layer_beneath_litter_and_contrary_normals_are_no_surface(self) -> None:
        points, normals = sphere(6000)
        below, outward = 0.96 * points[:600], normals[:600]  # a cap, 4 mm beneath; points are 4.6 mm apart
        contrary = normals.copy()
        contrary[3000] = -normals[3000]
        litter = np.random.default_rng(0).uniform(0.2, 0.3, (20, 3))
        is_surface = on_surface(
            np.concatenate([points, below, litter]),
            np.concatenate([contrary, outward, np.tile([0, 0, 1.0], (20, 1))]),
            np.concatenate([np.full(6000, 9), np.full(600, 2), np.full(20, 50)]),
        )
        assert np.array_equal(np.flatnonzero(~is_surface[:6000]), [3000])
        assert not is_surface[6000:].any()

    def test_noise_is_a_surface(self) -> None:
        points, normals = sphere(6000)
        rng = np.random.default_rng(1)
        rough = points + rng.normal(0, 0.0005, (6000, 1)) * normals  # a ninth of the distance between points
        assert on_surface(rough, normals, rng.uniform(1, 100, 6000)).all()

    def test_the_same_on_any_number_of_threads(self) -> None:
        rng = np.random.default_rng(2)
        points = rng.uniform(0, 0.1, (4000, 3)) * [1, 1, 0.05]
        up, sure = np.tile([0, 0, 1.0], (4000, 1)), rng.uniform(1, 9, 4000)
        one = on_surface(points, up, sure, num_threads=1)
        assert 0.1 < one.mean() < 0.9
        assert np.array_equal(one, on_surface(points, up, sure, num_threads=3))

    def test_misuse(self) -> None:
        points, normals = sphere(50)
        with pytest.raises(ValueError, match=r"confidence must have one entry per point \(50\)"):
            on_surface(points, normals, np.ones(49))


class TestCommand:
    def test_it_writes_the_mesh(self, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
        points, normals = sphere(2000)
        colors = np.arange(6000).reshape(-1, 3) % 256
        nacre.write_points(tmp_path / "model.ply", points, normals=normals, colors=colors)
        with pytest.raises(SystemExit) as end:
            main(["mesh", str(tmp_path)])
        assert not end.value.code
        mesh = nacre.read_mesh(tmp_path / "mesh.ply")
        assert f"triangles  {len(mesh.triangles)}" in capsys.readouterr().out
        assert len(mesh.triangles) == 3996
        corners = nacre.read_points(tmp_path / "mesh.ply")
        assert np.array_equal(corners.colors, colors)
        assert np.allclose(corners.normals, normals)

    def test_points_without_normals_are_refused(
        self, tmp_path: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        nacre.write_points(tmp_path / "points.ply", sphere(200)[0])
        with pytest.raises(SystemExit) as end:
            main(["mesh", str(tmp_path / "points.ply")])
        assert end.value.code == 1
        assert "has no normals" in capsys.readouterr().err
        assert not (tmp_path / "mesh.ply").exists()
