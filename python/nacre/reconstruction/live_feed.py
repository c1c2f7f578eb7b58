"""Frames that come by themselves: from a camera, or from a recording at the times when it was made."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator
from contextlib import suppress
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any

from nacre._internal.signals import Interruption
from nacre.datasets.live_cameras import open_camera
from nacre.errors import CameraError, FileFormatError, RunError

if TYPE_CHECKING:
    from nacre.datasets import LiveQueue, Sequence, SequenceFrame
    from nacre.reconstruction.steps import Step
    from nacre.viewer import Controls


# Frames: a second of most cameras, which the first frames may take while nobody knows how noisy they are.
_MOST_WAITING = 30


class LiveFeed:
    """
    The indices of frames, each when the frame is there; those that were too many are counted.

    With controls, frames count while these say so; the button to stop ends the feed as Ctrl-C does. A camera
    that stops after its first frame ends it too, and ``error`` says why: what there is can be written.
    Before its first frame it raises.
    """

    def __init__(
        self,
        sequence: Sequence,
        queue: LiveQueue[Any],
        keep: Callable[[Any], int],
        pick: tuple[int, int | None, int] = (0, None, 1),
        close: Callable[[], None] | None = None,
        *,
        stop: Interruption | None = None,
        controls: Controls | None = None,
    ) -> None:
        self.sequence = sequence
        self.error: CameraError | None = None
        self.is_camera = close is not None
        self._queue = queue
        self._keep = keep
        self._pick = pick
        self._close = close
        self._stop = stop or Interruption()
        self._controls = controls
        self._num_unwanted = 0
        self._is_enough = False
        self._is_closed = False

    def __iter__(self) -> Iterator[int]:
        try:
            yield from islice(map(self._keep, self._wanted()), *self._pick)
        except CameraError as error:
            if not self._queue.num_received:
                raise
            if not self._has_enough():
                self.error = error

    def _wanted(self) -> Iterator[Any]:
        """Yield what comes while it is wanted, until it is enough."""
        for item in self._queue:
            is_enough = self._has_enough()
            if not is_enough and (self._controls is None or self._controls.is_recording):
                yield item
            else:
                self._num_unwanted += 1
            if is_enough or self._has_enough():
                return

    def tend(self, step: Step) -> None:
        """Between two steps of a run: see that what came can be read again; end where it is enough."""
        from nacre.datasets.recorder import GrowingRecording
        from nacre.reconstruction.steps import FrameDone, StageBegun

        if isinstance(step, FrameDone) and isinstance(self.sequence, GrowingRecording):
            self.sequence.settle()  # what a journal will name
        if isinstance(step, StageBegun) and step.name == "lost frames":
            self.close()
        self._has_enough()

    def close(self) -> None:
        """Stop the camera and finish its recording."""
        if self._is_closed:
            return
        try:
            if self._close is not None:
                self._close()
            self._queue.close()
        finally:
            self._has_enough()
            self._is_closed = True
            if self._controls is not None:
                self._controls.end(str(self.error or ""))

    def _has_enough(self) -> bool:
        """Heed the button, and Ctrl-C: who stops a camera is content with what it saw."""
        if self._stop.number == signal.SIGINT and self.is_camera and not self._is_closed:
            self._stop.number = 0
            self._is_enough = True
        if self._controls is not None and self._controls.is_over:
            self._is_enough = True
        return self._is_enough or self._stop.wanted

    @property
    def num_received(self) -> int:
        """How many frames came while they were wanted."""
        return self._queue.num_received - self._num_unwanted

    @property
    def figures(self) -> dict[str, Any]:
        """What report.json says of it."""
        return {
            "camera": self.is_camera,
            "num_received": self.num_received,
            "num_dropped": self._queue.num_dropped,
            "queue_size": self._queue.size,
            "stopped": None if self.error is None else str(self.error),
        }

    @property
    def summary(self) -> str:
        """In a few words what became of the frames that came."""
        return f"{self._queue.num_dropped} of {self.num_received} frames dropped"

    @property
    def rows(self) -> list[tuple[str, str]]:
        """The same in words."""
        came, dropped = self.num_received, self._queue.num_dropped
        why = ": they came faster than they could be registered" if dropped else ""
        rows = [("frames dropped", f"{dropped} of {came}{why}")]
        if self.is_camera:
            rows.append(("recording", str(self.sequence.path)))
        return rows


def camera_feed(
    source: Path,
    out: Path,
    color: bool,
    pick: tuple[int, int | None, int],
    *,
    stop: Interruption,
    controls: Controls | None = None,
) -> LiveFeed:
    """Start a camera and keep what is used of it in ``out``."""
    from nacre.datasets import GrowingRecording, LiveQueue

    camera = open_camera(source, color)
    try:
        title = f"{camera.name} {camera.serial}".rstrip()
        sequence = GrowingRecording(out / "recording", camera.camera, camera.depth_scale, title)
    except FileExistsError as error:
        camera.close()
        raise RunError(f"{error}; -o names the folder", 2) from error

    def seen() -> Iterator[SequenceFrame]:
        for frame in camera:
            if controls is not None:
                controls.see(frame)
            yield frame

    queue = LiveQueue(
        seen(),
        size=_MOST_WAITING,
        timeout=2 * camera.timeout,  # the camera itself knows better what is wrong
    )

    def close() -> None:
        camera.close()
        sequence.close()

    return LiveFeed(sequence, queue, sequence.add, pick, close, stop=stop, controls=controls)


def real_time_feed(
    sequence: Sequence, indices: range, *, stop: Interruption | None = None, controls: Controls | None = None
) -> LiveFeed:
    """Play a recording as its camera saw it."""
    from nacre.datasets import LiveQueue, in_real_time

    def seen() -> Iterator[int]:
        for index in in_real_time(sequence, indices):
            if controls is not None:
                with suppress(FileFormatError, OSError):  # the run tells of a frame that cannot be read
                    controls.see(sequence[index])
            yield index

    return LiveFeed(sequence, LiveQueue(seen(), size=_MOST_WAITING), int, stop=stop, controls=controls)
