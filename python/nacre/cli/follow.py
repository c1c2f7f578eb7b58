"""Following a run: progress bars, and signals that stop it between two steps."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from contextlib import ExitStack, closing
from typing import TYPE_CHECKING

from nacre.cli.signals import Interruption
from nacre.cli.terminal import CommandError, Terminal

if TYPE_CHECKING:
    from nacre.reconstruction.reconstruction import Reconstruction
    from nacre.reconstruction.runner import Run, Step


def follow(
    terminal: Terminal, run: Run, stop: Interruption, listeners: Sequence[Callable[[Step], None]] = ()
) -> None:
    """Carry out a run until it ends or is stopped; listeners are told of every step, in their order."""
    with closing(run.steps()) as steps, _Bars(terminal, run) as bars:
        for step in steps:
            _refuse_a_wrong_recording(run.done, step)
            for listener in listeners:
                listener(step)
            bars.show(step)
            if stop.wanted:
                break


class _Bars:
    """A progress bar for each stage."""

    def __init__(self, terminal: Terminal, run: Run) -> None:
        self._terminal = terminal
        self._run = run
        self._bar = ExitStack()
        self._advance: Callable[[str], None] | None = None
        self._num_lost: int | None = None  # when they began to be tried again

    def __enter__(self) -> _Bars:
        return self

    def __exit__(self, *_: object) -> None:
        self._bar.close()

    def show(self, step: Step) -> None:
        from nacre.reconstruction.runner import FrameDone, StageBegun

        done = self._run.done
        num_lost = done.counts["LOST"]
        if isinstance(step, StageBegun):
            self._bar.close()
            self._advance = self._bar.enter_context(self._terminal.progress(step.name, step.num_frames))
            self._num_lost = num_lost if step.name == "lost frames" else None
        elif isinstance(step, FrameDone) and self._advance is not None:
            if self._num_lost is not None:
                self._advance(f"{self._num_lost - num_lost} found")
            else:
                self._advance(f"{len(done.model):,} points" + f", {num_lost} lost" * bool(num_lost))


def _refuse_a_wrong_recording(done: Reconstruction, step: Step) -> None:
    """End the run where the model cannot use even the first frames: wrong size or wrong depth scale."""
    from nacre.reconstruction.runner import FrameDone

    if isinstance(step, FrameDone) and step.frame.refused and all(f.report is None for f in done.frames):
        raise CommandError(f"frame {step.frame.index}: {advice(step.frame.reason, done.sequence)}")


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
