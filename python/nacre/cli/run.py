"""The work of ``nacre reconstruct``: a run, results; saved where it is stopped."""

from __future__ import annotations

import webbrowser
from collections.abc import Callable
from contextlib import suppress
from typing import TYPE_CHECKING

import typer

from nacre._internal.signals import Interruption, Stopped
from nacre.cli.follow import Bars
from nacre.cli.outputs import file_rows, require_tracked, trajectory_rows, verdict_rows
from nacre.cli.source import in_option_words
from nacre.cli.terminal import CommandError, Terminal, table
from nacre.cli.window import Window

if TYPE_CHECKING:
    from nacre.reconstruction.job import Job
    from nacre.reconstruction.reconstruction import Reconstruction
    from nacre.reconstruction.steps import Step
    from nacre.viewer import LiveView


def carry_out(terminal: Terminal, job: Job, stop: Interruption, window: Window | None) -> None:
    """Bring a run to its end, or to where it is stopped; in a window, if there is one."""
    from nacre.io.json_files import to_json
    from nacre.reconstruction.carry_out import carry_out as carry_out_job
    from nacre.reconstruction.results import depth_rows

    terminal.say(f"{job.sequence.name}: {job.words}")
    if job.run.done.frames:
        terminal.say(f"going on after {len(job.run.done.frames)} frames")
    live = None if window is None else _show(terminal, job, window)
    out = job.unfinished.out
    try:
        with in_option_words(), Bars(terminal, job.run) as bars:
            listeners = [bars.show] if live is None else [_added_to(live), bars.show]
            report = carry_out_job(job, stop, listeners)
    except (OSError, MemoryError) as error:
        what = "files can be written again" if isinstance(error, OSError) else "there is more memory"
        what = "workers are there" if isinstance(error, ConnectionError) else what
        terminal.say(f"nacre reconstruct --resume {out} goes on where {what}")
        raise
    if terminal.json:
        print(to_json(report))
    if stop.wanted:
        total = "" if job.num_frames is None else f" of {job.num_frames}"
        terminal.say(
            f"interrupted after {len(job.run.done.frames)}{total} frames; what there is was written, but "
            f"report.html\nnacre reconstruct --resume {out} goes on"
        )
        raise typer.Exit(stop.exit_code)
    rows = depth_rows(job.run.done) + ([] if job.feed is None else job.feed.rows)
    files = file_rows(out, page=job.options.report)
    terminal.say(table([*verdict_rows(report), *trajectory_rows(job.run.done), *rows, *files]))
    if live is not None and window is not None:
        live.finish(_ending(job))
        if window.stays:
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
    if window.opens and not webbrowser.open(live.viewer.url):
        terminal.say("no window: the browser opened none; recording begins, Ctrl-C stops it")
        window.controls.press("start")
        window.stays = False
    elif window.controls.state == "ready":
        terminal.say("recording begins with the button Start there")
    return live


def _ending(job: Job) -> str:
    """Say in the window how it ended."""
    error = job.feed and job.feed.error
    return (
        f"{error}; what there is was written to {job.unfinished.out}"
        if error
        else (f"The results are in {job.unfinished.out}")
    )


def _added_to(live: LiveView) -> Callable[[Step], None]:
    """Return what shows each frame that is done."""
    from nacre.reconstruction.steps import FrameDone

    def add(step: Step) -> None:
        if isinstance(step, FrameDone):
            live.add(step.frame)

    return add


def _complain(job: Job) -> None:
    """Raise what went wrong with a run whose results are written all the same."""
    done: Reconstruction = job.run.done
    if job.feed is not None and job.feed.error is not None:
        raise CommandError(f"{job.feed.error}; what there is was written")
    advice = f"; nacre info {job.options.source} looks at its depth"
    require_tracked(done, job.options.min_tracked, advice)
