"""Callbacks that are told how far a long call has come, and may end it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any


class Cancelled(Exception):  # noqa: N818  no error, as KeyboardInterrupt is none
    """
    Raised by a progress callback to end the call; to return False is the same.

    What had been done by then is what the call returns, and its result says that it was cancelled. Any other
    exception of a callback comes out of the call.
    """


def as_progress(name: str, callback: Callable[..., Any]) -> Callable[..., bool]:
    """Return a callback that says whether to go on: not when it returned False or raised Cancelled."""
    if not callable(callback):
        raise TypeError(f"{name} must be a function or None, got {callback!r}")

    def goes_on(*told: Any) -> bool:
        try:
            return callback(*told) is not False
        except Cancelled:
            return False

    return goes_on
