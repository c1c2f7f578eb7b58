"""A queue between a camera and who works with its frames: where that is too slow, old frames are dropped."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from typing import Generic, TypeVar

from nacre.datasets.closable import Closable
from nacre.errors import CameraError

Item = TypeVar("Item")


class LiveQueue(Closable, Iterator[Item], Generic[Item]):
    """
    Fetches items in a thread of its own and hands them on in their order, through a bounded queue.

    Where the queue is full the oldest item is dropped, and counted: who works with the frames of a camera
    sees the present, however long a frame takes.

    Parameters
    ----------
    items : iterable
        Whatever is fetched, for instance a camera's frames. It is iterated in the thread, from the first
        ``next`` or ``with`` on; a generator is closed there.
    size : int
        How many items may wait.
    timeout : float
        How long to wait for an item [s].

    Attributes
    ----------
    num_received, num_dropped : int
        How many items came, and how many of them were dropped.

    Raises
    ------
    CameraError
        On ``next``, when no item came for ``timeout`` seconds. What iterating ``items`` raises is raised
        there too, after the items that came before.

    Examples
    --------
    >>> with LiveQueue(range(3), size=8) as frames:
    ...     print(list(frames), frames.num_dropped)
    [0, 1, 2] 0
    """

    def __init__(self, items: Iterable[Item], *, size: int = 8, timeout: float = 5.0) -> None:
        if size < 1:
            raise ValueError(f"size must be 1 or more, got {size!r}")
        if not timeout > 0:
            raise ValueError(f"timeout must be positive seconds, got {timeout!r}")
        self.size = size
        self.timeout = timeout
        self.num_received = 0
        self.num_dropped = 0
        self._waiting: deque[Item] = deque()
        self._changed = threading.Condition()
        self._closed = False
        self._ended = False
        self._error: BaseException | None = None
        self._thread = threading.Thread(target=self._fetch, args=(items,), name="nacre-live", daemon=True)
        self._started = False

    def __enter__(self) -> LiveQueue[Item]:
        self._start()
        return self

    def __iter__(self) -> Iterator[Item]:
        return self

    def __next__(self) -> Item:
        self._start()
        with self._changed:
            arrived = self._changed.wait_for(self._has_news, self.timeout)
            if self._closed:
                raise StopIteration
            if self._waiting:
                return self._waiting.popleft()
            if not arrived:
                raise CameraError(f"no frame came for {self.timeout:g} s")
            error, self._error = self._error, None
        if error is not None:
            raise error
        raise StopIteration

    def close(self) -> None:
        """Stop fetching and forget what waits; waits for the thread as long as for a frame."""
        with self._changed:
            self._closed = True
            self._waiting.clear()
            self._changed.notify_all()
        if self._started and self._thread is not threading.current_thread():
            self._thread.join(self.timeout)

    def _start(self) -> None:
        with self._changed:
            if not self._started and not self._closed:
                self._thread.start()
                self._started = True

    def _has_news(self) -> bool:
        return bool(self._waiting) or self._ended or self._closed

    def _fetch(self, items: Iterable[Item]) -> None:
        iterator = iter(items)
        error: BaseException | None = None
        try:
            for item in iterator:
                with self._changed:
                    if self._closed:
                        break
                    self.num_received += 1
                    self._waiting.append(item)
                    if len(self._waiting) > self.size:
                        self._waiting.popleft()
                        self.num_dropped += 1
                    self._changed.notify_all()
        except BaseException as raised:  # it belongs to who asks for the next item
            error = raised
        finally:
            close: Callable[[], None] | None = getattr(iterator, "close", None)
            if close is not None:
                close()
            with self._changed:
                self._error = error
                self._ended = True
                self._changed.notify_all()
