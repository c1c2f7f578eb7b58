"""A recording run through a model, with all that its reports need."""

from __future__ import annotations

import collections.abc
import dataclasses
import itertools
import logging
import math
import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from nacre._internal.arrays import as_count, as_flag, stacked_poses
from nacre._internal.checkpoint import Checkpointed
from nacre._internal.guided import guided
from nacre._internal.kinds import as_kind
from nacre.datasets.read_ahead import read_ahead
from nacre.datasets.sequence import SequenceFrame
from nacre.depth_calibration import DepthCalibration
from nacre.errors import FileFormatError
from nacre.evaluation import absolute_trajectory_error, relative_pose_error
from nacre.evaluation.result import Result
from nacre.frame_report import FrameReport, count_statuses
from nacre.io.cloud import Cloud
from nacre.model import Model
from nacre.reconstruction.frame_record import FrameRecord
from nacre.reconstruction.saved_state import record_from, record_state
from nacre.report.doubled_surfaces import DoubledSurfaces, find_doubled_surfaces
from nacre.report.limits import MIN_TRACKED
from nacre.report.run_figures import run_dict, run_report
from nacre.trajectory import Trajectory

if TYPE_CHECKING:
    from nacre.reconstruction.pieces.motions import PieceMotions
    from nacre.report import ReportData

_log = logging.getLogger("nacre.reconstruction")

_RANK = {"LOST": 0, "WEAK": 1, "RELOCALISED": 2, "TRACKED": 2}


def _renewed(record: FrameRecord, report: FrameReport) -> FrameRecord:
    return dataclasses.replace(record, status=report.status, reason=report.reason, report=report)


def _turn_between(a: npt.NDArray[np.float64], b: npt.NDArray[np.float64]) -> float:
    """Return the angle between the directions of two poses [rad]."""
    trace = float(np.sum(a[:3, :3] * b[:3, :3]))
    return math.acos(min(1.0, max(-1.0, 0.5 * (trace - 1.0))))


def _fused_index(record: FrameRecord) -> int:
    """Return which of the model's frames it is; -1 where it did not change the model."""
    if record.report is None or _RANK[record.status] < _RANK["TRACKED"]:
        return -1
    return record.report.index


@dataclass
class _Retry:
    """How far lost frames were gone over again."""

    are_apart: bool  # views: where the camera was does not tell where it is
    step: int = 0  # of twice as many as there are frames
    found_any: bool = False  # since the first of them


class Reconstruction(Checkpointed):
    """
    A recording run through a model.

    Parameters
    ----------
    sequence : sequence of SequenceFrame
        The recording. A frame that cannot be read is LOST, with the reason, and the run goes on.
    model : Model
        Grows with every frame.

    Attributes
    ----------
    sequence, model
        As given.
    frames : list of FrameRecord
        Those that are done.
    evaluation : dict of str to a result of ``nacre.evaluation``
        What is known beyond the trajectory's errors, by name; may be added to.
    cancelled : bool
        Whether a progress callback ended :meth:`complete` before its last frame.
    all_points : bool
        Whether :attr:`cloud` has those, too, that are no surface.
    """

    def __init__(self, sequence: collections.abc.Sequence[SequenceFrame], model: Model) -> None:
        self.sequence = as_kind("sequence", sequence, collections.abc.Sequence, "a nacre.Sequence")
        self.model = as_kind("model", model, Model, "a nacre.Model")
        self.frames: list[FrameRecord] = []
        self.evaluation: dict[str, Result] = {}
        self.cancelled = False
        self.all_points = False
        self.num_dropped = 0  # of frames that came faster than they could be registered
        self._retry: _Retry | None = None
        self._cloud: tuple[tuple[int, bool], Cloud] | None = None  # of so many frames
        self._doubled: tuple[int, DoubledSurfaces] | None = None  # after so many of the model's frames

    def __repr__(self) -> str:
        ended = ", cancelled" * self.cancelled
        statuses = ", ".join(f"{number} {name}" for name, number in self.counts.items() if number)
        return (
            f"Reconstruction({len(self.frames)} of {len(self.sequence)} frames done"
            f"{f' ({statuses})' * bool(statuses)}, {len(self.model)} points{ended})"
        )

    def complete(
        self,
        indices: Iterable[int] | None = None,
        *,
        progress: Callable[[FrameRecord], bool | None] | None = None,
        retry: bool = True,
    ) -> Reconstruction:
        """
        Run frames to the end, go over the lost ones again, and evaluate the trajectory where truth is known.

        Parameters
        ----------
        indices : iterable of int, optional
            Of the recording's frames; by default all that are not done yet.
        progress : callable, optional
            Called with each :class:`FrameRecord` when it is done. To return False, or to raise
            :class:`nacre.Cancelled`, ends the run; what is done is kept, and ``cancelled`` says so. Other
            exceptions, Ctrl-C too, come out of this call, and what is done is kept all the same.
        retry : bool
            Whether lost frames are tried again at the end.

        Returns
        -------
        Reconstruction
            This one.
        """
        from nacre.reconstruction.runner import Run

        rest = range(len(self.sequence)) if indices is None else iter(indices)
        return Run(self, rest, retry=retry).to_end(progress)

    def run(
        self, indices: Iterable[int] | None = None, *, motions: PieceMotions | None = None
    ) -> Iterator[FrameRecord]:
        """
        Add frames to the model, and yield each when it is done.

        Parameters
        ----------
        indices : iterable of int, optional
            Of the frames; by default all that were not added yet.
        motions : PieceMotions, optional
            How the camera went on, where it is known: that spares the registration.

        Yields
        ------
        FrameRecord
        """
        if indices is None:
            done = {frame.index for frame in self.frames}
            indices = [index for index in range(len(self.sequence)) if index not in done]
        for index, read in read_ahead(self.sequence, indices):
            place = None if motions is None else motions.place(index, self._newest_poses(motions.reach))
            if place is None:
                record = self._add(index, read)
            else:
                record = self._add(index, read, place.world_from_camera, keep_guess=not place.is_first)
            self.frames.append(record)
            yield record

    def retry_lost(self) -> Iterator[FrameRecord]:
        """
        Go over the lost frames again, while any of them is found, and yield each that was tried.

        Those, that is, since which the model has grown: to look at the same model twice tells nothing new.
        Where the camera moved on from frame to frame, they are looked for near the frame after, then near the
        one before, where that is known; where views are far apart, everywhere. A frame that is found now is
        RELOCALISED, and takes the place of its lost record in ``frames``; so do WEAK ones of which the model
        now knows enough. Frames that could not be read, that the model refused, or that the recording has no
        more, stay as they are.
        """
        if self._retry is None:
            if not self.counts["LOST"]:
                return
            self._retry = _Retry(self._views_are_far_apart())
        state, count = self._retry, len(self.frames)
        newest_fused = max(map(_fused_index, self.frames), default=-1)
        while True:
            while state.step < 2 * count:  # from the last to the first, then back
                is_back = state.step >= count
                place = state.step - count if is_back else count - 1 - state.step
                before = self.frames[place]
                beside = self._predicted(place, -1 if is_back else 1)
                is_there = before.index < len(self.sequence)  # a killed process may not have kept the newest
                is_open = before.status in ("LOST", "WEAK") and is_there
                is_due = is_back if state.are_apart else beside is not None
                if before.report is None or not (is_open and is_due) or before.report.index > newest_fused:
                    state.step += 1
                    continue
                guess = before.world_from_camera if state.are_apart else beside
                read = partial(self.sequence.__getitem__, before.index)
                record = self._add(before.index, read, guess, search=state.are_apart)
                if record.status == "TRACKED":
                    record = dataclasses.replace(record, status="RELOCALISED")
                is_better = _RANK[record.status] > _RANK[before.status]
                state.found_any |= is_better
                newest_fused = max(newest_fused, _fused_index(record))
                if is_better or record.status == "LOST":
                    self.frames[place] = record
                state.step += 1
                yield self.frames[place]
            if not state.found_any:
                break
            self._retry = state = _Retry(state.are_apart)
        self._retry = None

    def _newest_poses(self, count: int) -> dict[int, npt.NDArray[np.float64]]:
        """Return the poses of those of the newest frames that are part of the model, by their indices."""
        places = range(max(0, len(self.frames) - count), len(self.frames))
        poses = {self.frames[place].index: self._pose_at(place) for place in places}
        return {index: pose for index, pose in poses.items() if pose is not None}

    @property
    def fused_poses(self) -> dict[int, npt.NDArray[np.float64]]:
        """(4, 4) ``world_from_camera`` of the frames that are part of the model, by their indices."""
        return self._newest_poses(len(self.frames))

    def _pose_at(self, place: int) -> npt.NDArray[np.float64] | None:
        """Return the pose of a frame that is part of the model."""
        if not 0 <= place < len(self.frames) or _fused_index(self.frames[place]) < 0:
            return None
        return self.frames[place].world_from_camera

    def _predicted(self, place: int, side: int) -> npt.NDArray[np.float64] | None:
        """Return where the camera was if it moved on from the frame on one side as it had; or that pose."""
        near, far = self._pose_at(place + side), self._pose_at(place + 2 * side)
        return near if near is None or far is None else near @ np.linalg.inv(far) @ near

    def _views_are_far_apart(self) -> bool:
        """Say whether the camera ever turned farther from frame to frame than a registration reaches."""
        poses = [self._pose_at(place) for place in range(len(self.frames))]
        turns = [_turn_between(a, b) for a, b in itertools.pairwise(poses) if a is not None and b is not None]
        return not turns or max(turns) > self.model.parameters.registration.max_angle

    def _checkpoint(self, **more: Any) -> bytes:
        retry = None if self._retry is None else dataclasses.asdict(self._retry)
        run = {
            "records": [record_state(record) for record in self.frames],
            "retry": retry,
        }
        return self.model._checkpoint(run=run, **more)

    @classmethod
    @guided()
    def load(
        cls,
        path: str | os.PathLike[str],
        sequence: collections.abc.Sequence[SequenceFrame],
        *,
        points_folder: str | os.PathLike[str] | None = None,
    ) -> Reconstruction:
        """
        Read a run that :meth:`save` wrote; :meth:`complete` then goes on to the same bits.

        Parameters
        ----------
        path : path-like
            The file.
        sequence : sequence of SequenceFrame
            The same recording.
        points_folder : path-like, optional
            As in :meth:`nacre.Model.load`.

        Returns
        -------
        Reconstruction

        Raises
        ------
        FileFormatError
            It is no saved run, or it is damaged; with the place.
        OSError
            It cannot be read.
        """
        return cls._load(path, sequence, points_folder)[0]

    @classmethod
    def _load(
        cls,
        path: str | os.PathLike[str],
        sequence: collections.abc.Sequence[SequenceFrame],
        points_folder: str | os.PathLike[str] | None,
    ) -> tuple[Reconstruction, dict[str, Any]]:
        model, more = Model._loaded(path, points_folder)
        done = cls(sequence, model)
        reports = model.frames
        try:
            run = more.pop("run")
            done.frames = [record_from(state, reports) for state in run["records"]]
            if run["retry"] is not None:
                done._retry = _Retry(
                    as_flag("are_apart", run["retry"]["are_apart"]),
                    as_count("step", run["retry"]["step"]),
                    as_flag("found_any", run["retry"]["found_any"]),
                )
        except (KeyError, TypeError, ValueError, IndexError, AttributeError) as error:
            raise FileFormatError(path, f"it holds a model, but no run that can go on ({error})") from None
        return done, more

    def _add(
        self,
        index: int,
        read: Callable[[], SequenceFrame],
        guess: npt.NDArray[np.float64] | None = None,
        *,
        search: bool = True,
        keep_guess: bool = False,
    ) -> FrameRecord:
        try:
            frame = read()
        except (FileFormatError, OSError) as error:
            _log.info("frame %d: skipped, it cannot be read: %s", index, error)
            return FrameRecord(index, None, "LOST", str(error), None, None, error)
        try:
            report = self.model.add_frame(
                frame.depth,
                color=frame.color,
                mask=frame.mask,
                confidence=frame.confidence,
                timestamp=frame.timestamp,
                guess=guess,
                keep_guess=keep_guess,
                movable=keep_guess,
                search=search,
                attributes=frame.attributes,
            )
        except ValueError as error:
            _log.info("frame %d: skipped, the model refused it: %s", index, error)
            return FrameRecord(index, frame.timestamp, "LOST", str(error), None, frame.truth, error)
        self._tell(index, report)
        if report.corrects_earlier:
            self._take_corrected_poses()
        return FrameRecord(index, frame.timestamp, report.status, report.reason, report, frame.truth)

    def _tell(self, index: int, report: FrameReport) -> None:
        if report.status != "TRACKED":
            _log.info("frame %d: %s%s", index, report.status, f": {report.reason}" * bool(report.reason))
        _log.debug(
            "frame %d: %s, overlap %.2f, %d points, %.1f ms",
            index, report.status, report.overlap, report.num_points, report.milliseconds["total"],
        )  # fmt: skip
        if report.loop_frame is not None:
            _log.info("frame %d: closed a loop, %.4f m wide", index, report.loop_distance)

    def _take_corrected_poses(self) -> None:
        reports = self.model.frames
        self.frames[:] = [
            record if record.report is None else _renewed(record, reports[record.report.index])
            for record in self.frames
        ]

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

    def as_dict(self, *, min_tracked: float = MIN_TRACKED, **more: Any) -> dict[str, Any]:
        """
        Return every figure as plain values that JSON can hold (NaN and inf become None).

        Parameters
        ----------
        min_tracked : float
            Part of the frames; with less the verdict is that the run failed.
        **more
            Further entries.

        Returns
        -------
        dict
        """
        return run_dict(self, min_tracked=min_tracked, **more)

    def report_data(
        self,
        title: str,
        source: str,
        figures: Mapping[str, Any] | None = None,
        *,
        interrupted: bool = False,
        min_tracked: float = MIN_TRACKED,
    ) -> ReportData:
        """
        Return what :func:`nacre.report.write_report` shows; it reads some frames again.

        Parameters
        ----------
        title, source : str
            Of the page, and in words where the frames come from.
        figures : mapping, optional
            More numbers for the page, by name.
        interrupted : bool
            Whether the run ended before the recording did.
        min_tracked : float
            Part of the frames; with less the verdict is that the run failed.

        Returns
        -------
        ReportData
        """
        return run_report(
            self,
            title,
            source,
            figures,
            interrupted=interrupted,
            min_tracked=min_tracked,
            with_depth=True,
        )
