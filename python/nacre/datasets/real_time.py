"""Playing a recording as its camera saw it: each view at its time."""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator

from nacre._internal.guided import guided
from nacre.datasets.sequence import Sequence

_FRAMES_PER_SECOND = 30.0


@guided()
def in_real_time(sequence: Sequence, indices: Iterable[int]) -> Iterator[int]:
    """
    Yield indices of a recording when their time has come, the first one at once.

    Views without time stamps come 30 times a second, and so does a view that is stamped before the last one.

    Parameters
    ----------
    sequence : Sequence
        The recording.
    indices : iterable of int
        Which of its views, in their order.
    """
    start: float | None = None
    last: float | None = None
    due = 0.0
    for index in indices:
        stamp = sequence.timestamp(index)
        step = 1 / _FRAMES_PER_SECOND
        if stamp is not None and last is not None and stamp >= last:
            step = stamp - last
        last = stamp
        if start is None:
            start = time.monotonic()
        else:
            due += step
        time.sleep(max(0.0, start + due - time.monotonic()))
        yield index
