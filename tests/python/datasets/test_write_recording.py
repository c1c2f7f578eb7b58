"""Plain recordings: what is written is read again, and what does not fit is told."""

import itertools

import numpy as np
import pytest

from nacre import Camera, open_sequence, write_recording
from nacre._internal.quaternions import matrix_from_quaternion

SMALL = Camera(width=8, height=6, fx=10, fy=11, cx=3.5, cy=2.5)


def pose(index):
    result = np.eye(4)
    result[:3, :3] = matrix_from_quaternion([0.1 * index, -0.2, 0.3, 1.0])
    result[:3, 3] = 0.1 * index, 0.2, -0.3
    return result


@pytest.mark.parametrize("camera", [SMALL, Camera.orthographic(8, 6, 0.01)])
def test_what_is_written_is_read_again(tmp_path, camera):
    rng = np.random.default_rng(4)
    depth = rng.uniform(0.3, 1.2, (3, 6, 8))
    depth[:, 0, :4] = np.nan, 0, np.inf, -1
    color = rng.integers(0, 256, (3, 6, 8, 3), dtype=np.uint8)
    poses = [pose(i) for i in range(3)]
    count = write_recording(tmp_path / "p", camera, depth, depth_scale=50000, colors=color, poses=poses)
    assert count == 3
    sequence = open_sequence(tmp_path / "p")
    assert sequence.format == "plain"
    assert sequence.camera == camera
    assert not sequence.has_timestamps
    for i, frame in enumerate(sequence):
        assert np.isnan(frame.depth[0, :4]).all()
        assert np.abs(frame.depth[1:] - depth[i, 1:]).max() <= 0.5 / 50000 + 1e-7
        np.testing.assert_array_equal(frame.color, color[i])
        np.testing.assert_allclose(frame.truth, poses[i], atol=1e-15)


def test_time_stamps_are_written(tmp_path):
    times = [1305031102.175304, 1305031102.211214]
    depth = [np.ones((6, 8))] * 2
    write_recording(
        tmp_path / "p", SMALL, depth, depth_scale=1000, timestamps=times, poses=[pose(0), pose(1)]
    )
    sequence = open_sequence(tmp_path / "p")
    assert [frame.timestamp for frame in sequence] == times
    np.testing.assert_allclose(sequence[1].truth, pose(1), atol=1e-15)
    np.testing.assert_array_equal(sequence.truth.timestamps, times)


def test_writing_streams(tmp_path):
    written = []

    def images():
        for i in itertools.count():
            written.append(len(list((tmp_path / "p" / "depth").glob("*.png"))))
            if i == 5:
                return
            yield np.ones((6, 8))

    assert write_recording(tmp_path / "p", SMALL, images(), depth_scale=1000) == 5
    assert written == [0, 1, 2, 3, 4, 5]


def test_a_recording_is_not_overwritten(tmp_path):
    write_recording(tmp_path / "p", SMALL, [np.ones((6, 8))], depth_scale=1000)
    with pytest.raises(FileExistsError, match="holds a recording already"):
        write_recording(tmp_path / "p", SMALL, [np.ones((6, 8))], depth_scale=1000)


def test_a_depth_too_far_names_the_scale(tmp_path):
    with pytest.raises(
        ValueError,
        match=r"depth_images\[0\] must fit 16 bits at depth_scale=1000 \(at most 65\.534 m\), got 66 m",
    ):
        write_recording(tmp_path / "p", SMALL, [np.full((6, 8), 66.0)], depth_scale=1000)
    assert write_recording(tmp_path / "p", SMALL, [np.full((6, 8), 66.0)], depth_scale=500) == 1


def test_a_depth_that_would_vanish_names_the_scale(tmp_path):
    with pytest.raises(ValueError, match=r"round to 0 \(no measurement\) at depth_scale=1"):
        write_recording(tmp_path / "p", SMALL, [np.full((6, 8), 0.4)], depth_scale=1)


@pytest.mark.parametrize("views", [{}, {"colors": []}, {"poses": np.empty((0, 4, 4)), "timestamps": []}])
def test_a_recording_without_frames_is_refused(tmp_path, views):
    with pytest.raises(ValueError, match="depth_images must have at least one image, got none"):
        write_recording(tmp_path / "p", SMALL, iter([]), depth_scale=1000, **views)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("scale", [0, -5, np.nan, np.inf])
def test_written_scale_must_be_positive(tmp_path, scale):
    with pytest.raises(ValueError, match="depth_scale"):
        write_recording(tmp_path / "p", SMALL, [], depth_scale=scale)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (
            {"colors": [np.zeros((6, 8, 3), np.uint8)]},
            "colors must have one item for each view, but it ends after 1",
        ),
        ({"poses": [np.eye(4)] * 3}, "depth_images must have one item for each view, but it ends after 2"),
        ({"timestamps": []}, "timestamps must have one item"),
        ({"colors": [np.zeros((8, 6, 3), np.uint8)] * 2}, r"colors\[0\] must have shape \(6, 8, 3\)"),
        ({"colors": [np.full((6, 8, 3), 2.0)] * 2}, r"colors\[0\] must be .*floats from 0 to 1"),
        ({"poses": [np.diag([2.0, 2, 2, 1])] * 2}, r"poses\[0\] must be a rigid transform"),
    ],
)
def test_what_belongs_to_a_view_must_fit(tmp_path, options, message):
    with pytest.raises(ValueError, match=message):
        write_recording(tmp_path / "p", SMALL, [np.ones((6, 8))] * 2, depth_scale=1000, **options)


def test_a_written_image_must_have_the_cameras_size(tmp_path):
    with pytest.raises(
        ValueError, match=r"depth_images\[0\] must have the camera's shape \(6, 8\), got \(8, 6\)"
    ):
        write_recording(tmp_path / "p", SMALL, [np.ones((8, 6))], depth_scale=1000)
