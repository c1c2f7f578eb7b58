"""Keeping a viewer up to date while a reconstruction runs."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Protocol

from nacre.datasets.sequence import SequenceFrame
from nacre.model import Model
from nacre.run_data.frame_record import FrameRecord
from nacre.run_data.motion import frames_shown
from nacre.run_data.reported_frame import ReportedFrame
from nacre.viewer.controls import Controls
from nacre.viewer.server import Viewer
from nacre.viewer.snapshot import Snapshot
from nacre.viewer.timeline import Timeline

_SHARE = 5.0


class GrowingRun(Protocol):
    """What of a :class:`nacre.reconstruction.Reconstruction` is shown."""

    sequence: Sequence[SequenceFrame]
    model: Model
    frames: list[FrameRecord]


class LiveView:
    """
    A viewer of a reconstruction that is running. It takes a sixth of the time at most.

    Parameters
    ----------
    done : Reconstruction
        The run.
    title : str
        Of the page.
    host, port, controls : str, int, Controls
        See :class:`Viewer`.
    """

    def __init__(
        self,
        done: GrowingRun,
        title: str,
        *,
        host: str = "127.0.0.1",
        port: int = 8080,
        controls: Controls | None = None,
    ) -> None:
        self._done = done
        depth = done.model.parameters.depth
        self.timeline = Timeline(
            title,
            done.model.camera,
            depth_of=lambda index: self._done.sequence[index].depth,
            depth_range=(depth.min_depth, depth.max_depth),
        )
        self.timeline.is_growing = True
        self.viewer = Viewer(self.timeline, host=host, port=port, parameters=depth, controls=controls)
        self._next = 0.0

    def add(self, record: FrameRecord) -> None:
        """Note a frame; show it if there is time."""
        self.timeline.add(ReportedFrame(**record.as_dict()))
        if time.monotonic() >= self._next:
            self.show()

    def show(self) -> None:
        """Show the newest frame and the model as it is now."""
        start = time.monotonic()
        if len(self._done.model):
            self.timeline.set_snapshot(Snapshot.of(self._done.model, self._frame_shown()))
        self.viewer.refresh()
        now = time.monotonic()
        self._next = now + _SHARE * (now - start)

    def _frame_shown(self) -> int | None:
        """Return the frame of a model that deforms whose shape the newest frame of the run has."""
        if not self._done.model.parameters.deform:
            return None
        return next(iter(frames_shown([frame.report for frame in self._done.frames])[-1:]), None)

    def finish(self, message: str = "") -> None:
        """Show the end, with a message: poses as loops have corrected them, frames found after all."""
        self.timeline.is_growing = False
        self.timeline.frames[:] = [ReportedFrame(**record.as_dict()) for record in self._done.frames]
        self.show()
        if self.viewer.controls is not None:
            self.viewer.controls.end(message, finished=True)
