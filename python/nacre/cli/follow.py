"""Following a run: a progress bar for each of its stages."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from typing import TYPE_CHECKING

from nacre.cli.terminal import Terminal

if TYPE_CHECKING:
    from nacre.reconstruction.runner import Run
    from nacre.reconstruction.steps import Step


class Bars:
    """A progress bar for each stage."""

    def __init__(self, terminal: Terminal, run: Run) -> None:
        self._terminal = terminal
        self._run = run
        self._bar = ExitStack()
        self._advance: Callable[[str], None] | None = None
        self._num_lost: int | None = None  # when they began to be tried again

    def __enter__(self) -> Bars:
        return self

    def __exit__(self, *_: object) -> None:
        self._bar.close()

    def show(self, step: Step) -> None:
        """Bring the bars to where a run is after a step."""
        from nacre.reconstruction.steps import FrameDone, StageBegun
        from nacre.run_data.text import count

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
                self._advance(f"{count(len(done.model))} points" + f", {num_lost} lost" * bool(num_lost))
