"""The depth of a recording is calibrated by its first views; where it is wrong, the run begins again."""

from __future__ import annotations

import logging

import numpy as np
import numpy.typing as npt

from nacre import Camera
from nacre.datasets.corrected import with_corrected_depth
from nacre.datasets.sequence import SequenceFrame
from nacre.depth_calibration import (
    LEAST_TURN,
    LEAST_VIEWS,
    MOST_VIEWS,
    calibrate_depth,
    can_calibrate,
    turn_between,
)
from nacre.model import Model
from nacre.parameters import ModelParameters, RegionParameters
from nacre.reconstruction.frame_record import FrameRecord
from nacre.reconstruction.reconstruction import Reconstruction
from nacre.reconstruction.saved_state import pose_from

_log = logging.getLogger("nacre.reconstruction")


def shows_one_scene(camera: Camera, parameters: ModelParameters) -> bool:
    """Say whether a model takes whole images, of a camera whose depth can be calibrated."""
    # What turns before a camera that stands still is not one scene with what is around it.
    return can_calibrate(camera) and parameters.region == RegionParameters()


class DepthViews:
    """
    Frames in different directions, as far as a calibration of depth needs them.

    Parameters
    ----------
    chosen : list of (index, pose), optional
        Those that there are; poses row by row. It is added to.
    """

    def __init__(self, chosen: list[tuple[int, list[float]]] | None = None) -> None:
        self.chosen = [] if chosen is None else chosen

    @property
    def are_enough(self) -> bool:
        """Whether no more are needed."""
        return len(self.chosen) == MOST_VIEWS

    def add(self, frame: FrameRecord) -> bool:
        """Take a frame that looks in a new direction; say whether there are enough."""
        pose = frame.world_from_camera
        if pose is not None and frame.status != "WEAK":
            last = pose_from(self.chosen[-1][1]) if self.chosen else None
            if last is None or turn_between(last, pose) >= LEAST_TURN:
                self.chosen.append((frame.index, pose.ravel().tolist()))
        return self.are_enough

    def calibrate(self, done: Reconstruction) -> Reconstruction:
        """Return the run, which knows then what the views say; a new one where depth is to be corrected."""
        if len(self.chosen) < LEAST_VIEWS:
            return done
        camera = done.model.camera
        views = ((_of_interest(done.sequence[index]), pose_from(pose)) for index, pose in self.chosen)
        calibration = calibrate_depth(views, camera)
        if calibration.is_significant:
            frames = with_corrected_depth(done.sequence, calibration)
            done = Reconstruction(frames, Model(camera, parameters=done.model.parameters))
        done.depth_calibration = calibration
        if advice := calibration.focal_length_advice(camera):
            _log.warning("%s", advice)
        return done


def _of_interest(frame: SequenceFrame) -> npt.NDArray[np.float32]:
    """Return the depth that the model sees: what a mask leaves out may move otherwise."""
    return frame.depth if frame.mask is None else np.where(frame.mask, frame.depth, np.float32(np.nan))
