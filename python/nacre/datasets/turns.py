"""Files that stay open while frames are read from them."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager


class Turns:
    """
    Threads take turns with an open file, and a forked process opens its own.

    A file that is open has one place where it is read next, whoever reads it.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._process = os.getpid()

    @contextmanager
    def take(self, open_again: Callable[[], None]) -> Iterator[None]:
        """Keep other threads out; call ``open_again`` first where this process has not opened the file."""
        if self._process != os.getpid():  # and whoever had the lock is not in this process
            self._lock = threading.Lock()
            with self._lock:
                open_again()
            self._process = os.getpid()
        with self._lock:
            yield
