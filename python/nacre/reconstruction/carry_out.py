"""The work of a run: its frames, its results, and what is kept where it is stopped."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Callable, Sequence
from contextlib import closing, suppress
from typing import Any

from nacre._internal.signals import Interruption, Stopped
from nacre.errors import CannotResumeError, RunError
from nacre.reconstruction.description import describe_recording
from nacre.reconstruction.job import Job
from nacre.reconstruction.journal import ChangedRunError
from nacre.reconstruction.reconstruction import Reconstruction
from nacre.reconstruction.results import depth_rows, write_results
from nacre.reconstruction.runner import Run
from nacre.reconstruction.steps import FrameDone, Step

Listener = Callable[[Step], None]


def follow(run: Run, stop: Interruption, listeners: Sequence[Listener] = ()) -> None:
    """Carry out a run until it ends or is stopped; listeners are told of every step, in their order."""
    with closing(run.steps()) as steps:
        for step in steps:
            _refuse_a_wrong_recording(run.done, step)
            for listener in listeners:
                listener(step)
            if stop.wanted:
                break


def carry_out(
    job: Job, stop: Interruption | None = None, listeners: Sequence[Listener] = ()
) -> dict[str, Any]:
    """
    Bring a run to its end, or to where it is stopped, and write its results.

    Parameters
    ----------
    job : Job
        The run. Its folder ``OUT/unfinished`` goes when it is finished, and when nothing came of it.
    stop : Interruption, optional
        May stop it between two frames; the results are then of what there is, without the page, and what it
        goes on from is saved.
    listeners : sequence of callable
        Told of every step.

    Returns
    -------
    dict
        What ``report.json`` says.

    Raises
    ------
    RunError
        The recording is not usable at all, or comes out otherwise than before it was interrupted.
    OSError, MemoryError
        ``OUT/unfinished`` is there to go on from.
    """
    stop = Interruption() if stop is None else stop
    report: dict[str, Any] = {}
    try:
        try:
            _run(job, stop, listeners)
        except ChangedRunError as error:
            raise CannotResumeError(str(error)) from error
        if job.feed is not None and not (job.run.done.frames or stop.wanted):
            raise RunError(f"{job.feed.error or 'stopped before the first frame'}: nothing was recorded")
        if not stop.wanted:
            with suppress(Stopped), stop.at_once():
                report = _write(job, stop)
        if stop.wanted:
            job.unfinished.save()
            return _write(job, stop)
    except RunError:
        if all(frame.report is None for frame in job.run.done.frames):
            job.unfinished.remove()
        raise
    job.run.done.model.recall_points()  # their folder goes
    job.unfinished.remove()
    return report


def _run(job: Job, stop: Interruption, listeners: Sequence[Listener]) -> None:
    """Run the frames that are not done yet, and lost ones again."""

    def note(step: Step) -> None:
        if isinstance(step, FrameDone):
            job.unfinished.add(step.frame)

    feed = job.feed
    if feed is None:
        follow(job.run, stop, [note, *listeners])
        return

    def tend(step: Step) -> None:
        feed.tend(step)
        job.unfinished.live = feed.figures

    try:
        follow(job.run, stop, [tend, note, *listeners])
    finally:
        feed.close()
    job.unfinished.live = feed.figures


def _write(job: Job, stop: Interruption) -> dict[str, Any]:
    """Write the results; of a run that is stopped without the page, whose pictures take long."""
    done = job.run.done
    done.all_points = job.options.all_points
    done.num_dropped = int((job.unfinished.live or {}).get("num_dropped") or 0)
    done.evaluate_trajectory()
    feed, calibration = job.feed, done.depth_calibration
    advice = done.advice
    figures = dict(depth_rows(done))
    if advice:
        figures["camera"] = "; ".join(advice)
    return write_results(
        job.unfinished.out,
        done,
        title=job.sequence.name,
        source=job.words if feed is None else f"{job.words}; {feed.summary}",
        document={
            "recording": describe_recording(job.sequence),
            "preset": job.options.preset,
            "options": dataclasses.asdict(job.options),
            "advice": advice,
            "interrupted": stop.wanted,
            "depth_calibration": calibration
            and dataclasses.asdict(calibration) | {"used": done.model.corrects_depth},
            "live": job.unfinished.live,
        },
        figures=figures if feed is None else {**figures, **dict(feed.rows)},
        page=job.options.report and not stop.wanted,
        min_tracked=job.options.min_tracked,
    )


def _refuse_a_wrong_recording(done: Reconstruction, step: Step) -> None:
    """End the run where the model cannot use even the first frames: wrong size or wrong depth scale."""
    if isinstance(step, FrameDone) and step.frame.refused and all(f.report is None for f in done.frames):
        reason = _with_scales_that_fit(step.frame.reason, done.sequence)
        raise RunError(f"frame {step.frame.index}: {reason}")


def _with_scales_that_fit(reason: str, recording: object) -> str:
    """Return why the model refused a frame, with depth scales that would make sense of it."""
    found = re.search(r"got a median of ([\d.e+-]+) m", reason)
    scale = getattr(recording, "depth_scale", None)
    if found is None or scale is None:
        return reason
    stored = float(found[1]) * scale
    fitting = [f"{s:g} ({stored / s:.2g} m)" for s in (1, 1000, 5000, 10000, 1e6) if 0.2 < stored / s < 10]
    tried = f"; it was read with {scale:g}"
    return reason + tried + (f", and would make sense with {' or '.join(fitting)}" if fitting else "")
