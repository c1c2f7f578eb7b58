"""Recordings that stay open, read by threads, forked processes and copies at once: each gets its frames."""

import copy
import os
import pickle
import sys
import threading
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

import nacre

pytest.importorskip("PIL")
pytest.importorskip("rosbags")
pytest.importorskip("liblzfse")
from record3d_files import contents, packed
from recording_folders import write_icl_nuim, write_plain, write_redwood, write_seven_scenes, write_tum
from ros_recorder import Recorder
from rosbags.rosbag2 import StoragePlugin

FRAMES, ROUNDS = 20, 15


def ros(path: Path, version: int, storage: StoragePlugin = StoragePlugin.SQLITE3) -> Path:
    recorder = Recorder(path, version, storage)
    recorder.info("/camera/depth/camera_info")
    for i in range(FRAMES):
        image = np.random.default_rng(i).integers(500, 9000, (48, 64)).astype(np.uint16)
        recorder.image("/camera/depth/image_rect_raw", 1.0 + i, image, "16UC1")
    recorder.close()
    return path


WRITERS = {
    "ROS 1": lambda folder: ros(folder / "a.bag", 1),
    "ROS 2": lambda folder: ros(folder / "b", 2),
    "MCAP": lambda folder: ros(folder / "c", 2, StoragePlugin.MCAP),
    "Record3D": lambda folder: packed(folder / "d.r3d", contents()),
}


@pytest.fixture(params=WRITERS)
def sequence(request: pytest.FixtureRequest, tmp_path: Path) -> nacre.datasets.Sequence:
    return nacre.open_sequence(WRITERS[request.param](tmp_path))


@pytest.fixture(autouse=True)
def threads_that_change_often() -> Iterator[None]:
    before = sys.getswitchinterval()
    sys.setswitchinterval(1e-5)
    yield
    sys.setswitchinterval(before)


def read_all(sequence: nacre.datasets.Sequence, seed: int, expected: list[bytes]) -> None:
    for index in np.random.default_rng(seed).integers(0, len(sequence), ROUNDS * len(sequence)):
        assert sequence[int(index)].depth.tobytes() == expected[index]


def test_threads(sequence: nacre.datasets.Sequence) -> None:
    expected = [frame.depth.tobytes() for frame in sequence]
    failed = []

    def work(seed: int) -> None:
        try:
            read_all(sequence, seed, expected)
        except BaseException as error:
            failed.append(error)

    threads = [threading.Thread(target=work, args=(seed,)) for seed in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert failed == []


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork here")
def test_forked_processes(sequence: nacre.datasets.Sequence) -> None:
    expected = [frame.depth.tobytes() for frame in sequence]
    children = []
    for seed in range(4):
        with warnings.catch_warnings():  # newer Pythons warn of fork with threads
            warnings.simplefilter("ignore", DeprecationWarning)
            child = os.fork()
        if child == 0:
            code = 1
            try:
                read_all(sequence, seed, expected)
                code = 0
            finally:
                os._exit(code)
        children.append(child)
    read_all(sequence, 4, expected)
    assert [os.waitpid(child, 0)[1] for child in children] == [0, 0, 0, 0]


FOLDERS = (write_tum, write_redwood, write_seven_scenes, write_icl_nuim, write_plain)


@pytest.mark.filterwarnings("ignore:.*assumed a PrimeSense camera:UserWarning")
@pytest.mark.filterwarnings("ignore:.*views have no true pose:UserWarning")
@pytest.mark.parametrize("write", [*WRITERS.values(), *FOLDERS])
def test_copies(write: Callable[[Path], Path], tmp_path: Path) -> None:
    folder = tmp_path / "recording"
    folder.mkdir()
    sequence = nacre.open_sequence(write(folder))
    for other in (pickle.loads(pickle.dumps(sequence)), copy.deepcopy(sequence)):
        for one, same in zip(sequence, other, strict=True):
            assert one.depth.tobytes() == same.depth.tobytes()
