"""Which frames are tracked, weak, lost and found again, and what they leave as it was."""

import functools

import numpy as np
import pytest
from model_scenes import (
    FLAT,
    HOPELESS,
    PINHOLE,
    flat_grid,
    object_model,
    off_thing,
    relief,
    rms,
    shifted,
    state,
    thing,
    true_pose,
    view,
)

import nacre


@functools.cache
def grown() -> nacre.Model:
    return object_model(3)


@pytest.mark.parametrize("case", HOPELESS)
def test_a_lost_frame_changes_nothing(case: str) -> None:
    model = grown()
    before, count = state(model), len(model.frames)
    last = next(r.world_from_camera for r in reversed(model.frames) if r.tracked)
    report = model.add_frame(HOPELESS[case]())
    assert report.status == "LOST"
    assert report.reason
    assert not report.tracked
    assert state(model) == before
    assert (report.world_from_camera == last).all()
    assert report.num_points == len(model)
    assert report.num_updated == report.num_inserted == report.num_removed == 0
    assert len(model.frames) == count + 1
    assert np.isnan(model.poses[-1]).all()
    assert report.reason in repr(report)


def test_a_model_goes_on_after_lost_frames_as_if_they_had_not_been() -> None:
    with_gap, without = object_model(2), object_model(2)
    with_gap.add_frame(HOPELESS["NaN"]())
    pose = true_pose(2)
    reports = [model.add_frame(view(2), guess=pose) for model in (with_gap, without)]
    assert [report.status for report in reports] == ["RELOCALISED", "TRACKED"]
    assert (reports[0].world_from_camera == reports[1].world_from_camera).all()
    assert (with_gap.points == without.points).all()


def test_first_frame_may_be_lost() -> None:
    model = nacre.Model(nacre.default_camera(thing()))
    assert model.add_frame(HOPELESS["zeros"]()).status == "LOST"
    assert len(model) == 0
    assert model.spacing == 0
    assert model.in_camera()[0].shape == (0, 3)
    report = model.add_frame(view(0))
    assert report.status == "TRACKED"
    assert (report.world_from_camera == np.eye(4)).all()
    assert len(model) > 1000
    assert model.add_frame(view(1)).status == "TRACKED"


def test_relocalised_after_lost() -> None:
    model = object_model(2)
    statuses = [model.add_frame(d).status for d in (HOPELESS["NaN"](), HOPELESS["zeros"](), view(2), view(3))]
    assert statuses == ["LOST", "LOST", "RELOCALISED", "TRACKED"]
    assert rms(off_thing(model.points)) < 0.0003


@pytest.mark.parametrize(("least", "status"), [(0.3, "TRACKED"), (4.0, "LOST")])
def test_min_score_decides(least: float, status: str) -> None:
    model = object_model(1, min_score=least, relocalise=False)
    report = model.add_frame(view(1))
    assert 0.6 < report.score < 4.0
    assert report.status == status
    if status == "LOST":
        assert report.reason.startswith(f"registration score {report.score:.3g} is below 4.8: overlap ")
        assert f"overlap {report.overlap:.3g}, consistency {report.consistency:.3g}" in report.reason


def test_seeing_through_the_model_speaks_against_a_pose() -> None:
    """Something in front of half of a wall has gone: the rest matches as well as ever."""
    x, y = flat_grid()
    wall = relief() + 0.1
    front = 0.3 + 0.004 * np.cos(170 * x + 2) * np.sin(130 * y + 60 * x)
    model = nacre.Model(FLAT, relocalise=False)
    model.add_frame(np.where(x < 0, front, wall))
    report = model.add_frame(wall)
    assert 0.1 < report.consistency < 0.9
    assert report.status == "LOST"
    assert report.reason.startswith("registration score ")


@pytest.mark.parametrize(("is_same", "status"), [(True, "TRACKED"), (False, "LOST")])
def test_most_of_an_image_may_be_new_where_the_rest_contradicts_nothing(is_same: bool, status: str) -> None:
    """A camera goes slowly, until it is known what contradicts; then by four fifths of the image at once."""
    rng = np.random.default_rng(3)
    model = nacre.Model(FLAT, num_threads=1, relocalise=False)
    for pose in map(shifted, [0.0, 0.004, 0.008, 0.012, 0.016, 0.020, 0.024, 0.104]):
        is_far = pose[0, 3] > 0.1
        surface = relief(pose) if is_same or not is_far else 0.6 - relief(pose)
        noisy = surface + 0.0005 * rng.standard_normal(surface.shape)
        report = model.add_frame(noisy, guess=pose if is_far else None)
    assert report.status == status
    if is_same:
        assert 0.2 < report.overlap < 0.3
        assert np.linalg.norm(report.world_from_camera - pose) < 0.02


def test_something_that_comes_before_the_camera_does_not_lose_it() -> None:
    x, y = flat_grid()
    wall = relief() + 0.1
    front = 0.3 + 0.004 * np.cos(170 * x + 2) * np.sin(130 * y + 60 * x)
    model = nacre.Model(FLAT, relocalise=False)
    model.add_frame(wall)
    report = model.add_frame(np.where(x < 0, front, wall))
    assert report.status == "TRACKED"
    np.testing.assert_allclose(report.world_from_camera, np.eye(4), atol=1e-4)


@pytest.mark.parametrize("index", [0, 1, 3])
def test_a_lost_camera_is_found_at_earlier_poses(index: int) -> None:
    """It was last seen up to 150 degrees away."""
    model = object_model(6)
    model.add_frame(HOPELESS["NaN"]())
    report = model.add_frame(view(index))
    assert report.status == "RELOCALISED"
    assert np.allclose(report.world_from_camera, true_pose(index), atol=0.004)


def test_a_bare_plane_leaves_the_pose_open() -> None:
    """Only the distance to a plane is known. What is not known keeps the guess."""
    rng = np.random.default_rng(6)
    model = nacre.Model(PINHOLE)
    model.add_frame(0.5 + rng.normal(0, 0.0002, (120, 160)))
    before = state(model)
    turn = np.array([[np.cos(0.02), -np.sin(0.02), 0], [np.sin(0.02), np.cos(0.02), 0], [0, 0, 1]])
    for guess in (np.eye(4), shifted(0.01, -0.006, 0.002)):
        guess[:3, :3] = turn
        report = model.add_frame(0.504 + rng.normal(0, 0.0002, (120, 160)), guess=guess)
        assert report.status == "WEAK"
        assert report.tracked
        assert "3 direction" in report.reason
        assert report.weak_directions.shape == (3, 6)
        assert np.allclose(report.world_from_camera[:2, 3], guess[:2, 3], atol=5e-4)
        assert np.allclose(report.world_from_camera[:3, :3], turn, atol=1e-3)
        assert report.world_from_camera[2, 3] == pytest.approx(-0.004, abs=1e-4)
        assert state(model)[:5] == before[:5]
        assert report.num_updated == report.num_inserted == report.num_removed == 0
    assert np.isfinite(model.poses).all()
