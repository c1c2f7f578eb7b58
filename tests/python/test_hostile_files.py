"""Files from strangers: each of the corpus gives nacre's own error, with file, place and reason, in time."""

import gc
import importlib.util
import os
import time

import pytest
from hostile_files import CASES, opened, write
from hostile_files.valid import VALID

import nacre

MOST_SECONDS = 2.0
RUNNABLE = [
    name
    for name, case in CASES.items()
    if importlib.util.find_spec(case.needs) is not None
    and (os.name == "posix" or not (case.links or case.pipes))
]


@pytest.fixture(autouse=True)
def _earlier_garbage_stays():
    """Else finalisers of what other tests left may run where a nested file meets Python's recursion limit."""
    gc.freeze()
    yield
    gc.unfreeze()


def test_corpus_is_large_and_always_the_same():
    assert len(CASES) >= 500
    kinds = {name.split("/")[0] for name in CASES}
    assert kinds >= {"ply", "pcd", "mesh", "image", "trajectory", "camera", "config", "recording", "output"}
    assert CASES["ply/garbage"].files["a.ply"][:4].hex() == "ffe42279"


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("name", RUNNABLE)
def test_error_names_file_place_and_reason(tmp_path, name):
    path = write(CASES[name], tmp_path)
    start = time.process_time()
    with pytest.raises(nacre.FileFormatError, match=CASES[name].message) as caught:
        opened(CASES[name], path)
    assert time.process_time() - start < MOST_SECONDS
    assert str(caught.value.path).startswith(str(path))
    assert len(str(caught.value)) < 3000
    if CASES[name].reader == "points" and "empty" not in name:
        assert caught.value.line is not None or caught.value.offset is not None


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("name", [n for n in VALID if importlib.util.find_spec(VALID[n].needs) is not None])
def test_what_is_to_be_damaged_is_whole(tmp_path, name):
    opened(VALID[name], write(VALID[name], tmp_path))
