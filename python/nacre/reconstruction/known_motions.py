"""How a camera went on, where others know it."""

from __future__ import annotations

from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

Poses = dict[int, npt.NDArray[np.float64]]
"""Of frames, by their indices: (4, 4) ``world_from_camera``."""


@dataclass(frozen=True)
class Place:
    """
    Where a frame is to be.

    Attributes
    ----------
    world_from_camera : (4, 4) float64
        Its pose.
    is_first : bool
        Whether its piece has placed none before it: registration is to confirm how the piece lies.
    """

    world_from_camera: npt.NDArray[np.float64]
    is_first: bool


class Motions(Protocol):
    """
    Who knows how the camera went on.

    Attributes
    ----------
    reach : int
        How many of the newest frames :meth:`place` wants to know.
    """

    reach: int

    def at_work(self) -> AbstractContextManager[None]:
        """While this lasts they may be asked."""
        ...

    def place(self, index: int, placed: Poses) -> Place | None:
        """Return where a frame is to be, by the poses of others; None: only registration can tell."""
        ...
