"""Running a recording through a model, with a progress bar, until it ends or is stopped."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sized
from typing import TYPE_CHECKING

from nacre.cli.signals import Interruption
from nacre.cli.terminal import CommandError, Terminal

if TYPE_CHECKING:
    from nacre.reconstruction import Reconstruction
    from nacre.reconstruction.frame_record import FrameRecord


def run_frames(
    terminal: Terminal,
    done: Reconstruction,
    indices: Iterable[int],
    stop: Interruption,
    *,
    until: Callable[[FrameRecord], bool] | None = None,
    watch: Callable[[FrameRecord], None] | None = None,
) -> None:
    """Run frames, show each to who watches, until the run is stopped or one says so."""
    accepted = any(frame.report is not None for frame in done.frames)
    total = len(indices) if isinstance(indices, Sized) else None
    with terminal.progress("frames", total) as advance:
        for frame in done.run(indices):
            if frame.refused and not accepted:
                raise CommandError(f"frame {frame.index}: {advice(frame.reason, done.sequence)}")
            accepted |= frame.report is not None
            enough = until is not None and until(frame)
            if watch is not None:
                watch(frame)
            lost = done.counts["LOST"]
            advance(f"{len(done.model):,} points" + f", {lost} lost" * bool(lost))
            if stop.wanted or enough:
                break


def retry_lost(
    terminal: Terminal,
    done: Reconstruction,
    stop: Interruption,
    watch: Callable[[FrameRecord], None] | None = None,
) -> None:
    """Go over the lost frames again, while any of them is found, until the run is stopped."""
    num_lost = done.counts["LOST"]
    with terminal.progress("lost frames", num_lost or None) as advance:
        for frame in done.retry_lost():
            if watch is not None:
                watch(frame)
            advance(f"{num_lost - done.counts['LOST']} found")
            if stop.wanted:
                break


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
