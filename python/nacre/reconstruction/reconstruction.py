"""A recording run through a model, with all that its reports need."""

from __future__ import annotations

import collections.abc
import dataclasses
import itertools
import logging
import os
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping
from contextlib import closing, nullcontext
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from nacre._internal.arrays import as_count, as_flag
from nacre._internal.checkpoint import Checkpointed
from nacre._internal.guided import guided
from nacre._internal.rotations import rotation_angles
from nacre.datasets.read_ahead import read_ahead
from nacre.datasets.sequence import SequenceFrame
from nacre.errors import FileFormatError
from nacre.frame_report import FrameReport
from nacre.model import Model
from nacre.progress import as_progress
from nacre.reconstruction.known_motions import Motions
from nacre.reconstruction.run_figures import run_dict, run_report
from nacre.reconstruction.run_record import Pose, RunRecord
from nacre.reconstruction.saved_state import record_from, record_state
from nacre.reconstruction.steps import FrameDone, StageBegun, Step
from nacre.report.data import ReportData
from nacre.report.limits import MIN_TRACKED
from nacre.run_data.frame_record import FrameRecord

_log = logging.getLogger("nacre.reconstruction")

# How much each status knows of the camera's pose.
_RANK = {"LOST": 0, "WEAK": 1, "RELOCALISED": 2, "TRACKED": 2}


@dataclass
class _Retry:
    """How far lost frames were gone over again."""

    are_apart: bool  # views: where the camera was does not tell where it is
    step: int = 0  # of twice as many as there are frames
    found_any: bool = False  # since the first of them


class Reconstruction(RunRecord, Checkpointed):
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
        super().__init__(sequence, model)
        self._retry: _Retry | None = None

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
        motions: Motions | None = None,
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
        motions : Motions, optional
            How the camera went on, where it is known: that spares the registration.

        Returns
        -------
        Reconstruction
            This one.
        """
        goes_on = None if progress is None else as_progress("progress", progress)
        rest = range(len(self.sequence)) if indices is None else iter(indices)
        with closing(self.steps(rest, retry=retry, motions=motions)) as steps:
            for step in steps:
                if isinstance(step, FrameDone) and goes_on is not None and not goes_on(step.frame):
                    self.cancelled = True
                    _log.info("cancelled after %d frames", len(self.frames))
                    break
        self.evaluate_trajectory()
        return self

    def steps(
        self, indices: Iterable[int], *, retry: bool = True, motions: Motions | None = None
    ) -> Generator[Step, None, None]:
        """
        Do one thing after the other, and yield each when it is done; a stage, when it begins.

        Parameters
        ----------
        indices : iterable of int
            The frames to run. Of a sequence, those that are done are left out; others are run as they come.
        retry : bool
            Whether lost frames are tried again at the end.
        motions : Motions, optional
            What others have found of the camera's way.

        Yields
        ------
        StageBegun or FrameDone
        """
        with nullcontext() if motions is None else motions.at_work():
            if isinstance(indices, collections.abc.Sequence):
                done = {frame.index for frame in self.frames}
                indices = [index for index in indices if index not in done]
            count = len(indices) if isinstance(indices, list) else None
            if count != 0:
                yield StageBegun("frames", count)
                yield from map(FrameDone, self.run(indices, motions=motions))
        if retry:
            yield StageBegun("lost frames", self.counts["LOST"] or None)
            yield from map(FrameDone, self.retry_lost())
        for sentence in self.advice:
            _log.warning("%s", sentence)

    def run(
        self, indices: Iterable[int] | None = None, *, motions: Motions | None = None
    ) -> Iterator[FrameRecord]:
        """
        Add frames to the model, and yield each when it is done.

        Parameters
        ----------
        indices : iterable of int, optional
            Of the frames; by default all that were not added yet.
        motions : Motions, optional
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
        newest_fused = max((frame.fused_index for frame in self.frames), default=-1)
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
                newest_fused = max(newest_fused, record.fused_index)
                if is_better or record.status == "LOST":
                    self.frames[place] = record
                state.step += 1
                yield self.frames[place]
            if not state.found_any:
                break
            self._retry = state = _Retry(state.are_apart)
        self._retry = None

    def _predicted(self, place: int, side: int) -> Pose | None:
        """Return where the camera was if it moved on from the frame on one side as it had; or that pose."""
        near, far = self._pose_at(place + side), self._pose_at(place + 2 * side)
        return near if near is None or far is None else near @ np.linalg.inv(far) @ near

    def _views_are_far_apart(self) -> bool:
        """Say whether the camera ever turned farther from frame to frame than a registration reaches."""
        poses = [self._pose_at(place) for place in range(len(self.frames))]
        known = [(a, b) for a, b in itertools.pairwise(poses) if a is not None and b is not None]
        turns = rotation_angles(np.array([a[:3, :3].T @ b[:3, :3] for a, b in known]).reshape(-1, 3, 3))
        return not len(turns) or float(turns.max()) > self.model.parameters.registration.max_angle

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
        guess: Pose | None = None,
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
            record if record.report is None else record.renewed(reports[record.report.index])
            for record in self.frames
        ]

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
