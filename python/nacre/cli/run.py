"""The work of ``nacre reconstruct``: a run, results; saved where it is stopped."""

from __future__ import annotations

import dataclasses
import webbrowser
from contextlib import suppress
from typing import TYPE_CHECKING, Any

import typer

from nacre.cli.follow import follow
from nacre.cli.job import Job
from nacre.cli.outputs import (
    depth_rows,
    describe_recording,
    file_rows,
    require_tracked,
    trajectory_rows,
    verdict_rows,
    write_results,
)
from nacre.cli.signals import Interruption, Stopped
from nacre.cli.terminal import CommandError, Terminal, table, to_json
from nacre.cli.window import Window

if TYPE_CHECKING:
    from nacre.reconstruction.reconstruction import Reconstruction
    from nacre.reconstruction.runner import Step
    from nacre.viewer import LiveView


def carry_out(terminal: Terminal, job: Job, stop: Interruption, window: Window | None) -> None:
    """Bring a run to its end, or to where it is stopped; in a window, if there is one."""
    from nacre.reconstruction.journal import ChangedRunError

    terminal.say(f"{job.sequence.name}: {job.words}")
    if job.run.done.frames:
        terminal.say(f"going on after {len(job.run.done.frames)} frames")
    live = None if window is None else _show(terminal, job, window)
    try:
        try:
            _run(terminal, job, stop, live)
        except ChangedRunError as error:
            raise CommandError(f"{error}; run it again without --resume") from error
        if job.feed is not None and not (job.run.done.frames or stop.wanted):
            raise CommandError(f"{job.feed.error or 'stopped before the first frame'}: nothing was recorded")
        if not stop.wanted:
            with suppress(Stopped), stop.at_once():
                report = _write(job, stop)
        if stop.wanted:
            _save(terminal, job, stop)
            raise typer.Exit(stop.exit_code)
    except CommandError:
        if all(frame.report is None for frame in job.run.done.frames):
            job.unfinished.remove()
        raise
    except (OSError, MemoryError) as error:
        what = "files can be written again" if isinstance(error, OSError) else "there is more memory"
        terminal.say(f"nacre reconstruct --resume {job.unfinished.out} goes on where {what}")
        raise
    job.unfinished.remove()
    if terminal.json:
        print(to_json(report))
    rows = depth_rows(job.run.done) + ([] if job.feed is None else job.feed.rows)
    files = file_rows(job.unfinished.out, page=job.options.report)
    terminal.say(table([*verdict_rows(report), *trajectory_rows(job.run.done), *rows, *files]))
    if live is not None:
        live.finish(_ending(job))
        terminal.say(f"the model stays at {live.viewer.url}; Ctrl-C ends it")
        with suppress(Stopped), stop.at_once():
            live.viewer.wait()
        live.viewer.close()
    _complain(job)


def _show(terminal: Terminal, job: Job, window: Window) -> LiveView:
    from nacre.viewer import LiveView

    live = LiveView(job.run.done, job.sequence.name, port=window.port, controls=job.controls)
    for frame in job.run.done.frames:
        live.add(frame)
    terminal.say(f"the model is at {live.viewer.url}")
    if window.opens:
        webbrowser.open(live.viewer.url)
    return live


def _ending(job: Job) -> str:
    """Say in the window how it ended."""
    error = job.feed and job.feed.error
    return (
        f"{error}; what there is was written to {job.unfinished.out}"
        if error
        else (f"The results are in {job.unfinished.out}")
    )


def _run(terminal: Terminal, job: Job, stop: Interruption, live: LiveView | None) -> None:
    """Run the frames that are not done yet, and lost ones again."""
    from nacre.reconstruction.runner import FrameDone

    def note(step: Step) -> None:
        if isinstance(step, FrameDone):
            job.unfinished.add(step.frame)
            if live is not None:
                live.add(step.frame)

    feed = job.feed
    if feed is None:
        follow(terminal, job.run, stop, [note])
        return

    def tend(step: Step) -> None:
        feed.tend(step)
        job.unfinished.live = feed.figures

    try:
        follow(terminal, job.run, stop, [tend, note])
    finally:
        feed.close()
    job.unfinished.live = feed.figures


def _write(job: Job, stop: Interruption) -> dict[str, Any]:
    """Write the results; of a run that is stopped without the page, whose pictures take long."""
    done = job.run.done
    done.all_points = job.options.all_points
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


def _save(terminal: Terminal, job: Job, stop: Interruption) -> None:
    """Save a run that is stopped, and write what there is."""
    job.unfinished.save()
    report = _write(job, stop)
    if terminal.json:
        print(to_json(report))
    total = "" if job.num_frames is None else f" of {job.num_frames}"
    terminal.say(
        f"interrupted after {len(job.run.done.frames)}{total} frames; what there is was written, but "
        f"report.html\nnacre reconstruct --resume {job.unfinished.out} goes on"
    )


def _complain(job: Job) -> None:
    """Raise what went wrong with a run whose results are written all the same."""
    done: Reconstruction = job.run.done
    if job.feed is not None and job.feed.error is not None:
        raise CommandError(f"{job.feed.error}; what there is was written")
    advice = f"; nacre info {job.options.source} looks at its depth"
    require_tracked(done, job.options.min_tracked, advice)
