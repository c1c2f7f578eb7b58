"""Running a recording through a model, with a progress bar, until it ends or Ctrl-C."""

from __future__ import annotations

import re
import signal
import threading
from collections.abc import Callable, Iterable, Iterator, Sized
from contextlib import contextmanager
from typing import TYPE_CHECKING

from nacre.cli.terminal import CommandError, Terminal

if TYPE_CHECKING:
    from nacre.reconstruction import FrameRecord, Reconstruction


class Interruption:
    """Whether Ctrl-C was pressed."""

    def __init__(self) -> None:
        self.wanted = False


@contextmanager
def interruptible() -> Iterator[Interruption]:
    """Note the first Ctrl-C, so that what there is can be written; the second one stops at once."""
    state = Interruption()
    if threading.current_thread() is not threading.main_thread():
        yield state
        return

    def note(number: int, frame: object) -> None:
        if state.wanted:
            raise KeyboardInterrupt
        state.wanted = True

    before = signal.signal(signal.SIGINT, note)
    try:
        yield state
    finally:
        signal.signal(signal.SIGINT, before)


def run_frames(
    terminal: Terminal,
    done: Reconstruction,
    indices: Iterable[int],
    until: Callable[[FrameRecord], bool] | None = None,
    watch: Callable[[FrameRecord], None] | None = None,
) -> bool:
    """Run frames, show each to who watches, at most until one says so; return whether Ctrl-C stopped it."""
    accepted = any(frame.report is not None for frame in done.frames)
    total = len(indices) if isinstance(indices, Sized) else None
    with interruptible() as interruption, terminal.progress("frames", total) as advance:
        for frame in done.run(indices):
            if frame.refused and not accepted:
                raise CommandError(f"frame {frame.index}: {advice(frame.reason, done.sequence)}")
            accepted |= frame.report is not None
            if watch is not None:
                watch(frame)
            lost = done.counts["LOST"]
            advance(f"{len(done.model):,} points" + f", {lost} lost" * bool(lost))
            if interruption.wanted or (until is not None and until(frame)):
                break
    return interruption.wanted


def retry_lost(terminal: Terminal, done: Reconstruction) -> bool:
    """Go over the lost frames again, while any of them is found; return whether Ctrl-C stopped it."""
    num_lost = done.counts["LOST"]
    if not num_lost:
        return False
    with interruptible() as interruption, terminal.progress("lost frames", num_lost) as advance:
        for _ in done.retry_lost():
            advance(f"{num_lost - done.counts['LOST']} found")
            if interruption.wanted:
                break
    return interruption.wanted


def advice(reason: str, recording: object = None) -> str:
    """Return a message of the library in the words of the command line, with a depth scale that fits."""
    words = reason.replace("check depth_scale,", "give --depth-scale,").replace(
        "depth_scale", "--depth-scale"
    )
    found = re.search(r"got a median of ([\d.e+-]+) m", reason)
    scale = getattr(recording, "depth_scale", None)
    if found is None or scale is None:
        return words
    stored = float(found[1]) * scale
    fitting = [f"{s:g} ({stored / s:.2g} m)" for s in (1, 1000, 5000, 10000, 1e6) if 0.2 < stored / s < 10]
    tried = f"; it was read with {scale:g}"
    return words + tried + (f", and would make sense with {' or '.join(fitting)}" if fitting else "")
