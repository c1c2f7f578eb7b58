"""Data that allows no answer, or hardly one."""

from typing import Any

import numpy as np
import pytest
from known_motions import CENTER, METHODS, TRUTH, errors, motion, plane, source_of

import nacre

NOTHING = np.zeros((0, 3))
HOPELESS = {
    "both empty": (NOTHING, NOTHING),
    "empty source": (NOTHING, plane(1)[0]),
    "empty target": (plane(1)[0], NOTHING),
    "single points": (np.zeros((1, 3)), np.zeros((1, 3))),
    "two points": (np.eye(3)[:2], np.eye(3)[:2]),
    "all NaN": (np.full((500, 3), np.nan), plane(1)[0]),
    "target all NaN": (plane(1)[0], np.full((500, 3), np.nan)),
    "inf": (np.full((500, 3), np.inf), plane(1)[0]),
    "far apart": (plane(1)[0], plane(2)[0] + [100.0, 0, 0]),
}


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("case", HOPELESS)
def test_nothing_matched_is_never_converged(case: str, method: Any) -> None:
    source, target = HOPELESS[case]
    first = motion([0.1, 0.2, 0.3], [0.1, 0.2, 0.3])
    first = np.eye(4) if case == "far apart" else first
    result = nacre.align(source, target, initial=first, method=method)
    assert not result.converged
    assert result.status == "too_few_pairs"
    assert result.num_inliers == 0
    assert result.overlap == 0
    assert np.isnan(result.rmse)
    assert np.allclose(result.target_from_source, first, atol=1e-9)
    assert (result.information == 0).all()
    assert "too_few_pairs" in repr(result)


@pytest.mark.parametrize("method", METHODS)
def test_rows_that_are_not_finite_are_ignored(cloud: Any, resampled: Any, method: Any) -> None:
    source, normals = source_of(resampled)
    options = {"method": method, "sample_fraction": 1.0, "coarse_samples": 0, "max_iterations": 100}
    expected = nacre.align(source, cloud[0], source_normals=normals, target_normals=cloud[1], **options)
    holes = np.array([[np.nan, 0, 0], [0, np.inf, 0], [0, 0, -np.inf]])
    result = nacre.align(
        np.concatenate([holes, source]),
        np.concatenate([holes, cloud[0]]),
        source_normals=np.concatenate([np.eye(3), normals]),
        target_normals=np.concatenate([np.eye(3), cloud[1]]),
        **options,
    )
    assert np.isfinite(result.target_from_source).all()
    assert result.num_inliers == pytest.approx(expected.num_inliers, rel=0.02)
    assert np.allclose(result.target_from_source, expected.target_from_source, atol=2e-4)


def test_normals_that_are_not_finite_are_ignored(cloud: Any, resampled: Any) -> None:
    source, normals = source_of(resampled)
    normals[::5] = np.nan
    target_normals = cloud[1].copy()
    target_normals[::7] = np.nan
    result = nacre.align(source, cloud[0], source_normals=normals, target_normals=target_normals)
    assert result.converged
    assert errors(result.target_from_source, TRUTH)[0] < 0.1


@pytest.mark.parametrize("method", METHODS)
def test_identical_clouds_stay(cloud: Any, method: Any) -> None:
    result = nacre.align(cloud[0], cloud[0], source_normals=cloud[1], target_normals=cloud[1], method=method)
    assert result.converged
    assert np.allclose(result.target_from_source, np.eye(4), atol=1e-7)
    assert result.rmse < 1e-9
    assert np.isfinite(result.information).all()


@pytest.mark.parametrize("method", METHODS)
def test_points_on_a_line(method: Any) -> None:
    """No normals exist there; point_to_point finds the line and says that the turn about it is free."""
    line = np.outer(np.linspace(-0.1, 0.1, 400), [1, 2, 2]) / 3 + CENTER
    result = nacre.align(line + np.array([0, 0.0004, -0.0004]), line, method=method, max_iterations=200)
    assert np.isfinite(result.target_from_source).all()
    if method == "point_to_point":
        assert len(result.weak_directions) >= 1
        assert np.linalg.norm(result.target_from_source[:3, :3] - np.eye(3)) < 0.01
    else:
        assert not result.converged
        assert result.num_inliers == 0


def test_points_all_in_one_place() -> None:
    heap = np.zeros((200, 3))
    result = nacre.align(heap, heap, method="point_to_point")
    assert np.isfinite(result.target_from_source).all()
    assert np.allclose(result.target_from_source, np.eye(4))
