"""What is known of a run: what became of its frames, and what follows from them."""

from __future__ import annotations

import collections.abc
import dataclasses
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre._internal.arrays import stacked_poses
from nacre._internal.kinds import as_kind
from nacre.datasets.sequence import SequenceFrame
from nacre.depth_calibration import DepthCalibration
from nacre.evaluation import absolute_trajectory_error, relative_pose_error
from nacre.evaluation.result import Result
from nacre.frame_report import count_statuses
from nacre.io.cloud import Cloud
from nacre.model import Model
from nacre.report.doubled_surfaces import DoubledSurfaces, find_doubled_surfaces
from nacre.run_data.frame_record import FrameRecord
from nacre.trajectory import Trajectory

Pose = npt.NDArray[np.float64]


class RunRecord:
    """The frames of a run that are done, with their model; see :class:`Reconstruction`."""

    def __init__(self, sequence: collections.abc.Sequence[SequenceFrame], model: Model) -> None:
        self.sequence = as_kind("sequence", sequence, collections.abc.Sequence, "a nacre.Sequence")
        self.model = as_kind("model", model, Model, "a nacre.Model")
        self.frames: list[FrameRecord] = []
        self.evaluation: dict[str, Result] = {}
        self.cancelled = False
        self.all_points = False
        self.num_dropped = 0  # of frames that came faster than they could be registered
        self._cloud: tuple[tuple[int, bool], Cloud] | None = None  # of so many frames
        self._doubled: tuple[int, DoubledSurfaces] | None = None  # after so many of the model's frames

    def _newest_poses(self, count: int) -> dict[int, Pose]:
        """Return the poses of those of the newest frames that are part of the model, by their indices."""
        places = range(max(0, len(self.frames) - count), len(self.frames))
        poses = {self.frames[place].index: self._pose_at(place) for place in places}
        return {index: pose for index, pose in poses.items() if pose is not None}

    @property
    def fused_poses(self) -> dict[int, Pose]:
        """(4, 4) ``world_from_camera`` of the frames that are part of the model, by their indices."""
        return self._newest_poses(len(self.frames))

    def _pose_at(self, place: int) -> Pose | None:
        """Return the pose of a frame that is part of the model."""
        if not 0 <= place < len(self.frames) or self.frames[place].fused_index < 0:
            return None
        return self.frames[place].world_from_camera

    @property
    def depth_calibration(self) -> DepthCalibration | None:
        """What the frames say of systematic errors of the depth (:attr:`Model.depth_calibration`)."""
        return self.model.depth_calibration

    @property
    def advice(self) -> list[str]:
        """What the frames say is wrong with the camera as it was given, or with its depth; sentences."""
        told, unit = [self.camera_doubt], self.model.depth_unit
        if unit > self.model.spacing > 0.0:
            told.append(
                f"depth comes in steps of {1e3 * unit:.3g} mm, coarser than its noise and than the model's "
                "points are apart: poses and surfaces may be off by as much"
            )
        return [sentence for sentence in told if sentence]

    @property
    def camera_doubt(self) -> str:
        """What the frames say is wrong with the camera as it was given; empty where nothing is."""
        calibration = self.depth_calibration
        return "" if calibration is None else calibration.camera_advice(self.model.camera)

    @property
    def doubled_surfaces(self) -> DoubledSurfaces | None:
        """How much of the model is there twice, as frames that disagree leave it; None without points."""
        model = self.model
        if not len(model):
            return None
        num_frames = len(model.frames)
        if self._doubled is None or self._doubled[0] != num_frames:
            found = find_doubled_surfaces(
                model.points,
                model.normals,
                spacing=model.spacing,
                max_slant=model.parameters.depth.max_slant,
            )
            self._doubled = num_frames, found
        return self._doubled[1]

    @property
    def counts(self) -> dict[str, int]:
        """How many frames have each status."""
        return count_statuses(self.frames)

    @property
    def loops(self) -> list[FrameRecord]:
        """The frames that closed a loop."""
        return [
            frame for frame in self.frames if frame.report is not None and frame.report.loop_frame is not None
        ]

    @property
    def num_tracked(self) -> int:
        """How many frames have a pose, WEAK ones, which are not fused, among them."""
        return sum(frame.world_from_camera is not None for frame in self.frames)

    @property
    def poses(self) -> npt.NDArray[np.float64]:
        """(F, 4, 4) ``world_from_camera``; NaN where it is not known."""
        return stacked_poses(frame.world_from_camera for frame in self.frames)

    @property
    def truths(self) -> npt.NDArray[np.float64] | None:
        """(F, 4, 4) true poses, NaN where they are not known; None where none is."""
        if all(frame.truth is None for frame in self.frames):
            return None
        return stacked_poses(frame.truth for frame in self.frames)

    @property
    def trajectory(self) -> Trajectory:
        """The poses of the tracked frames, timed by the frames' indices where there are no time stamps."""
        tracked = [frame for frame in self.frames if frame.world_from_camera is not None]
        timed = bool(tracked) and all(frame.timestamp is not None for frame in tracked)
        times = [frame.timestamp if timed else frame.index for frame in tracked]
        return Trajectory(
            np.array(times, np.float64), stacked_poses(frame.world_from_camera for frame in tracked)
        )

    @property
    def milliseconds(self) -> npt.NDArray[np.float64]:
        """The model's time for each frame that it got."""
        return np.array([f.report.milliseconds["total"] for f in self.frames if f.report is not None])

    def evaluate_trajectory(self) -> None:
        """Add the errors of the trajectory to ``evaluation``, where the recording knows the truth."""
        truths = self.truths
        if truths is None:
            return
        poses = self.poses
        self.evaluation["absolute_trajectory_error"] = absolute_trajectory_error(poses, truths)
        self.evaluation["relative_pose_error"] = relative_pose_error(poses, truths)

    @cached_property
    def parameters(self) -> dict[str, Any]:
        """The model's parameters as nested mappings."""
        return dataclasses.asdict(self.model.parameters)

    @property
    def cloud(self) -> Cloud:
        """The points that reports and files show: :meth:`nacre.Model.cloud`."""
        state = (len(self.model.frames), self.all_points)
        if self._cloud is None or self._cloud[0] != state:
            self._cloud = state, self.model.cloud(all_points=self.all_points)
        return self._cloud[1]
