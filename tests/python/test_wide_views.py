"""Views far apart and in any order: the camera is searched for everywhere, lost frames get another try."""

import functools
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import nacre
from nacre.datasets.sequence import SequenceFrame
from nacre.reconstruction import Reconstruction

Array = npt.NDArray[Any]


@functools.cache
def thing() -> nacre.Mesh:
    return nacre.built_in_object()


def camera() -> nacre.Camera:
    return nacre.default_camera(thing())


def pose_at(degrees: float, roll: float = 0.0) -> Array:
    """Return a camera of the turntable, rolled about its axis."""
    pose = nacre.turntable_poses(thing(), 1, 0.0)[0]
    turn = np.eye(4)
    poses = nacre.turntable_poses(thing(), 2, np.radians(degrees))
    turn[:2, :2] = [[np.cos(roll), -np.sin(roll)], [np.sin(roll), np.cos(roll)]]
    assert np.allclose(poses[0], pose)
    rolled: Array = poses[1] @ turn
    return rolled


@functools.cache
def view(degrees: float, roll: float = 0.0) -> Array:
    return thing().simulate_depth(camera(), pose_at(degrees, roll), noise=0.0005, seed=int(degrees) % 360)


def truth(degrees: float, roll: float = 0.0) -> Array:
    return np.linalg.inv(pose_at(0)) @ pose_at(degrees, roll)


def errors(pose: Array, expected: Array) -> tuple[float, float]:
    """Return the angle [degrees] and the distance at the object's middle [m] between two camera poses."""
    cosine = (np.trace(pose[:3, :3].T @ expected[:3, :3]) - 1) / 2
    middle = np.append(thing().bounds.mean(axis=0), 1.0)
    in_first = np.linalg.inv(pose_at(0)) @ middle
    shift = np.linalg.norm((np.linalg.inv(pose) - np.linalg.inv(expected)) @ in_first)
    return float(np.degrees(np.arccos(np.clip(cosine, -1, 1)))), float(shift)


def recording(images: list[Array], truths: list[Array] | None = None) -> list[SequenceFrame]:
    return [
        SequenceFrame(i, image, camera(), timestamp=None, color=None, truth=truths[i] if truths else None)
        for i, image in enumerate(images)
    ]


@pytest.mark.parametrize(("degrees", "roll"), [(60, 3.0), (-75, 1.6), (70, -2.2)])
def test_a_camera_that_jumped_is_found(degrees: float, roll: float) -> None:
    """It is upside down, or on its side, and farther away than any guess reaches."""
    model = nacre.Model(camera())
    for known in (0, 20, -20):
        assert model.add_frame(view(known)).status == "TRACKED"
    report = model.add_frame(view(degrees, roll))
    assert report.tracked, report
    angle, shift = errors(report.world_from_camera, truth(degrees, roll))
    assert angle < 1
    assert shift < 0.001


def test_nobody_searches_where_relocalise_is_off() -> None:
    model = nacre.Model(camera(), relocalise=False)
    model.add_frame(view(0))
    assert model.add_frame(view(60, 3.0)).status == "LOST"


def test_another_object_is_not_found_anywhere() -> None:
    model = nacre.Model(camera())
    for known in (0, 20, -20):
        model.add_frame(view(known))
    before = model.points.tobytes()
    v, u = np.indices(view(0).shape)
    x, y = (u - camera().cx) * camera().pixel_size, (v - camera().cy) * camera().pixel_size
    distance = float(np.nanmedian(view(0)))
    ball = distance - np.sqrt(np.maximum(0.04**2 - x**2 - y**2, 0))
    ball[x**2 + y**2 > 0.039**2] = np.nan
    assert model.add_frame(ball).status == "LOST"
    assert model.points.tobytes() == before


ORDER = [0, 180, 120, 240, 60, 300]  # the second shares nothing with the first


def test_views_in_any_order_are_joined() -> None:
    done = Reconstruction(
        recording([view(degrees) for degrees in ORDER], [pose_at(degrees) for degrees in ORDER]),
        nacre.Model(camera()),
    )
    list(done.run())
    first_statuses = [frame.status for frame in done.frames]
    assert "LOST" in first_statuses
    lost = [frame.index for frame in done.frames if frame.status == "LOST"]
    tried = [frame.index for frame in done.retry_lost()]
    assert tried[: len(lost)] == lost
    assert len(done.frames) == len(ORDER)
    assert [frame.index for frame in done.frames] == list(range(len(ORDER)))
    # The first explains none of the next: the second, third and fourth begin the model.
    assert np.array_equal(done.frames[1].world_from_camera, np.eye(4))
    for frame, degrees in zip(done.frames, ORDER, strict=True):
        if frame.world_from_camera is None:
            continue
        angle, shift = errors(frame.world_from_camera, np.linalg.inv(truth(ORDER[1])) @ truth(degrees))
        assert angle < 1, f"{degrees} degrees"
        assert shift < 0.0015, f"{degrees} degrees"
    found = [i for i in lost if done.frames[i].world_from_camera is not None]
    assert found
    assert {done.frames[i].status for i in found} <= {"RELOCALISED", "WEAK"}
    assert done.num_tracked == len(done.trajectory.poses) == len(ORDER)


def test_retry_gives_up_where_nothing_is_found() -> None:
    nothing = np.full_like(view(0), np.nan)
    done = Reconstruction(recording([view(0), nothing, view(10)]), nacre.Model(camera()))
    list(done.run())
    before = done.model.points.tobytes()
    assert [frame.index for frame in done.retry_lost()] == [1]
    assert done.frames[1].status == "LOST"
    assert done.model.points.tobytes() == before


def test_retry_does_nothing_where_no_frame_was_lost() -> None:
    done = Reconstruction(recording([view(0), view(10)]), nacre.Model(camera()))
    list(done.run())
    assert list(done.retry_lost()) == []


def test_retry_leaves_frames_that_were_refused() -> None:
    done = Reconstruction(recording([view(0), np.ones((5, 5), np.float32)]), nacre.Model(camera()))
    list(done.run())
    assert done.frames[1].refused
    assert list(done.retry_lost()) == []


@pytest.mark.data
@pytest.mark.parametrize("seed", [None, 0, pytest.param(1, marks=pytest.mark.weekly)])
def test_bunny_scans_in_any_order(recordings: Any, seed: int | None) -> None:
    """Measured: all ten scans in each of several orders, within 0.4 degrees and 0.7 mm of bun.conf."""
    sequence = nacre.open_sequence(recordings / "stanford-bunny" / "data")
    order = np.arange(10) if seed is None else np.random.default_rng(seed).permutation(10)
    done = Reconstruction(sequence, nacre.Model(sequence.camera))
    list(done.run([int(i) for i in order]))
    list(done.retry_lost())
    first = done.frames[0].truth
    assert first is not None
    assert done.num_tracked >= 9
    for frame in done.frames:
        if frame.world_from_camera is None:
            continue
        assert frame.truth is not None
        difference = np.linalg.inv(first @ frame.world_from_camera) @ frame.truth
        angle = np.degrees(np.arccos(np.clip((np.trace(difference[:3, :3]) - 1) / 2, -1, 1)))
        points = nacre.back_project(sequence[frame.index].depth, sequence.camera)
        middle = points.mean(axis=0)
        assert angle < 1
        assert np.linalg.norm(difference[:3, :3] @ middle + difference[:3, 3] - middle) < 0.001
