"""The next frame is read while the one before it is worked on; nobody sees a difference but the clock."""

import threading

import pytest
from recording_folders import write_plain, write_tum

from nacre import FileFormatError, open_sequence
from nacre.datasets.read_ahead import read_ahead


def recorded(folder, monkeypatch):
    """Return a recording, and the list of (index, name of the thread) of what was read."""
    sequence = open_sequence(write_tum(folder))
    of_class, read = type(sequence).__getitem__, []

    def noted(self, index):
        read.append((index, threading.current_thread().name))
        return of_class(self, index)

    monkeypatch.setattr(type(sequence), "__getitem__", noted)
    return sequence, read


def test_frames_come_in_the_order_asked_for_and_the_next_is_asked_for_before(tmp_path, monkeypatch):
    sequence, read = recorded(tmp_path / "fr3", monkeypatch)
    frames = read_ahead(sequence, [2, 0, 3])
    index, first = next(frames)
    assert (index, first().index) == (2, 2)
    index, second = next(frames)
    assert (index, second().index) == (0, 0)
    assert [frame().index for _, frame in frames] == [3]
    assert [index for index, _ in read] == [2, 0, 3]
    assert all(name.startswith("nacre-read-ahead") for _, name in read)


def test_what_cannot_be_read_is_said_where_it_is_asked_for(tmp_path):
    folder = write_plain(tmp_path / "p")
    (folder / "depth" / "view1.png").write_bytes(b"no image")
    frames = list(read_ahead(open_sequence(folder), range(3)))
    assert frames[0][1]().index == 0
    with pytest.raises(FileFormatError, match=r"view1\.png"):
        frames[1][1]()
    assert frames[2][1]().index == 2


def test_frames_that_come_when_they_come_are_read_when_they_are_asked_for(tmp_path, monkeypatch):
    sequence, read = recorded(tmp_path / "fr3", monkeypatch)
    frames = read_ahead(sequence, iter([0, 1]))
    _, first = next(frames)
    assert read == []
    first()
    assert read == [(0, threading.main_thread().name)]


def test_sequences_of_others_are_read_in_the_thread_that_asks():
    threads = []

    class Own(list):
        def __getitem__(self, index):
            threads.append(threading.current_thread())
            return super().__getitem__(index)

    assert [frame() for _, frame in read_ahead(Own("ab"), [0, 1])] == ["a", "b"]
    assert threads == [threading.main_thread()] * 2


def test_to_stop_early_leaves_no_thread_behind(tmp_path):
    frames = read_ahead(open_sequence(write_tum(tmp_path / "fr3")), range(4))
    next(frames)
    frames.close()
    assert not [t for t in threading.enumerate() if t.name.startswith("nacre-read-ahead")]
