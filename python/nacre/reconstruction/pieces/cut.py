"""Where a recording is cut: decided by its frames alone, so that the result does not depend on who works."""

from __future__ import annotations

from collections.abc import Sequence

# At least two seconds of a camera's frames. What neighbours share is tracked twice, and each joint adds its
# error: shorter pieces repeat more of the work and drift more, longer ones leave workers of a short
# recording idle.
PIECE = 60
# Where more work side by side, what one process does for all frames takes longer than they do.
MOST_PIECES = 32
# Each shared frame measures how two pieces lie to each other: ten of them, to a third of one's error.
SHARED = 10


def cut(indices: Sequence[int]) -> list[Sequence[int]]:
    """Return the frames of each piece; neighbours share some, and the last piece has more than those."""
    own = max(1, len(indices) - SHARED)
    step = max(PIECE - SHARED, -(-own // MOST_PIECES))
    return [indices[start : start + step + SHARED] for start in range(0, own, step)]
