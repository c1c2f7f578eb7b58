"""Ctrl-C and SIGTERM: the first is heeded where it can be, the second at once."""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

_TOGETHER = 0.3  # seconds


class Stopped(BaseException):
    """A signal ended the command where it was; files are whole all the same."""

    def __init__(self, number: int) -> None:
        super().__init__(number)
        self.number = number


class Interruption:
    """
    Whether Ctrl-C (SIGINT) or SIGTERM came.

    Signals that come together are one: a terminal sends it to the command and to what started it, such as
    ``timeout``, which passes it on.

    Attributes
    ----------
    number : int
        The first signal's; 0: none came.
    ends_at_once : bool
        Whether the first signal raises :class:`Stopped`: what runs has nothing to bring to its end.
    """

    def __init__(self) -> None:
        self.number = 0
        self.ends_at_once = False
        self._last = -_TOGETHER

    @property
    def wanted(self) -> bool:
        """Whether to stop."""
        return self.number != 0

    @property
    def exit_code(self) -> int:
        """The exit code of a program that the signal stopped: 130 or 143."""
        return 128 + self.number

    @contextmanager
    def at_once(self) -> Iterator[None]:
        """While what runs here has nothing to bring to its end."""
        self.ends_at_once = True
        try:
            yield
        finally:
            self.ends_at_once = False

    def note(self, number: int) -> None:
        """Take a signal."""
        before, self._last = self._last, time.monotonic()
        if self._last - before < _TOGETHER:
            return
        if self.number or self.ends_at_once:
            self.number = self.number or number
            raise Stopped(number)
        self.number = number


@contextmanager
def interruptible() -> Iterator[Interruption]:
    """Note the first Ctrl-C or SIGTERM, so that what there is can be saved; the second one stops at once."""
    state = Interruption()
    if threading.current_thread() is not threading.main_thread():
        yield state
        return
    numbers = (signal.SIGINT, signal.SIGTERM)
    before = [signal.signal(number, lambda number, frame: state.note(number)) for number in numbers]
    try:
        yield state
    finally:
        for number, handler in zip(numbers, before, strict=True):
            signal.signal(number, handler)
