"""What recordings of all formats have in common: views by index, read when they are asked for."""

import pickle
import tracemalloc

import numpy as np
import pytest
from recording_folders import check_depth, write_plain, write_tum

from nacre import Camera, FileFormatError, open_sequence, write_recording


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
