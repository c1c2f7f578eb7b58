"""COPC files: octrees that laspy's reader opens, with the same bytes whatever the order of the points."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

import nacre
from nacre.io import octree

laspy = pytest.importorskip("laspy")
pytest.importorskip("lazrs")


@pytest.fixture(scope="module")
def cloud() -> nacre.Cloud:
    """Points of a hill in the coordinates of a survey."""
    random = np.random.default_rng(0)
    xy = random.uniform(0, 100, (150_000, 2))
    z = 3 * np.sin(xy[:, 0] / 9) + random.normal(0, 0.02, len(xy))
    points = np.column_stack([xy, z]) + np.array([4_000_000, 5_400_000, 100])
    colors = random.integers(0, 256, (len(xy), 3)).astype(np.uint8)
    attributes = {"intensity": random.integers(0, 60_000, len(xy)).astype(np.uint16)}
    return nacre.Cloud(points, colors=colors, attributes=attributes)


def sorted_rows(cloud: nacre.Cloud) -> npt.NDArray[np.float64]:
    """Return points with what they have, in an order of their own."""
    assert cloud.colors is not None
    rows = np.column_stack([cloud.points, cloud.colors, cloud.attributes["intensity"]])
    return rows[np.lexsort(rows.T)]


@pytest.mark.parametrize("points_per_block", [2_000_000, 20_000], ids=["in memory", "on disk"])
def test_no_point_is_lost(
    cloud: nacre.Cloud, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, points_per_block: int
) -> None:
    monkeypatch.setattr(octree, "_POINTS_PER_BLOCK", points_per_block)
    nacre.write_points(tmp_path / "hill.copc.laz", cloud)
    assert [path.name for path in tmp_path.iterdir()] == ["hill.copc.laz"]
    nacre.write_points(tmp_path / "hill.las", cloud)
    found, expected = (
        sorted_rows(nacre.read_points(tmp_path / f"hill.{end}")) for end in ("copc.laz", "las")
    )
    np.testing.assert_array_equal(found, expected)


def test_each_level_is_an_even_thinning_twice_as_fine_as_the_last(cloud: nacre.Cloud, tmp_path: Path) -> None:
    nacre.write_points(tmp_path / "hill.copc.laz", cloud)
    with laspy.CopcReader.open(tmp_path / "hill.copc.laz") as reader:
        info = reader.copc_info
        levels = [reader.query(level=level) for level in range(3)]
        assert len(reader.query()) == len(cloud)
        root = np.column_stack([levels[0].x, levels[0].y, levels[0].z])
        corner = info.center - info.halfsize
        cells = np.floor((root - corner) / info.spacing)
        assert len(np.unique(cells, axis=0)) == len(root)  # one point in each cell
        every = np.floor((cloud.points - corner) / info.spacing)
        assert len(root) == len(np.unique(every, axis=0))  # and none is empty
    assert len(levels[1]) > 3 * len(levels[0])


def test_the_points_of_a_node_lie_in_its_box(
    cloud: nacre.Cloud, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(octree, "_LEAF", 1000)
    nacre.write_points(tmp_path / "hill.copc.laz", cloud)
    with laspy.CopcReader.open(tmp_path / "hill.copc.laz") as reader:
        lower = np.array([4_000_020.0, 5_400_030.0, 0])
        upper = np.array([4_000_024.0, 5_400_039.0, 1000])
        found = reader.query(laspy.copc.Bounds(lower, upper))
    expected = ((cloud.points >= lower) & (cloud.points <= upper)).all(axis=1)
    assert 0 < len(found) == expected.sum()


def test_the_order_of_the_points_changes_no_byte(
    cloud: nacre.Cloud, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(octree, "_POINTS_PER_BLOCK", 20_000)
    order = np.random.default_rng(1).permutation(len(cloud))
    nacre.write_points(tmp_path / "a.copc.laz", cloud)
    nacre.write_points(tmp_path / "b.copc.laz", cloud[order])
    assert (tmp_path / "a.copc.laz").read_bytes() == (tmp_path / "b.copc.laz").read_bytes()


def test_points_in_one_place_and_none_at_all(tmp_path: Path) -> None:
    nacre.write_points(tmp_path / "one.copc.laz", np.ones((100_000, 3)))
    assert len(nacre.read_points(tmp_path / "one.copc.laz")) == 100_000
    nacre.write_points(tmp_path / "none.copc.laz", np.zeros((0, 3)))
    assert len(nacre.read_points(tmp_path / "none.copc.laz")) == 0


def test_what_is_made_of_a_large_cloud(cloud: nacre.Cloud, tmp_path: Path) -> None:
    nacre.write_points(tmp_path / "hill.las", cloud)
    done = nacre.out_of_core.voxel_downsample(
        tmp_path / "hill.las", tmp_path / "thin.copc.laz", 0.5, memory="1GB", points_per_cell=20_000
    )
    with laspy.CopcReader.open(tmp_path / "thin.copc.laz") as reader:
        assert done.num_cells > 1
        assert len(reader.query()) == done.num_points
