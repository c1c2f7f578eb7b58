"""Files that are broken, and what whoever reads points must make of them."""

import tracemalloc

import pytest
from hypothesis import strategies as st

import nacre


def edits(farthest):
    """Return a few changes within the first bytes: where, how many bytes go, and which come."""
    edit = st.tuples(st.integers(0, farthest), st.integers(0, 3), st.binary(max_size=4))
    return st.lists(edit, min_size=1, max_size=4)


def edited(content, edits):
    for position, removed, inserted in edits:
        position %= len(content) + 1
        content = content[:position] + inserted + content[position + removed :]
    return content


def check_refused(path, content, message):
    """Points cannot be read, and the error tells why, in which file and where in it."""
    path.write_bytes(content)
    with pytest.raises(nacre.FileFormatError, match=message) as caught:
        nacre.read_points(path)
    assert str(path) in str(caught.value)
    assert caught.value.line is not None or caught.value.offset is not None or not content


def check_refused_cheaply(path, content):
    """Points cannot be read, and to find that out takes less than a mebibyte."""
    path.write_bytes(content)
    tracemalloc.start()
    try:
        with pytest.raises(nacre.FileFormatError):
            nacre.read_points(path)
        assert tracemalloc.get_traced_memory()[1] < 1 << 20
    finally:
        tracemalloc.stop()


def check_every_cut_refused(path, content):
    """Points cannot be read from any beginning of a file."""
    for size in range(len(content)):
        path.write_bytes(content[:size])
        with pytest.raises(nacre.FileFormatError):
            nacre.read_points(path)
