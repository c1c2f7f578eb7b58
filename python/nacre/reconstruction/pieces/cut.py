"""Where a recording is cut: decided by its frames alone, so that the result does not depend on who works."""

from __future__ import annotations

from collections.abc import Sequence

# Two seconds of a camera's frames. What neighbours share is tracked twice: shorter pieces repeat more of the
# work, longer ones leave workers of a short recording idle.
PIECE = 60
# Each shared frame measures how two pieces lie to each other: ten of them, to a third of one's error.
SHARED = 10


def cut(indices: Sequence[int]) -> list[Sequence[int]]:
    """Return the frames of each piece; neighbours share some, and the last piece has more than those."""
    starts = range(0, max(1, len(indices) - SHARED), PIECE - SHARED)
    return [indices[start : start + PIECE] for start in starts]
