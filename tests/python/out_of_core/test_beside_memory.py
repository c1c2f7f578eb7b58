"""What comes out of core is what comes out in memory."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
from hills import CELLS, ORIGIN, hills, write

import nacre
from nacre import out_of_core
from nacre.out_of_core import consolidation


def ordered(cloud: nacre.Cloud) -> nacre.Cloud:
    """Return a cloud in the order of its coordinates."""
    return cloud[np.lexsort(cloud.points.T)]


def assert_same_points(a: nacre.Cloud, b: nacre.Cloud) -> None:
    """Check that points and all that they have are the same, to the last bit."""
    np.testing.assert_array_equal(a.points, b.points)
    np.testing.assert_array_equal(a.colors, b.colors)
    assert a.attributes.keys() == b.attributes.keys()
    for name, values in a.attributes.items():
        np.testing.assert_array_equal(values, b.attributes[name], strict=True)


def test_normals(scan: Path, tmp_path: Path) -> None:
    above = ORIGIN + np.array([0, 0, 1e4])
    result = out_of_core.estimate_normals(scan, tmp_path / "n.ply", viewpoint=above, **CELLS)
    found, cloud = ordered(nacre.read_points(tmp_path / "n.ply")), ordered(hills())
    assert_same_points(found, cloud)
    expected = nacre.estimate_normals(cloud.points, max_radius=result.halo, viewpoint=above)
    np.testing.assert_allclose(found.normals, expected, atol=1e-6)


def test_surveys_keep_their_millimetres_and_what_the_scanner_told(tmp_path: Path) -> None:
    pytest.importorskip("laspy")
    write(tmp_path / "a.laz", hills())
    out_of_core.estimate_normals(tmp_path / "a.laz", tmp_path / "b.las", **CELLS)
    out_of_core.estimate_normals(
        tmp_path / "b.las", tmp_path / "c.laz", **{**CELLS, "points_per_cell": 3_000}
    )
    found, cloud = ordered(nacre.read_points(tmp_path / "c.laz")), ordered(hills())
    np.testing.assert_allclose(found.points, cloud.points, rtol=0, atol=1e-6)
    assert_same_points(nacre.Cloud(cloud.points, None, found.colors, found.attributes), cloud)
    assert found.normals is not None
    np.testing.assert_allclose(np.linalg.norm(found.normals, axis=1), 1, atol=1e-5)


def test_downsampling(scan: Path, tmp_path: Path) -> None:
    out_of_core.voxel_downsample(scan, tmp_path / "v.ply", 0.3, **CELLS)
    found, cloud = nacre.read_points(tmp_path / "v.ply"), hills()
    expected = nacre.voxel_downsample(cloud, 0.3)  # in the order of the voxels
    found = found[np.lexsort(np.floor(found.points / 0.3).T[::-1])]
    np.testing.assert_allclose(found.points, expected.points, rtol=0, atol=1e-8)
    np.testing.assert_array_equal(found.colors, expected.colors)
    nearest = np.asarray(nacre.KdTree(cloud.points).query(found.points, 8)[1])
    for name, values in found.attributes.items():  # of a point near the mean, and no mean of classes
        assert (cloud.attributes[name][nearest] == values[:, None]).any(axis=1).mean() > 0.95


def test_outliers(tmp_path: Path) -> None:
    cloud = hills()
    stray = ORIGIN + np.random.default_rng(1).uniform([0, 0, 3], [20, 20, 6], (40, 3))
    points = np.concatenate([cloud.points, stray])
    nacre.write_points(tmp_path / "dirty.ply", points)
    out_of_core.remove_outliers(tmp_path / "dirty.ply", tmp_path / "clean.ply", max_radius=4.0, **CELLS)
    distances = np.asarray(nacre.KdTree(points).query(points, 17)[0])[:, 1:]
    means = np.minimum(distances, 4.0).mean(axis=1)
    expected = points[means <= means.mean() + 2 * means.std()]
    found = nacre.read_points(tmp_path / "clean.ply").points
    np.testing.assert_array_equal(found[np.lexsort(found.T)], expected[np.lexsort(expected.T)])
    assert (found[:, 2] < ORIGIN[2] + 2).all()


def seam(scan: Path, folder: Path, **options: object) -> float:
    """Return how much cutting a cloud into cells moves 99 % of its samples at most, in radii."""
    found: list[npt.NDArray[np.float64]] = []
    for points_per_cell in (6_000, 10**9):
        result = out_of_core.consolidate(
            scan, folder / "w.ply", num_points=2000, points_per_cell=points_per_cell, memory="1GB", **options
        )
        found.append(nacre.read_points(folder / "w.ply").points - ORIGIN)
    return float(np.quantile(nacre.KdTree(found[0]).query(found[1], 1)[0], 0.99)) / result.radius


@pytest.mark.parametrize("method", ["wlop", "wlop+", "cgal"])
def test_the_halo_of_wlop_is_enough(
    method: str, scan: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A cell moves its samples as the whole cloud does, but for rounding; a third of the halo does not."""
    assert seam(scan, tmp_path, method=method, iterations=4) < 2e-5
    monkeypatch.setattr(consolidation, "_RADII_OF_A_STEP", 0.6)
    assert seam(scan, tmp_path, method=method, iterations=4) > 1e-3


def test_consolidation_is_even_and_near_the_surface(scan: Path, tmp_path: Path) -> None:
    cloud = hills()
    result = out_of_core.consolidate(scan, tmp_path / "w.ply", num_points=2000, **CELLS)
    assert (result.num_input, result.num_points) == (len(cloud), 2000)
    in_memory = nacre.consolidate(cloud.points, num_points=2000)
    assert result.radius == pytest.approx(in_memory.radius, rel=0.05)
    found = nacre.read_points(tmp_path / "w.ply")
    even = [nacre.evaluation.uniformity(p).coefficient_of_variation for p in (found.points, in_memory.points)]
    assert even[0] == pytest.approx(even[1], abs=0.03)
    nearest = np.asarray(nacre.KdTree(cloud.points).query(found.points, 1)[1])
    for name, values in found.attributes.items():
        np.testing.assert_array_equal(values, cloud.attributes[name][nearest])


def test_evaluation(scan: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("nacre.out_of_core.evaluation._ROWS_AT_ONCE", 7_000)
    points, reference = hills().points, hills(3000, seed=1).points
    found = out_of_core.evaluate(scan, reference, tau=(0.1, 0.2))
    accuracy = nacre.evaluation.surface_accuracy(points, reference)
    for name in ("rms", "mean", "median", "p95", "max", "num_points"):
        assert getattr(found.surface_accuracy, name) == pytest.approx(getattr(accuracy, name), rel=1e-3)
    assert found.completeness == nacre.evaluation.completeness(points, reference, tau=(0.1, 0.2))
    assert found.f_score == nacre.evaluation.f_score(points, reference, tau=(0.1, 0.2))


def test_points_in_one_place_give_one_sample(tmp_path: Path) -> None:
    cloud = hills(5000)
    twice = nacre.Cloud(np.repeat(cloud.points, 2, axis=0))
    write(tmp_path / "twice.ply", twice)
    options = {"num_points": 10_000, "iterations": 0, "radius": 0.5, "memory": "1GB"}
    out_of_core.consolidate(tmp_path / "twice.ply", tmp_path / "w.ply", **options)
    found = nacre.read_points(tmp_path / "w.ply").points
    np.testing.assert_array_equal(np.unique(found, axis=0), np.unique(cloud.points, axis=0))
    assert len(found) == len(np.unique(cloud.points, axis=0))


def test_alignment(tmp_path: Path) -> None:
    cloud = hills()
    turn = np.array([[0.9998, -0.02, 0], [0.02, 0.9998, 0], [0, 0, 1]])
    rotation = np.linalg.qr(turn)[0] * np.sign(np.diag(np.linalg.qr(turn)[1]))
    moved = (cloud.points - ORIGIN) @ rotation.T + ORIGIN + np.array([0.1, -0.05, 0.03])
    write(tmp_path / "a.ply", cloud)
    write(tmp_path / "b.ply", nacre.Cloud(moved, None, cloud.colors, cloud.attributes))
    done = out_of_core.align(
        tmp_path / "b.ply", tmp_path / "a.ply", tmp_path / "c.ply", max_distance=1.0, memory="1GB"
    )
    assert done.converged
    back = nacre.read_points(tmp_path / "c.ply")
    np.testing.assert_allclose(back.points, cloud.points, rtol=0, atol=0.005)
    assert_same_points(nacre.Cloud(cloud.points, None, back.colors, back.attributes), cloud)
