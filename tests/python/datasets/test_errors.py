"""What is missing or wrong in a recording is told."""

import numpy as np
import pytest
from recording_folders import SMALL, colors, stored, write_plain, write_redwood, write_seven_scenes, write_tum

from nacre import Camera, FileFormatError, open_sequence
from nacre.io.images import write_color_png, write_depth_png


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


def test_color_of_another_size_is_left_out(tmp_path):
    folder = write_plain(tmp_path / "p")
    (folder / "color").mkdir()
    for i in range(3):
        write_color_png(folder / "color" / f"view{i}.png", colors(i, (12, 16)))
    with pytest.warns(UserWarning, match="colour is left out") as told:
        sequence = open_sequence(folder)
    assert len(told) == 1
    assert told[0].filename == __file__
    assert sequence[0].color is None
