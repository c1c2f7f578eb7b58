"""Files that stay open while frames are read from them."""

from __future__ import annotations

import os
import threading
from abc import ABC, abstractmethod
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any


class OpenFile(ABC):
    """
    Base of what reads from an open file, ``_file``: a forked process and a copy open it again.

    Threads take turns: a file that is open has one place where it is read next, whoever reads it.
    """

    def __init__(self) -> None:
        self._begin()

    @abstractmethod
    def _open(self) -> Any:
        """Return the open file."""

    def _begin(self) -> None:
        self._lock = threading.Lock()
        self._file = self._open()
        self._process = os.getpid()

    @contextmanager
    def _turn(self) -> Iterator[Any]:
        """Keep other threads out, and yield the file."""
        if self._process != os.getpid():
            self._begin()
        with self._lock:
            yield self._file

    def __getstate__(self) -> dict[str, Any]:
        own = ("_lock", "_file", "_process")
        return {name: value for name, value in vars(self).items() if name not in own}

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state)
        self._begin()
