"""Disks that close a surface, and how far two models are apart."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from nacre.viewer import Snapshot
from nacre.viewer.disks import deviation, disk_radii

sys.path.insert(0, str(Path(__file__).parents[1]))
from viewer_scenes import SPACING, plane


def moved(cloud: Snapshot, by: tuple[float, float, float]) -> Snapshot:
    return Snapshot((cloud.points + np.array(by)).astype(np.float32), cloud.normals, cloud.spacing)


def test_disks_reach_the_neighbors_and_no_farther_at_the_rim() -> None:
    np.testing.assert_allclose(disk_radii(plane()), SPACING, rtol=1e-4)


def test_sparse_surfaces_close_and_specks_stay_small() -> None:
    near, far = plane(), plane()
    points = np.concatenate([near.points, 30 * far.points, [[0, 0, 15]]]).astype(np.float32)
    normals = np.concatenate([near.normals, far.normals, [[0, 0, -1]]]).astype(np.float32)
    radii = disk_radii(Snapshot(points, normals, SPACING))
    np.testing.assert_allclose(radii[441:-1].reshape(21, 21)[1:-1, 1:-1], 30 * SPACING, rtol=1e-4)
    assert radii[-1] == np.float32(SPACING)


def test_a_flake_beside_a_dense_surface_is_small() -> None:
    cloud = plane()
    points = np.concatenate([cloud.points, [[0.4, 0, 1]]]).astype(np.float32)
    normals = np.concatenate([cloud.normals, [[0, 0, -1]]]).astype(np.float32)
    assert disk_radii(Snapshot(points, normals, SPACING))[-1] < 5 * SPACING


def test_a_sparse_flake_of_several_points_is_small_too() -> None:
    cloud = plane()
    side = cloud.points[:, 0].max()
    flake = np.array([[side + 5 * SPACING * i, 5 * SPACING * j, 1] for i in (1, 2) for j in range(3)])
    points = np.concatenate([cloud.points, flake]).astype(np.float32)
    normals = np.broadcast_to(np.float32([0, 0, -1]), points.shape)
    radii = disk_radii(Snapshot(points, normals, SPACING))[-len(flake) :]
    assert radii[:3].max() <= 2.001 * SPACING  # those beside the plane


def test_few_points_have_disks_too() -> None:
    cloud = plane()
    for count in range(3):
        assert len(disk_radii(cloud.rows(slice(0, count), SPACING))) == count


def test_a_model_that_moved_by_2_mm_deviates_by_2_mm() -> None:
    np.testing.assert_allclose(deviation(moved(plane(), (0, 0, 0.002)), plane()), 0.002, rtol=1e-3)


def test_other_samples_of_the_same_surface_do_not_deviate() -> None:
    assert deviation(moved(plane(), (0.004, 0.003, 0)), plane()).max() < 1e-6


def test_what_the_other_lacks_is_as_far_as_its_rim() -> None:
    cloud = plane()
    part = cloud.rows(np.flatnonzero(cloud.points[:, 0] < 0.001), SPACING)
    furthest = deviation(cloud, part).max()
    assert abs(furthest - (0.1 - disk_radii(part).max())) < SPACING
