"""The next frame of a recording, read while the one before it is worked on."""

from __future__ import annotations

import collections.abc
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from functools import partial

from nacre.datasets.sequence import Sequence, SequenceFrame

Reader = Callable[[], SequenceFrame]
"""Returns a frame, or raises what reading it raised."""


def read_ahead(
    sequence: collections.abc.Sequence[SequenceFrame], indices: Iterable[int]
) -> Iterator[tuple[int, Reader]]:
    """
    Yield each index with what returns its frame: in the meantime the next one is read in a thread.

    Only of recordings that nacre reads itself, and where the indices are all known: the sequences of others
    may not expect a thread, and frames of a camera come when they come.
    """
    if not (isinstance(sequence, Sequence) and isinstance(indices, collections.abc.Sequence)):
        yield from ((index, partial(sequence.__getitem__, index)) for index in indices)
        return
    with ThreadPoolExecutor(1, "nacre-read-ahead") as thread:
        before: tuple[int, Reader] | None = None
        for index in indices:
            next_one = index, thread.submit(sequence.__getitem__, index).result
            if before is not None:
                yield before
            before = next_one
        if before is not None:
            yield before
