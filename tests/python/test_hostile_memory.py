"""Hostile files take at most 4 times their size and a megabyte, C libraries included, and no time."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from hostile_files.measure import allowed

HERE = Path(__file__).parent
# rosbags asks for as many bytes as a record of a .bag says, before it finds that they are not there.
NOT_UNDER_A_LIMIT = ("recording/bag_",)


# From this size on a block has pages of its own, given back at once. By default it depends on the past.
BLOCKS = [None, 1 << 17, 1 << 25]


def measured(*options, blocks=None):
    if not Path("/proc/self/clear_refs").exists():
        pytest.skip("the peak of memory can be read on Linux only")
    done = subprocess.run(
        [sys.executable, HERE / "hostile_files" / "measure.py", *options],
        env=os.environ
        if blocks is None
        else os.environ | {"GLIBC_TUNABLES": f"glibc.malloc.mmap_threshold={blocks}"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return [json.loads(line) for line in done.stdout.splitlines() if line.startswith("{")]


@pytest.fixture(scope="module", params=BLOCKS)
def rows(request):
    found = measured(blocks=request.param)
    assert len(found) > 400
    return found


def test_peak_of_memory_is_bounded(rows):
    assert [
        (row["name"], row["size"], row["peak"]) for row in rows if row["peak"] > allowed(row["size"])
    ] == []


def test_error_is_the_same_where_no_more_memory_can_be_had(rows):
    checked = [row for row in rows if not row["name"].startswith(NOT_UNDER_A_LIMIT)]
    assert [row for row in checked if row["limited"] != row["said"]] == []


def test_no_file_takes_long(rows):
    assert [(row["name"], row["seconds"]) for row in rows if row["seconds"] > 2] == []


@pytest.mark.parametrize("blocks", BLOCKS)
def test_large_files_take_four_times_what_they_hold(blocks):
    rows = measured("--large", blocks=blocks)
    assert len(rows) == 10
    assert [row for row in rows if row["peak"] > allowed(max(row["size"], row["held"]))] == []
    real = [row for row in rows if row["name"].startswith(("binary", "text"))]
    assert [row for row in real if row["peak"] > 3 * row["size"]] == []
