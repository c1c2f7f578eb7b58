"""Recordings: every format is recognised and read, and what is missing is told."""

import json
import logging
import os
import pickle
import tracemalloc

import numpy as np
import pytest

import nacre
from nacre import Camera, FileFormatError, open_sequence, write_recording
from nacre.io.images import write_color_png, write_depth_png
from nacre.io.trajectories import matrix_from_quaternion, quaternion_from_matrix

WIDTH, HEIGHT = 640, 480
SMALL = Camera(width=8, height=6, fx=10, fy=11, cx=3.5, cy=2.5)


def stored(index, shape=(HEIGHT, WIDTH)):
    """Return a depth image that says which one it is, with pixels without a measurement."""
    image = np.full(shape, 5000 + index, dtype=np.uint16)
    image[0, :2] = 0, 65535
    return image


def colors(index, shape=(HEIGHT, WIDTH)):
    return np.full((*shape, 3), (index, 100, 200), dtype=np.uint8)


def pose(index):
    result = np.eye(4)
    result[:3, :3] = matrix_from_quaternion([0.1 * index, -0.2, 0.3, 1.0])
    result[:3, 3] = 0.1 * index, 0.2, -0.3
    return result


def tum_line(time, matrix):
    return (
        " ".join(f"{x:.9f}" for x in (time, *matrix[:3, 3], *quaternion_from_matrix(matrix[:3, :3]))) + "\n"
    )


def matrix_lines(matrix):
    return "".join(" ".join(f"{x:.9f}" for x in row) + "\n" for row in matrix)


def write_views(folder, names, depth="depth", color=None, shape=(HEIGHT, WIDTH)):
    (folder / depth).mkdir(parents=True, exist_ok=True)
    for index, name in enumerate(names):
        write_depth_png(folder / depth / f"{name}.png", stored(index, shape))
    if color is not None:
        (folder / color).mkdir(exist_ok=True)
        for index, name in enumerate(names):
            write_color_png(folder / color / f"{name}.png", colors(index, shape))


def write_tum(folder, comment="# file: 'rgbd_dataset_freiburg3_teddy.bag'\n", truth=True):
    times = [100.0 + 0.1 * i for i in range(4)]
    write_views(folder, [f"{t:.6f}" for t in times], color="rgb")
    header = "# timestamp filename\n"
    (folder / "depth.txt").write_text(header + "".join(f"{t:.6f} depth/{t:.6f}.png\n" for t in times))
    # The second colour image is too late for its depth image.
    late = [t + (0.05 if i == 1 else 0.01) for i, t in enumerate(times)]
    lines = [f"{stamp:.6f} rgb/{t:.6f}.png\n" for stamp, t in zip(late, times, strict=True)]
    (folder / "rgb.txt").write_text(header + "".join(lines))
    if truth:
        ends = [(t + shift, pose(i)) for i, t in enumerate(times[:3]) for shift in (-0.01, 0.01)]
        (folder / "groundtruth.txt").write_text(comment + "".join(tum_line(*end) for end in ends))
    return folder


def write_redwood(folder, color="image"):
    write_views(folder, [f"{i:05d}" for i in range(3)], color=color)
    return folder


def write_seven_scenes(folder):
    folder.mkdir(parents=True, exist_ok=True)
    for i in range(3):
        write_depth_png(folder / f"frame-{i:06d}.depth.png", stored(i))
        write_color_png(folder / f"frame-{i:06d}.color.png", colors(i))
        text = matrix_lines(pose(i)) if i != 1 else "-1.#IND " * 4 + "\n"
        (folder / f"frame-{i:06d}.pose.txt").write_text(text)
    return folder


def write_icl_nuim(folder):
    write_views(folder, ["0", "1", "2"], color="rgb")
    (folder / "associations.txt").write_text(
        "".join(f"{i} depth/{i}.png {i} rgb/{i}.png\n" for i in range(3))
    )
    (folder / "livingRoom1.gt.freiburg").write_text("".join(tum_line(i, pose(i)) for i in (1, 2)))
    return folder


def write_plain(folder, suffix=".png"):
    frames = [stored(i, (6, 8)) for i in range(3)]
    (folder / "depth").mkdir(parents=True)
    nacre.write_camera(folder / "camera.json", SMALL, 1000)
    for i, frame in enumerate(frames):
        path = folder / "depth" / f"view{i}{suffix}"
        if suffix == ".png":
            write_depth_png(path, frame)
        elif suffix == ".npy":
            np.save(path, frame.astype(np.float32))
        else:
            path.write_bytes(b"P5 8 6 65535\n" + frame.astype(">u2").tobytes())
    return folder


def check_depth(frame, expected):
    assert frame.depth.dtype == np.float32
    assert np.isnan(frame.depth[0, :2]).all()
    np.testing.assert_allclose(frame.depth[1:], expected, rtol=1e-6)


# --- formats ------------------------------------------------------------------------------------------------


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
def test_tum_camera_is_told_by_comments_or_name(tmp_path, caplog, name, comment, fx):
    with caplog.at_level(logging.WARNING, logger="nacre"):
        sequence = open_sequence(write_tum(tmp_path / name, comment))
    assert sequence.camera.fx == fx
    assert ("assumed" in caplog.text) == (fx == 525.0)


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
def test_redwood(tmp_path, caplog, color):
    with caplog.at_level(logging.WARNING, logger="nacre"):
        sequence = open_sequence(write_redwood(tmp_path / "r", color))
    assert "PrimeSense" in caplog.text
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


def test_redwood_images_may_differ_in_what_follows_the_number(tmp_path):
    folder = tmp_path / "r"
    write_views(folder, [f"{i + 1:07d}-{33369 * i:012d}" for i in range(12)])
    (folder / "image").mkdir()
    for i in (0, 1, 11):
        write_color_png(folder / "image" / f"{i + 1:07d}-{33370 * i + 7:012d}.png", colors(i))
    frames = list(open_sequence(folder))
    assert [i for i, frame in enumerate(frames) if frame.color is not None] == [0, 1, 11]
    np.testing.assert_array_equal(frames[11].color, colors(11))


def test_names_are_ordered_by_their_numbers(tmp_path):
    write_views(tmp_path / "r", [str(i) for i in range(1, 13)], color="color")
    assert [open_sequence(tmp_path / "r").file(i).stem for i in (0, 1, 9, 11)] == ["1", "2", "10", "12"]


def test_seven_scenes(tmp_path, caplog):
    with caplog.at_level(logging.WARNING, logger="nacre"):
        sequence = open_sequence(write_seven_scenes(tmp_path / "seq-01"))
    assert (sequence.format, len(sequence), sequence.depth_scale) == ("7-scenes", 3, 1000)
    assert sequence.camera == Camera(640, 480, 585, 585, 320, 240)
    assert "frame-000001.pose.txt" in caplog.text
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


# --- the common sequence ------------------------------------------------------------------------------------


def test_indices_and_slices(tmp_path):
    sequence = open_sequence(write_tum(tmp_path / "fr3"))
    assert sequence[-1].index == 3
    part = sequence[1::2]
    assert [frame.index for frame in part] == [1, 3]
    assert [frame.index for frame in part[::-1]] == [3, 1]
    assert (part.camera, part.truth, part.name) == (sequence.camera, sequence.truth, sequence.name)
    assert len(sequence[9:]) == 0
    with pytest.raises(IndexError):
        sequence[4]


def test_repr(tmp_path):
    sequence = open_sequence(write_tum(tmp_path / "fr3"))
    assert repr(sequence) == (
        "Sequence('fr3', format='tum', frames=4, camera=pinhole 640x480, depth_scale=5000, color, truth)"
    )
    assert repr(sequence[0]) == "SequenceFrame(index=0, depth=640x480, timestamp=100.0, color, truth)"


def test_a_sequence_can_be_sent_to_another_process(tmp_path):
    sequence = pickle.loads(pickle.dumps(open_sequence(write_plain(tmp_path / "p"))))
    check_depth(sequence[1], 5.001)


def test_iteration_goes_on_after_a_broken_view(tmp_path):
    folder = write_plain(tmp_path / "p")
    path = folder / "depth" / "view1.png"
    path.write_bytes(path.read_bytes()[:60])
    sequence = open_sequence(folder)
    frames = iter(sequence)
    assert next(frames).index == 0
    with pytest.raises(FileFormatError, match=r"view1\.png"):
        next(frames)
    assert next(frames).index == 2
    with pytest.raises(StopIteration):
        next(frames)
    assert sequence[2].index == 2


@pytest.mark.parametrize("what", ["depth", "rgb"])
def test_a_listed_file_that_is_missing_is_named_at_its_view(tmp_path, what):
    folder = write_tum(tmp_path / "fr3")
    (folder / what / "100.200000.png").unlink()
    sequence = open_sequence(folder)
    assert len(sequence) == 4
    with pytest.raises(FileFormatError, match=r"100\.200000\.png.*cannot be read"):
        sequence[2]
    assert sequence[3].color is not None


def test_a_broken_first_view_does_not_hide_the_others(tmp_path):
    folder = write_plain(tmp_path / "p")
    (folder / "depth" / "view0.png").write_bytes(b"")
    assert open_sequence(folder)[1].index == 1


def test_views_are_read_when_asked_for(tmp_path):
    camera = Camera(320, 240, 300, 300, 160, 120)
    write_recording(tmp_path / "p", camera, (np.full((240, 320), 1.0) for _ in range(30)), depth_scale=1000)
    sequence = open_sequence(tmp_path / "p")
    sequence[0]
    tracemalloc.start()
    for _ in sequence:
        pass
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 8 * 320 * 240 * 4


# --- errors -------------------------------------------------------------------------------------------------


def test_nothing_there(tmp_path):
    with pytest.raises(FileNotFoundError, match="no such recording"):
        open_sequence(tmp_path / "nowhere")


def test_empty_folder(tmp_path):
    with pytest.raises(FileFormatError, match="the folder is empty"):
        open_sequence(tmp_path)


def test_unknown_folder_tells_what_was_found_and_what_is_known(tmp_path):
    (tmp_path / "notes.md").write_text("hello")
    (tmp_path / "clips").mkdir()
    with pytest.raises(FileFormatError, match="no known recording") as caught:
        open_sequence(tmp_path)
    text = str(caught.value)
    assert "clips/ (0 entries), notes.md" in text
    assert all(
        name in text
        for name in ("tum: depth.txt", "redwood:", "7-scenes:", "icl-nuim:", "plain: camera.json")
    )


@pytest.mark.parametrize("extra", ["groundtruth.txt", "rgb.txt", None])
def test_almost_a_tum_recording(tmp_path, extra):
    folder = write_tum(tmp_path / "fr3")
    (folder / "depth.txt").unlink()
    for name in {"groundtruth.txt", "rgb.txt"} - {extra}:
        (folder / name).unlink()
    with pytest.raises(FileFormatError, match=r"depth\.txt is missing") as caught:
        open_sequence(folder)
    assert "depth/ (4 entries)" in str(caught.value)
    assert len(open_sequence(folder, camera=Camera(640, 480, 535, 539, 320, 247), depth_scale=5000)) == 4


def test_a_folder_too_high(tmp_path):
    write_seven_scenes(tmp_path / "seq-01")
    write_seven_scenes(tmp_path / "seq-02")
    with pytest.raises(FileFormatError, match="Give one of the folders in it: seq-01, seq-02"):
        open_sequence(tmp_path)


def test_a_file_that_is_no_recording(tmp_path):
    (tmp_path / "a.avi").write_bytes(b"video")
    with pytest.raises(FileFormatError, match="a recording is a folder"):
        open_sequence(tmp_path / "a.avi")


NAMES = (
    "tum redwood 7-scenes 7_Scenes icl-nuim stray-scanner rosbag record3d azure-kinect plain stanford images"
)


@pytest.mark.parametrize("name", NAMES.split())
def test_a_named_format_says_what_it_misses(tmp_path, name):
    (tmp_path / "notes.md").write_text("hello")
    with pytest.raises(FileFormatError) as caught:
        open_sequence(tmp_path, format=name, depth_scale=1000, camera=None if name == "stanford" else SMALL)
    assert "notes.md" in str(caught.value)


def test_a_named_format_is_taken(tmp_path):
    folder = write_redwood(tmp_path / "r")
    sequence = open_sequence(folder, format="images", camera=Camera(640, 480, 1, 1, 0, 0), depth_scale=1)
    assert sequence.format == "images"


def test_unknown_format_lists_the_known_ones(tmp_path):
    with pytest.raises(ValueError, match=r"format must be one of 'rosbag', 'record3d', .* got 'kitti'"):
        open_sequence(tmp_path, format="kitti")


@pytest.mark.parametrize("scale", [0, -1, np.nan, np.inf])
def test_scale_must_be_positive(tmp_path, scale):
    with pytest.raises(ValueError, match="depth_scale"):
        open_sequence(tmp_path, depth_scale=scale)


@pytest.mark.parametrize("difference", [-0.1, np.nan])
def test_difference_must_not_be_negative(tmp_path, difference):
    with pytest.raises(ValueError, match="max_difference"):
        open_sequence(tmp_path, max_difference=difference)


def test_camera_of_another_size_is_told_at_once(tmp_path):
    folder = write_redwood(tmp_path / "r")
    with pytest.raises(FileFormatError, match=r"00000\.png: the image is 640 wide and 480 high.*8 by 6"):
        open_sequence(folder, camera=SMALL)


def test_a_view_of_another_size_is_told(tmp_path):
    folder = write_plain(tmp_path / "p")
    write_depth_png(folder / "depth" / "view2.png", stored(2, (12, 16)))
    sequence = open_sequence(folder)
    with pytest.raises(FileFormatError, match=r"view2\.png: the image is 16 wide"):
        sequence[2]


def test_color_of_another_size_is_left_out(tmp_path, caplog):
    folder = write_plain(tmp_path / "p")
    (folder / "color").mkdir()
    for i in range(3):
        write_color_png(folder / "color" / f"view{i}.png", colors(i, (12, 16)))
    with caplog.at_level(logging.WARNING, logger="nacre"):
        sequence = open_sequence(folder)
    assert "colour is left out" in caplog.text
    assert sequence[0].color is None


# --- real recordings ----------------------------------------------------------------------------------------


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
