"""Frames whose depth has a systematic error that is known."""

from __future__ import annotations

import collections.abc
import dataclasses
from typing import overload

from nacre.datasets.sequence import Sequence, SequenceFrame
from nacre.depth_calibration import DepthCalibration

Frames = collections.abc.Sequence[SequenceFrame]


def with_corrected_depth(frames: Frames, calibration: DepthCalibration) -> Frames:
    """Return the same frames without a systematic error of their depth."""
    if isinstance(frames, Sequence):
        return frames.with_depth_calibration(calibration)
    return _Corrected(frames, calibration)


class _Corrected(collections.abc.Sequence[SequenceFrame]):
    """Frames that are corrected when they are asked for."""

    def __init__(self, frames: Frames, calibration: DepthCalibration) -> None:
        self._frames = frames
        self._calibration = calibration

    def __len__(self) -> int:
        return len(self._frames)

    @overload
    def __getitem__(self, index: int) -> SequenceFrame: ...
    @overload
    def __getitem__(self, index: slice) -> _Corrected: ...
    def __getitem__(self, index: int | slice) -> SequenceFrame | _Corrected:
        if isinstance(index, slice):
            return _Corrected(self._frames[index], self._calibration)
        frame = self._frames[index]
        if frame.depth.shape != (frame.camera.height, frame.camera.width):
            return frame  # the model says so
        depth = self._calibration.correct(frame.depth, frame.camera)
        return dataclasses.replace(frame, depth=depth)
