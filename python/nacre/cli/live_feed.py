"""Frames that come by themselves: from a camera, or from a recording at the times when it was made."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any

from nacre.cli.signals import Interruption
from nacre.cli.terminal import CommandError
from nacre.errors import CameraError

if TYPE_CHECKING:
    from nacre.datasets import LiveQueue, RealSense, Sequence
    from nacre.reconstruction.runner import Step

_CAMERA = "realsense"


class LiveFeed:
    """
    The indices of frames, each when the frame is there; those that were too many are counted.

    A camera that stops after its first frame ends the feed, and ``error`` says why: what there is can be
    written. Before its first frame it raises.
    """

    def __init__(
        self,
        sequence: Sequence,
        queue: LiveQueue[Any],
        keep: Callable[[Any], int],
        pick: tuple[int, int | None, int] = (0, None, 1),
        close: Callable[[], None] | None = None,
    ) -> None:
        self.sequence = sequence
        self.error: CameraError | None = None
        self.is_camera = close is not None
        self._queue = queue
        self._keep = keep
        self._pick = pick
        self._close = close
        self._is_enough = False
        self._is_closed = False

    def __iter__(self) -> Iterator[int]:
        try:
            for index in islice(map(self._keep, self._queue), *self._pick):
                yield index
                if self._is_enough:
                    break
        except CameraError as error:
            if not self._queue.num_received:
                raise
            self.error = error

    def tend(self, step: Step, stop: Interruption) -> None:
        """Between two steps of a run: see that what came can be read again; end where it is enough."""
        from nacre.datasets.recorder import GrowingRecording
        from nacre.reconstruction.runner import FrameDone, StageBegun

        if isinstance(step, FrameDone) and isinstance(self.sequence, GrowingRecording):
            self.sequence.settle()  # what a journal will name
        if isinstance(step, StageBegun) and step.name == "lost frames":
            self.close(stop)
        self._heed(stop)

    def close(self, stop: Interruption | None = None) -> None:
        """Stop the camera and finish its recording."""
        if self._is_closed:
            return
        try:
            if self._close is not None:
                self._close()
            self._queue.close()
        finally:
            self._heed(stop)
            self._is_closed = True

    def _heed(self, stop: Interruption | None) -> None:
        """Take Ctrl-C: who stops a camera is content with what it saw."""
        if stop is not None and stop.number == signal.SIGINT and self.is_camera and not self._is_closed:
            stop.number = 0
            self._is_enough = True

    @property
    def figures(self) -> dict[str, Any]:
        """What report.json says of it."""
        return {
            "camera": self.is_camera,
            "num_received": self._queue.num_received,
            "num_dropped": self._queue.num_dropped,
            "queue_size": self._queue.size,
            "stopped": None if self.error is None else str(self.error),
        }

    @property
    def summary(self) -> str:
        """In a few words what became of the frames that came."""
        return f"{self._queue.num_dropped} of {self._queue.num_received} frames dropped"

    @property
    def rows(self) -> list[tuple[str, str]]:
        """The same in words."""
        came, dropped = self._queue.num_received, self._queue.num_dropped
        why = ": they came faster than they could be registered" if dropped else ""
        rows = [("frames dropped", f"{dropped} of {came}{why}")]
        if self.is_camera:
            rows.append(("recording", str(self.sequence.path)))
        return rows


def is_camera(source: Path) -> bool:
    """Say whether a source is a live camera, and not a file of that name."""
    return (str(source) == _CAMERA or str(source).startswith(f"{_CAMERA}:")) and not source.exists()


def open_camera(source: Path, color: bool = True) -> RealSense:
    """Start a camera: ``realsense``, ``realsense:SERIAL`` or ``realsense:FILE``."""
    from nacre.datasets import RealSense

    name = str(source).partition(":")[2] or None
    file = name if name is not None and (Path(name).suffix or Path(name).exists()) else None
    return RealSense(None if file else name, file=file, color=color)


def camera_feed(source: Path, out: Path, color: bool, pick: tuple[int, int | None, int]) -> LiveFeed:
    """Start a camera and keep what is used of it in ``out``."""
    from nacre.datasets import GrowingRecording, LiveQueue

    camera = open_camera(source, color)
    try:
        title = f"{camera.name} {camera.serial}"
        sequence = GrowingRecording(out / "recording", camera.camera, camera.depth_scale, title)
    except FileExistsError as error:
        camera.close()
        raise CommandError(f"{error}; -o names the folder", 2) from error

    queue = LiveQueue(camera, timeout=2 * camera.timeout)  # the camera itself knows better what is wrong

    def close() -> None:
        camera.close()
        sequence.close()

    return LiveFeed(sequence, queue, sequence.add, pick, close)


def real_time_feed(sequence: Sequence, indices: range) -> LiveFeed:
    """Play a recording as its camera saw it."""
    from nacre.datasets import LiveQueue, in_real_time

    return LiveFeed(sequence, LiveQueue(in_real_time(sequence, indices)), int)
