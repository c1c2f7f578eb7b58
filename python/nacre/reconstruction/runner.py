"""A recording that is run through a model, with what it was asked to do."""

from __future__ import annotations

from collections.abc import Generator, Iterable
from dataclasses import KW_ONLY, dataclass

from nacre.reconstruction.known_motions import Motions
from nacre.reconstruction.reconstruction import Reconstruction
from nacre.reconstruction.steps import Step


@dataclass(eq=False)
class Run:
    """
    A recording that is run through a model, step by step.

    Attributes
    ----------
    done : Reconstruction
        The run up to now.
    indices : iterable of int
        Frames of the recording that are still to do, in this order.
    retry : bool
        Whether frames whose pose was not found are tried again at the end.
    motions : Motions or None
        What is known of the camera's motion between frames, apart from the images.
    """

    done: Reconstruction
    indices: Iterable[int]
    _: KW_ONLY
    retry: bool = True
    motions: Motions | None = None

    def steps(self) -> Generator[Step, None, None]:
        """Do one thing after the other, and yield each when it is done (a stage, when it begins)."""
        return self.done.steps(self.indices, retry=self.retry, motions=self.motions)
