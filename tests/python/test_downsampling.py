"""One point in place of all that share a voxel."""

from __future__ import annotations

import math
import statistics
from pathlib import Path

import numpy as np
import pytest

import nacre

RNG = np.random.default_rng(7)
POINTS = RNG.uniform(-1, 1, (500, 3))
NORMALS = RNG.normal(size=(500, 3))
COLORS = RNG.integers(0, 256, (500, 3)).astype(np.uint8)
SIZE = 0.4


def voxels(points: np.ndarray) -> dict[tuple[int, ...], list[int]]:
    """Return the rows in each voxel, one at a time."""
    rows: dict[tuple[int, ...], list[int]] = {}
    for row, point in enumerate(points):
        rows.setdefault(tuple(math.floor(x / SIZE) for x in point), []).append(row)
    return rows


def test_each_voxel_has_the_mean_of_its_points_in_the_order_of_the_voxels() -> None:
    rows = voxels(POINTS)
    thin = nacre.voxel_downsample(POINTS, SIZE)
    expected = [POINTS[rows[voxel]].mean(axis=0) for voxel in sorted(rows)]
    np.testing.assert_allclose(thin.points, expected, rtol=0, atol=1e-15)


def test_normals_colours_and_attributes_come_along() -> None:
    rows = voxels(POINTS)
    kinds = RNG.integers(0, 4, 500).astype(np.int16)
    values = {"height": POINTS[:, 2], "kind": kinds, "pair": POINTS[:, :2]}
    thin = nacre.voxel_downsample(POINTS, SIZE, normals=NORMALS, colors=COLORS, attributes=values)
    unit = NORMALS / np.linalg.norm(NORMALS, axis=1, keepdims=True)
    for i, voxel in enumerate(sorted(rows)):
        mean = unit[rows[voxel]].mean(axis=0)
        np.testing.assert_allclose(thin.normals[i], mean / np.linalg.norm(mean), atol=1e-5)
        np.testing.assert_array_equal(thin.colors[i], np.rint(COLORS[rows[voxel]].mean(axis=0)))
        assert thin.attributes["kind"][i] in statistics.multimode(kinds[rows[voxel]].tolist())
    assert thin.attributes["kind"].dtype == np.int16
    np.testing.assert_allclose(thin.attributes["height"], thin.points[:, 2])
    np.testing.assert_allclose(thin.attributes["pair"], thin.points[:, :2])


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        ([2, 6, 6], 6),  # ground and building are not vegetation between them
        ([1, 9, 2, 9, 1], 1),  # of two that are as common, the one nearer to the mean 4.4
        ([100, 110, 300], 110),  # of intensities that are all different likewise: mean 170
    ],
)
def test_classes_are_not_averaged(values: list[int], expected: int) -> None:
    classes = np.array(values, np.uint16)
    points = np.full((len(values), 3), 0.1)
    both = {"class": classes, "two": np.stack([classes, classes[::-1]], axis=1)}
    for order in (slice(None), slice(None, None, -1)):
        rows = {name: column[order] for name, column in both.items()}
        thin = nacre.voxel_downsample(points, SIZE, attributes=rows).attributes
        assert thin["class"].tolist() == [expected]
        assert thin["two"].tolist() == [[expected, expected]]
        assert thin["class"].dtype == thin["two"].dtype == np.uint16


def test_a_cloud_brings_its_own(tmp_path: Path) -> None:
    nacre.write_points(
        tmp_path / "a.ply", POINTS, normals=NORMALS, colors=COLORS, attributes={"i": NORMALS[:, 0]}
    )
    thin = nacre.voxel_downsample(nacre.read_points(tmp_path / "a.ply"), SIZE)
    given = nacre.voxel_downsample(
        POINTS, SIZE, normals=NORMALS, colors=COLORS, attributes={"i": NORMALS[:, 0]}
    )
    assert thin == given


def test_the_order_of_the_points_does_not_matter() -> None:
    thin = nacre.voxel_downsample(POINTS, SIZE).points
    np.testing.assert_allclose(nacre.voxel_downsample(POINTS[::-1], SIZE).points, thin, rtol=0, atol=1e-15)


def test_a_voxel_begins_at_multiples_of_its_size() -> None:
    edge = np.array([[0.0, 0, 0], [0.39, 0, 0], [0.4, 0, 0], [-1e-9, 0, 0]])
    assert len(nacre.voxel_downsample(edge, SIZE)) == 3


@pytest.mark.parametrize("dtype", [np.float32, np.float64, np.int32])
def test_types_are_kept_and_whole_numbers_become_floats(dtype: type) -> None:
    points = (10 * POINTS).astype(dtype)
    assert nacre.voxel_downsample(points, SIZE).points.dtype == (dtype if dtype != np.int32 else np.float64)


def test_what_is_unknown_is_left_out() -> None:
    points = np.array([[0.1, 0, 0], [0.2, 0, 0], [np.nan, 0, 0], [0.9, 0, 0]])
    normals = np.array([[0.0, 0, 2], [np.nan, 0, 0], [0, 0, 1], [0, 0, 0]])
    values = np.array([np.nan, 4.0, 5.0, np.nan])
    thin = nacre.voxel_downsample(points, SIZE, normals=normals, attributes={"a": values})
    np.testing.assert_allclose(thin.points[:, 0], [0.15, 0.9])
    np.testing.assert_array_equal(thin.normals, [[0, 0, 1], [np.nan] * 3])
    np.testing.assert_array_equal(thin.attributes["a"], [4.0, np.nan])


def test_normals_that_cancel_are_unknown() -> None:
    thin = nacre.voxel_downsample(np.zeros((2, 3)), 1.0, normals=[[0, 0, 1], [0, 0, -1]])
    assert np.isnan(thin.normals).all()


@pytest.mark.parametrize("points", [np.zeros((0, 3)), np.full((4, 3), np.nan)])
def test_nothing_gives_nothing(points: np.ndarray) -> None:
    count = len(points)
    thin = nacre.voxel_downsample(points, 1.0, normals=points, colors=np.zeros((count, 3), np.uint8))
    assert len(thin) == len(thin.normals) == len(thin.colors) == 0


@pytest.mark.parametrize(
    ("arguments", "error", "words"),
    [
        ({"voxel_size": 0.0}, ValueError, "voxel_size must be positive and finite, got 0"),
        ({"voxel_size": -1.0}, ValueError, "voxel_size must be at least 0, got -1"),
        ({"voxel_size": np.nan}, ValueError, "voxel_size must be at least 0, got nan"),
        ({"voxel_size": np.inf}, ValueError, "voxel_size must be positive and finite, got inf"),
        ({"voxel_size": 1e-320}, ValueError, "voxel_size must not be so small beside the points' coord"),
        ({"voxel_size": "1 cm"}, TypeError, "voxel_size must be a number, got '1 cm'"),
        ({"points": np.zeros((4, 2))}, ValueError, r"points must have shape \(N, 3\), got \(4, 2\)"),
        ({"normals": np.zeros((3, 3))}, ValueError, r"normals must have one row per point of points \(500\)"),
        ({"colors": np.zeros((3, 3))}, ValueError, r"colors must have shape \(500, 3\), got \(3, 3\)"),
        ({"colors": np.full((500, 3), np.nan)}, ValueError, "colors must be .*floats from 0 to 1, got"),
        ({"attributes": {"a": [1, 2]}}, ValueError, r"attributes\['a'\] must have one row per point"),
        ({"attributes": {"a": ["x"] * 500}}, TypeError, r"attributes\['a'\] must be an array of real"),
    ],
)
def test_misuse(arguments: dict, error: type[Exception], words: str) -> None:
    with pytest.raises(error, match=words):
        nacre.voxel_downsample(**{"points": POINTS, "voxel_size": SIZE, **arguments})
