"""Running a recording through a model, with a progress bar, until it ends or Ctrl-C."""

from __future__ import annotations

import logging
import signal
import threading
from collections.abc import Callable, Iterable, Iterator, Sized
from contextlib import contextmanager
from typing import TYPE_CHECKING

from nacre.cli.terminal import CommandError, Terminal

if TYPE_CHECKING:
    from nacre.reconstruction import FrameRecord, Reconstruction

_log = logging.getLogger(__name__)


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
                raise CommandError(f"frame {frame.index}: {advice(frame.reason)}")
            accepted |= frame.report is not None
            if frame.status in ("LOST", "WEAK"):
                _log.info("frame %d: %s: %s", frame.index, frame.status, frame.reason)
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
        for frame in done.retry_lost():
            if frame.world_from_camera is not None:
                _log.info("frame %d: found after all", frame.index)
            advance(f"{num_lost - done.counts['LOST']} found")
            if interruption.wanted:
                break
    return interruption.wanted


def advice(reason: str) -> str:
    """Return a message of the library in the words of the command line."""
    return reason.replace("check depth_scale,", "give --depth-scale,").replace("depth_scale", "--depth-scale")
