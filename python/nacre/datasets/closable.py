"""What is closed at the end of a ``with`` block."""

from __future__ import annotations

from abc import ABC, abstractmethod
from types import TracebackType
from typing import TypeVar

_Opened = TypeVar("_Opened", bound="Closable")


class Closable(ABC):
    """Base of what holds a device or a thread until it is closed."""

    @abstractmethod
    def close(self) -> None:
        """Let go of it; calling this again does nothing."""

    def __enter__(self: _Opened) -> _Opened:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
