"""Triangles over points: geometry that is known, open borders, misuse."""

from __future__ import annotations

import math
import sys
from pathlib import Path

import numpy as np
import pytest

import nacre
from nacre.cli import main
from nacre.meshing import close_surface, largest_part, mesh_points, on_surface, simplify, triangulate
from nacre.meshing.surface_points import on_main_parts


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


class TestOnMainParts:
    """An object of 4000 points, and a part of 39 beside it."""

    FEW = 39

    def both(self) -> tuple[np.ndarray, np.ndarray]:
        points, normals = sphere(4000)
        few, facing = sphere(self.FEW)
        return (
            np.concatenate([points, 0.1 * few + [0.2, 0, 0]]).astype(np.float32),
            np.concatenate([normals, facing]).astype(np.float32),
        )

    def test_scraps_are_told_from_the_object(self) -> None:
        points, normals = self.both()
        nowhere = np.zeros(len(points), bool)
        assert on_main_parts(points, normals, nowhere).tolist() == [True] * 4000 + [False] * self.FEW
        larger = slice(1000, None)  # of fewer points a part of 39 is more than a hundredth
        assert on_main_parts(points[larger], normals[larger], nowhere[larger])[-self.FEW :].all()
        assert not len(on_main_parts(points[:0], normals[:0], nowhere[:0]))

    def test_a_part_goes_where_most_of_it_lies_on_the_plane_and_the_object_stays(self) -> None:
        points, normals = (rows[1000:] for rows in self.both())
        lies = np.ones(len(points), bool)
        assert on_main_parts(points, normals, lies).tolist() == [True] * 3000 + [False] * self.FEW
        lies[-20:] = False
        assert on_main_parts(points, normals, lies).all()


class TestCloseSurface:
    def test_noise_of_the_points_is_averaged(self) -> None:
        points, normals = sphere(2000)
        noise = 0.0016  # a fifth of the distance between points
        errors = np.random.default_rng(0).normal(0, noise, (2000, 1))
        surface = close_surface(points + errors * normals, normals)
        radii = np.linalg.norm(surface.vertices, axis=1)
        assert np.sqrt(np.mean((radii - 0.1) ** 2)) < 0.37 * noise

    @pytest.mark.parametrize("scale", [0.7, 1.0, 1.4])
    def test_its_cells_are_half_as_large_as_points_are_apart(self, scale: float) -> None:
        points, normals = sphere(6000)
        points, normals = scale * points[points[:, 2] < 0.05], normals[points[:, 2] < 0.05]
        apart = np.median(nacre.KdTree(points).query(points, 7)[0][:, 1:].mean(axis=1))
        vertices = close_surface(points, normals).vertices
        # Marching cubes cut the edges of cells: two coordinates of each vertex are multiples of their size.
        values, counts = np.unique(np.round(vertices[:, 0], 7), return_counts=True)
        cell = np.median(np.diff(values[counts > 8]))
        assert 0.35 < cell / apart < 0.71

    def test_a_bubble_through_a_few_stray_points_goes(self) -> None:
        points, normals = sphere(4000)
        few, outwards = sphere(20)
        stray = 0.08 * few + [0.3, 0, 0]
        surface = close_surface(np.concatenate([points, stray]), np.concatenate([normals, outwards]))
        assert surface.vertices[:, 0].max() < 0.11
        assert largest_part(surface.triangles).shape == surface.triangles.shape

    def test_a_sphere_without_its_cap_is_closed_and_the_cap_is_a_guess(self) -> None:
        points, normals = sphere(4000)
        low = points[:, 2] < 0.08
        surface = close_surface(points[low] + [100, 0, 0], normals[low])
        mesh = nacre.Mesh(surface.vertices, surface.triangles)
        assert (edges(mesh) == 2).all()
        away = surface.vertices - [100, 0, 0]
        radius = np.linalg.norm(away, axis=1)
        lower = away[:, 2] < 0.07
        assert np.abs(radius[lower] - 0.1).max() < 0.001  # a quarter of the distance between points
        assert surface.is_seen[lower].all()
        assert not surface.is_seen[np.hypot(away[:, 0], away[:, 1]) + (away[:, 2] < 0) < 0.03].any()
        outward = np.einsum("ij,ij->i", surface.normals, away / radius[:, None])
        assert outward[lower].min() > 0.95

    def test_a_surface_that_cannot_close_is_told(self) -> None:
        """The corner of a room, seen from inside."""
        y, x = np.mgrid[0:1:20j, 0:1:20j].reshape(2, -1)
        flat = np.stack([x, y, np.zeros(400)], axis=1)
        points = np.concatenate([np.roll(flat, i, axis=1) for i in range(3)])
        normals = np.repeat(np.eye(3)[[2, 0, 1]], 400, axis=0)
        with pytest.warns(UserWarning, match="the surface is open where its guess ends") as told:
            surface = close_surface(points, normals)
        assert [warning.filename for warning in told] == [__file__]
        assert (edges(nacre.Mesh(surface.vertices, surface.triangles)) == 1).any()

    def test_misuse(self) -> None:
        points, normals = sphere(50)
        with pytest.raises(ValueError, match="points must be 10 or more for a surface, got 9"):
            close_surface(points[:9], normals[:9])
        with pytest.raises(ValueError, match="most of them are in one place"):
            close_surface(np.zeros((50, 3)), normals)

    def test_without_the_library(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setitem(sys.modules, "gpytoolbox", None)
        with pytest.raises(ImportError, match=r'pip install "nacre\[closed\]"'):
            close_surface(*sphere(50))


class TestSimplify:
    def test_a_round_thing_stays_round(self) -> None:
        points, normals = sphere(6000)
        far = points.astype(np.float64) + np.array([1e6, 0, 0])
        vertices, triangles = simplify(far, triangulate(points, normals), 1000)
        assert len(triangles) == 1000
        assert vertices.dtype == np.float64
        assert (edges(nacre.Mesh(vertices, triangles)) == 2).all()
        radius = np.linalg.norm(vertices - [1e6, 0, 0], axis=1)
        assert np.abs(radius - 0.1).max() < 0.0005  # of edges of 16 mm, whose middle is 0.3 mm deep

    def test_parts_that_touch_in_a_corner_do_not_grow_together(self) -> None:
        points, normals = sphere(500)
        triangles = triangulate(points, normals)
        second = triangles + len(points)
        second[second == len(points)] = 0  # the second sphere, beside the first, has its first corner
        beside = points + 2 * points[0]
        vertices, left = simplify(np.concatenate([points, beside]), np.concatenate([triangles, second]), 600)
        assert 590 < len(left) <= 600
        assert (edges(nacre.Mesh(vertices, left)) == 2).all()
        assert 200 < len(largest_part(left)) < 400

    def test_open_borders_stay_where_they_are(self) -> None:
        x, y = (a.ravel() / 60 for a in np.mgrid[0:61, 0:61])
        plane = np.stack([x, y, 0 * x], axis=1)
        vertices, left = simplify(plane, triangulate(plane, np.tile([0, 0, 1.0], (len(plane), 1))), 100)
        a, b, c = (vertices[left[:, i]] for i in range(3))
        assert np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2 == pytest.approx(1, abs=0.01)

    def test_few_triangles_stay_as_they_are(self) -> None:
        points, normals = sphere(100)
        triangles = triangulate(points, normals)
        vertices, left = simplify(points, triangles, 1000)
        assert np.array_equal(left, triangles)
        assert np.array_equal(vertices, points)

    def test_misuse(self) -> None:
        with pytest.raises(ValueError, match="num_triangles must be an integer of at least 1, got 0"):
            simplify(np.eye(3), [[0, 1, 2]], 0)

    def test_without_the_library(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setitem(sys.modules, "gpytoolbox", None)
        with pytest.raises(ImportError, match=r'pip install "nacre\[simplify\]"'):
            simplify(np.eye(3), [[0, 1, 2], [2, 1, 0]], 1)


class TestLargestPart:
    def test_it_has_the_most_triangles(self) -> None:
        triangles = [[0, 1, 2], [3, 4, 5], [5, 6, 7], [8, 9, 0]]
        assert largest_part(triangles).tolist() == [[0, 1, 2], [8, 9, 0]]
        assert largest_part([*triangles, [7, 10, 11]]).tolist() == [[3, 4, 5], [5, 6, 7], [7, 10, 11]]
        assert len(largest_part(np.zeros((0, 3), int))) == 0

    def test_misuse(self) -> None:
        with pytest.raises(ValueError, match="triangles must"):
            largest_part([[0, 1, -1]])


class TestCommand:
    def test_parts_fewer_triangles_and_closed(
        self, tmp_path: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        points, normals = sphere(2000)
        low = points[:, 2] < 0.06
        both = np.concatenate([points[low], 0.2 * points[:200] + [0.5, 0, 0]])
        colors = np.tile(np.array([200, 10, 10], np.uint8), (len(both), 1))
        facing = np.concatenate([normals[low], normals[:200]])
        nacre.write_points(tmp_path / "model.ply", both, normals=facing, colors=colors)

        def made(*options: str) -> tuple[nacre.Mesh, nacre.io.cloud.Cloud]:
            with pytest.raises(SystemExit) as end:
                main(["mesh", str(tmp_path), *options])
            assert not end.value.code
            return nacre.read_mesh(tmp_path / "mesh.ply"), nacre.read_points(tmp_path / "mesh.ply")

        whole, _ = made()
        largest, corners = made("--keep", "largest")
        assert np.array_equal(corners.points, points[low])
        assert 350 < len(whole.triangles) - len(largest.triangles) < 400
        few, corners = made("--keep", "largest", "--simplify", "500")
        assert 490 < len(few.triangles) <= 500
        assert np.array_equal(corners.colors, colors[: len(corners)])
        capsys.readouterr()
        closed, corners = made("--keep", "largest", "--closed")
        assert (edges(closed) == 2).all()
        seen = corners.attributes["seen"] == 1
        assert 0.9 < seen.mean() < 0.99  # its triangles are larger where there are no points
        a, b, c = (closed.vertices[closed.triangles[:, i]] for i in range(3))
        areas = np.linalg.norm(np.cross(b - a, c - a), axis=1)
        part = np.average(seen[closed.triangles].mean(axis=1), weights=areas)
        assert f"seen       {part:.1%} of the area; the rest is a guess" in capsys.readouterr().out
        assert (corners.colors[seen] == [200, 10, 10]).all()
        assert (corners.colors[~seen] == 128).all()

    def test_it_writes_the_mesh(self, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
        points, normals = sphere(2000)
        colors = np.arange(6000).reshape(-1, 3) % 256
        nacre.write_points(tmp_path / "model.ply", points, normals=normals, colors=colors)
        with pytest.raises(SystemExit) as end:
            main(["mesh", str(tmp_path)])
        assert not end.value.code
        mesh = nacre.read_mesh(tmp_path / "mesh.ply")
        assert "triangles  3\N{NARROW NO-BREAK SPACE}996" in capsys.readouterr().out
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
