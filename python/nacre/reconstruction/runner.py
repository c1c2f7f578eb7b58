"""The way of a recording into a model: one generator of steps, for all who run one."""

from __future__ import annotations

import logging
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from contextlib import closing, nullcontext
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from nacre.progress import as_progress
from nacre.reconstruction.frame_record import FrameRecord
from nacre.reconstruction.reconstruction import Reconstruction

if TYPE_CHECKING:
    from nacre.reconstruction.pieces.motions import PieceMotions

_log = logging.getLogger("nacre.reconstruction")


@dataclass(frozen=True)
class StageBegun:
    """A stage begins, with so many frames to come; None: nobody knows."""

    name: Literal["frames", "lost frames"]
    num_frames: int | None = None


@dataclass(frozen=True)
class FrameDone:
    """A frame was run, or a lost one was tried again."""

    frame: FrameRecord


Step = StageBegun | FrameDone


class Run:
    """
    A recording that is run through a model, step by step.

    Parameters
    ----------
    done : Reconstruction
        What there is already, of a run that goes on.
    indices : iterable of int
        The frames to run. Of a sequence, those that are done are left out; others are run as they come.
    retry : bool
        Whether lost frames are tried again at the end.
    motions : PieceMotions, optional
        What others have found of the camera's way.

    Attributes
    ----------
    done : Reconstruction
        The run up to now.
    motions : PieceMotions or None
        As given.
    """

    def __init__(
        self,
        done: Reconstruction,
        indices: Iterable[int],
        *,
        retry: bool = True,
        motions: PieceMotions | None = None,
    ) -> None:
        self.done = done
        self._indices = indices
        self._retry = retry
        self.motions = motions

    def steps(self) -> Generator[Step, None, None]:
        """Do one thing after the other, and yield each when it is done (a stage, when it begins)."""
        with nullcontext() if self.motions is None else self.motions.at_work():
            yield from self._frames()
        if self._retry:
            yield StageBegun("lost frames", self.done.counts["LOST"] or None)
            yield from map(FrameDone, self.done.retry_lost())
        for sentence in self.done.advice:
            _log.warning("%s", sentence)

    def to_end(self, progress: Callable[[FrameRecord], bool | None] | None = None) -> Reconstruction:
        """Do all of it, as far as a callback wants the frames, and evaluate the trajectory."""
        goes_on = None if progress is None else as_progress("progress", progress)
        with closing(self.steps()) as steps:
            for step in steps:
                if isinstance(step, FrameDone) and goes_on is not None and not goes_on(step.frame):
                    self.done.cancelled = True
                    _log.info("cancelled after %d frames", len(self.done.frames))
                    break
        self.done.evaluate_trajectory()
        return self.done

    def _frames(self) -> Iterator[Step]:
        rest = self._indices
        if isinstance(rest, Sequence):
            done = {frame.index for frame in self.done.frames}
            rest = [index for index in rest if index not in done]
            if not rest:
                return
        yield StageBegun("frames", len(rest) if isinstance(rest, Sequence) else None)
        yield from map(FrameDone, self.done.run(rest, motions=self.motions))
