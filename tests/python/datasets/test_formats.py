"""Every format of recordings is recognised and read."""

import json
import os
from contextlib import nullcontext

import numpy as np
import pytest
from recording_folders import (
    SMALL,
    check_depth,
    colors,
    matrix_lines,
    pose,
    tum_line,
    write_icl_nuim,
    write_plain,
    write_redwood,
    write_seven_scenes,
    write_tum,
    write_views,
)

import nacre
from nacre import Camera, FileFormatError, open_sequence
from nacre.io.images import write_color_png

ANY_CAMERA = pytest.mark.filterwarnings("ignore:.*assumed a PrimeSense camera:UserWarning")


def test_tum(tmp_path):
    sequence = open_sequence(write_tum(tmp_path / "recording"))
    assert (sequence.format, sequence.name, len(sequence)) == ("tum", "recording", 4)
    assert sequence.camera == Camera(640, 480, 535.4, 539.2, 320.1, 247.6)
    assert sequence.depth_scale == 5000
    assert len(sequence.truth) == 6
    frames = list(sequence)
    for i, frame in enumerate(frames):
        check_depth(frame, (5000 + i) / 5000)
        assert frame.timestamp == pytest.approx(100 + 0.1 * i)
        assert frame.camera == sequence.camera
    assert [frame.color is not None for frame in frames] == [True, False, True, True]
    np.testing.assert_array_equal(frames[2].color, colors(2))
    np.testing.assert_allclose(frames[2].truth, pose(2), atol=1e-6)
    assert frames[3].truth is None


@pytest.mark.parametrize(
    ("name", "comment", "fx"),
    [
        ("x", "# file: 'rgbd_dataset_freiburg1_rpy.bag'\n", 517.3),
        ("x", "# file: 'rgbd_dataset_freiburg2_desk.bag'\n", 520.9),
        ("rgbd_dataset_freiburg2_xyz", "", 520.9),
        ("tum-fr1-rpy", "", 517.3),
        ("x", "", 525.0),
        ("afr1ca", "", 525.0),
    ],
)
def test_tum_camera_is_told_by_comments_or_name(tmp_path, name, comment, fx):
    is_guess = fx == 525.0
    with pytest.warns(UserWarning, match="assumed") if is_guess else nullcontext():
        sequence = open_sequence(write_tum(tmp_path / name, comment))
    assert sequence.camera.fx == fx


def test_tum_without_color_and_truth(tmp_path):
    folder = write_tum(tmp_path / "fr1", truth=False)
    (folder / "rgb.txt").unlink()
    sequence = open_sequence(folder)
    assert sequence.truth is None
    assert not sequence.has_color
    assert all(frame.color is None and frame.truth is None for frame in sequence)


def test_tum_camera_file_and_arguments_count_more(tmp_path):
    folder = write_tum(tmp_path / "fr1")
    nacre.write_camera(folder / "camera.json", Camera(640, 480, 500, 500, 320, 240), 1000)
    assert open_sequence(folder).camera.fx == 500
    sequence = open_sequence(folder, camera=Camera(640, 480, 400, 400, 320, 240), depth_scale=2500)
    assert (sequence.camera.fx, sequence.depth_scale) == (400, 2500)
    check_depth(sequence[0], 2.0)


def test_tum_difference_in_time_is_the_callers(tmp_path):
    sequence = open_sequence(write_tum(tmp_path / "fr1"), max_difference=0.06)
    assert all(frame.color is not None for frame in sequence)


@pytest.mark.parametrize(("line", "number"), [("abc depth/x.png", 3), ("1.5", 3), ("nan depth/x.png", 3)])
def test_tum_list_errors_name_the_line(tmp_path, line, number):
    folder = write_tum(tmp_path / "fr1")
    lines = (folder / "depth.txt").read_text().splitlines()
    (folder / "depth.txt").write_text("\n".join([*lines[:2], line, *lines[3:]]))
    with pytest.raises(FileFormatError, match=r"depth\.txt") as caught:
        open_sequence(folder)
    assert caught.value.line == number


def test_tum_empty_list(tmp_path):
    folder = write_tum(tmp_path / "fr1")
    (folder / "depth.txt").write_text("# nothing\n")
    with pytest.raises(FileFormatError, match=r"depth\.txt.*empty"):
        open_sequence(folder)


@pytest.mark.parametrize("color", ["image", "color", "rgb"])
def test_redwood(tmp_path, color):
    with pytest.warns(UserWarning, match="assumed a PrimeSense camera") as told:
        sequence = open_sequence(write_redwood(tmp_path / "r", color))
    assert len(told) == 1
    assert (sequence.format, len(sequence), sequence.depth_scale) == ("redwood", 3, 1000)
    assert sequence.camera == Camera(640, 480, 525, 525, 319.5, 239.5)
    assert sequence.truth is None
    assert not sequence.has_timestamps
    for i, frame in enumerate(sequence):
        check_depth(frame, 5.0 + i / 1000)
        np.testing.assert_array_equal(frame.color, colors(i))
        assert frame.timestamp is None


def test_redwood_intrinsics(tmp_path):
    folder = write_redwood(tmp_path / "r")
    (folder / "config.json").write_text('{"path_dataset": "here"}')
    matrix = [600, 0, 0, 0, 601, 0, 320, 240, 1]
    (folder / "camera_intrinsic.json").write_text(
        json.dumps({"width": 640, "height": 480, "intrinsic_matrix": matrix, "depth_scale": 4000})
    )
    sequence = open_sequence(folder)
    assert sequence.camera == Camera(640, 480, 600, 601, 320, 240)
    assert sequence.depth_scale == 4000


@ANY_CAMERA
@pytest.mark.parametrize(
    ("name", "is_truth"),
    [("trajectory.log", True), ("livingroom_groundtruth.log", True), ("livingroom1-traj.txt", True),
     ("estimated_trajectory.log", False)],
)  # fmt: skip
def test_redwood_trajectory_is_truth_only_by_name(tmp_path, name, is_truth):
    folder = write_redwood(tmp_path / "r")
    (folder / name).write_text("".join(f"{i} {i} {i + 1}\n{matrix_lines(pose(i))}" for i in range(2)))
    sequence = open_sequence(folder)
    found, other = (sequence.truth, sequence.estimate) if is_truth else (sequence.estimate, sequence.truth)
    assert len(found) == 2
    assert other is None
    assert [frame.truth is not None for frame in sequence] == [is_truth, is_truth, False]
    if is_truth:
        np.testing.assert_allclose(sequence[1].truth, pose(1), atol=1e-8)


@ANY_CAMERA
def test_redwood_images_may_differ_in_what_follows_the_number(tmp_path):
    folder = tmp_path / "r"
    write_views(folder, [f"{i + 1:07d}-{33369 * i:012d}" for i in range(12)])
    (folder / "image").mkdir()
    for i in (0, 1, 11):
        write_color_png(folder / "image" / f"{i + 1:07d}-{33370 * i + 7:012d}.png", colors(i))
    frames = list(open_sequence(folder))
    assert [i for i, frame in enumerate(frames) if frame.color is not None] == [0, 1, 11]
    np.testing.assert_array_equal(frames[11].color, colors(11))


@ANY_CAMERA
def test_names_are_ordered_by_their_numbers(tmp_path):
    write_views(tmp_path / "r", [str(i) for i in range(1, 13)], color="color")
    assert [open_sequence(tmp_path / "r").file(i).stem for i in (0, 1, 9, 11)] == ["1", "2", "10", "12"]


def test_seven_scenes(tmp_path):
    message = r"1 of 3 views have no true pose; the first: .*frame-000001.pose.txt"
    with pytest.warns(UserWarning, match=message) as told:
        sequence = open_sequence(write_seven_scenes(tmp_path / "seq-01"))
    assert (sequence.format, len(sequence), sequence.depth_scale) == ("7-scenes", 3, 1000)
    assert sequence.camera == Camera(640, 480, 585, 585, 320, 240)
    assert len(told) == 1
    np.testing.assert_array_equal(sequence.truth.timestamps, [0, 2])
    frames = list(sequence)
    assert frames[1].truth is None
    np.testing.assert_allclose(frames[2].truth, pose(2), atol=1e-8)
    check_depth(frames[2], 5.002)
    np.testing.assert_array_equal(frames[2].color, colors(2))


def test_icl_nuim(tmp_path):
    sequence = open_sequence(write_icl_nuim(tmp_path / "living_room_traj1_frei_png"))
    assert (sequence.format, len(sequence), sequence.depth_scale) == ("icl-nuim", 3, 5000)
    assert sequence.camera == Camera(640, 480, 481.2, -480, 319.5, 239.5)
    frames = list(sequence)
    assert [frame.timestamp for frame in frames] == [0, 1, 2]
    assert frames[0].truth is None
    np.testing.assert_allclose(frames[2].truth, pose(2), atol=1e-8)
    np.testing.assert_array_equal(frames[1].color, colors(1))


def test_icl_nuim_is_the_same_scene_for_either_sign_of_fy(tmp_path):
    folder = write_icl_nuim(tmp_path / "recording")
    (folder / "associations.txt").unlink()
    upright = open_sequence(folder, camera=Camera(640, 480, 481.2, 480, 319.5, 239.5))
    mirror = np.diag([1, -1, 1, 1])
    point = np.array([0.3, 0.2, 2.0, 1.0])
    for frame, published in zip(list(upright)[1:], list(open_sequence(folder))[1:], strict=True):
        np.testing.assert_allclose(mirror @ frame.truth @ point, published.truth @ mirror @ point, atol=1e-12)
    assert upright.format == "icl-nuim"


def test_icl_nuim_list_with_color_first(tmp_path):
    folder = write_icl_nuim(tmp_path / "recording")
    (folder / "associations.txt").write_text("7 rgb/1.png 1 depth/1.png\n")
    (frame,) = open_sequence(folder)
    assert frame.timestamp == 1
    check_depth(frame, 5001 / 5000)


def test_icl_nuim_with_two_truths(tmp_path):
    folder = write_icl_nuim(tmp_path / "recording")
    (folder / "livingRoom2.gt.freiburg").write_text(tum_line(1, pose(1)))
    with pytest.raises(FileFormatError, match=r"livingRoom1\.gt\.freiburg, livingRoom2\.gt\.freiburg"):
        open_sequence(folder)


@pytest.mark.parametrize("suffix", [".png", ".pgm", ".npy"])
def test_plain(tmp_path, suffix):
    folder = write_plain(tmp_path / "p", suffix)
    (folder / "groundtruth.txt").write_text(tum_line(0, pose(0)) + tum_line(2, pose(2)))
    (folder / "color").mkdir()
    write_color_png(folder / "color" / "view1.png", colors(1, (6, 8)))
    sequence = open_sequence(folder)
    assert (sequence.format, len(sequence), sequence.camera, sequence.depth_scale) == (
        "plain",
        3,
        SMALL,
        1000,
    )
    frames = list(sequence)
    for i, frame in enumerate(frames):
        check_depth(frame, 5.0 + i / 1000)
        assert frame.timestamp is None
    assert [frame.truth is not None for frame in frames] == [True, False, True]
    np.testing.assert_allclose(frames[2].truth, pose(2), atol=1e-8)
    assert [frame.color is not None for frame in frames] == [False, True, False]


def test_plain_exr(tmp_path):
    exr = pytest.importorskip("OpenEXR")
    folder = write_plain(tmp_path / "p")
    for path in folder.glob("depth/*"):
        path.unlink()
    depth = np.full((6, 8), 1.5, np.float32)
    depth[0, :4] = 0, np.nan, np.inf, -1
    with exr.File({"type": exr.scanlineimage}, {"Z": depth}) as image:
        image.write(str(folder / "depth" / "0.exr"))
    (frame,) = open_sequence(folder, depth_scale=1)
    assert np.isnan(frame.depth[0, :4]).all()
    assert (frame.depth[1:] == 1.5).all()


def test_plain_without_scale(tmp_path):
    folder = write_plain(tmp_path / "p")
    nacre.write_camera(folder / "camera.json", SMALL)
    with pytest.raises(FileFormatError, match="depth_scale not known"):
        open_sequence(folder)
    assert open_sequence(folder, depth_scale=500).depth_scale == 500


def test_plain_without_images(tmp_path):
    folder = write_plain(tmp_path / "p")
    for path in folder.glob("depth/*"):
        path.unlink()
    with pytest.raises(
        FileFormatError, match=r"needs depth images in depth/; the folder holds .*camera\.json"
    ):
        open_sequence(folder)


@pytest.mark.parametrize("text", ["1\n2\n", "1\n2\nx\n", "1\n2\ninf\n"])
def test_plain_time_stamps_must_fit(tmp_path, text):
    folder = write_plain(tmp_path / "p")
    (folder / "timestamps.txt").write_text(text)
    with pytest.raises(FileFormatError, match=r"timestamps\.txt"):
        open_sequence(folder)


def test_images_with_explicit_camera(tmp_path):
    write_views(tmp_path / "a", ["depth_2", "depth_10"], depth=".", shape=(6, 8))
    for i, name in enumerate(("rgb_2", "rgb_10")):
        write_color_png(tmp_path / "a" / f"{name}.png", colors(i, (6, 8)))
    sequence = open_sequence(tmp_path / "a", camera=SMALL, depth_scale=1000)
    assert (sequence.format, len(sequence)) == ("images", 2)
    assert sequence.file(0).name == "depth_2.png"
    np.testing.assert_array_equal(sequence[1].color, colors(1, (6, 8)))
    with pytest.raises(FileFormatError, match=r"camera and depth_scale not known.*camera\.json"):
        open_sequence(tmp_path / "a")
    with pytest.raises(FileFormatError, match="depth_scale not known"):
        open_sequence(tmp_path / "a", camera=SMALL)


def test_camera_may_be_a_file(tmp_path):
    write_views(tmp_path / "a", ["0"], shape=(6, 8))
    nacre.write_camera(tmp_path / "my.json", SMALL, 250)
    sequence = open_sequence(tmp_path / "a", camera=tmp_path / "my.json")
    assert (sequence.camera, sequence.depth_scale) == (SMALL, 250)
    assert (
        open_sequence(tmp_path / "a", camera=os.fspath(tmp_path / "my.json"), depth_scale=9).depth_scale == 9
    )


@pytest.mark.data
@pytest.mark.parametrize(
    ("name", "frames", "fx", "truths"), [("tum-fr3-teddy", 200, 535.4, 196), ("tum-fr1-rpy", 100, 517.3, 100)]
)
def test_real_tum(recordings, name, frames, fx, truths):
    sequence = open_sequence(recordings / name)
    assert (sequence.format, len(sequence), sequence.camera.fx) == ("tum", frames, fx)
    assert 0.5 < np.nanmedian(sequence[50].depth) < 3.5
    if truths == 196:
        assert sequence[3].truth is None
    assert sequence[4].truth is not None
    assert sequence[-1].truth is not None


@ANY_CAMERA
@pytest.mark.data
def test_real_redwood(recordings):
    sequence = open_sequence(recordings / "redwood-livingroom1")
    assert (sequence.format, len(sequence), sequence.has_color) == ("redwood", 40, True)
    assert sequence.truth is None
    assert len(sequence.estimate) == 211
    assert np.nanmedian(sequence[0].depth) == pytest.approx(1.845)
    known = open_sequence(recordings / "depth-singles" / "open3d")
    assert all(frame.truth is not None for frame in known)


@pytest.mark.data
def test_real_slambook(recordings):
    camera = Camera(640, 480, 518, 519, 325.5, 253.5)
    sequence = open_sequence(recordings / "slambook-ch5-rgbd" / "rgbd", camera=camera)
    assert [frame.color is not None for frame in sequence] == [True] * 5
    assert 1 < np.nanmedian(sequence[0].depth) < 5


@pytest.mark.data
def test_real_turntable(recordings):
    camera = Camera(640, 480, 616.87, 617.06, 319.57, 233.06)
    sequence = open_sequence(
        recordings / "realsense-turntable-dog" / "data1", camera=camera, depth_scale=1000
    )
    assert (sequence.format, len(sequence), sequence.has_color) == ("images", 6, True)
    assert np.nanmax(sequence[0].depth) == pytest.approx(0.761)
