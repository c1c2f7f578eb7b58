"""The work of ``nacre reconstruct``: frames, lost frames again, results; saved where it is stopped."""

from __future__ import annotations

import dataclasses
import signal
from collections.abc import Sequence as Collection
from contextlib import closing, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from nacre.cli.calibrating import run_staged, watching
from nacre.cli.live_feed import LiveFeed
from nacre.cli.outputs import file_rows, trajectory_rows, write_results
from nacre.cli.run_options import RunOptions
from nacre.cli.running import retry_lost, run_frames
from nacre.cli.signals import Interruption, Stopped
from nacre.cli.terminal import CommandError, Terminal, table, to_json
from nacre.cli.unfinished import Unfinished

if TYPE_CHECKING:
    from nacre.datasets import Sequence
    from nacre.reconstruction import Reconstruction
    from nacre.reconstruction.frame_record import FrameRecord
    from nacre.viewer import LiveView


@dataclass
class Run:
    """A run that may have been begun before: frames come by their indices, or by themselves (feed)."""

    asked: RunOptions
    out: Path
    done: Reconstruction
    sequence: Sequence
    unfinished: Unfinished
    words: str
    indices: Collection[int] | None
    feed: LiveFeed | None


def carry_out(terminal: Terminal, run: Run, stop: Interruption, port: int | None) -> None:
    """Bring a run to its end, or to where it is stopped; ``port``: show it there."""
    terminal.say(f"{run.sequence.name}: {run.words}")
    if run.done.frames:
        terminal.say(f"going on after {len(run.done.frames)} frames")
    live = None
    if port is not None:
        from nacre.viewer import LiveView

        live = LiveView(run.done, run.sequence.name, port=port)
        for frame in run.done.frames:
            live.add(frame)
        terminal.say(f"the model is at {live.viewer.url}")
    try:
        done = _run_all(terminal, run, stop, live)
        if not stop.wanted:
            with suppress(Stopped), stop.at_once():
                report = _write(run, done, stop)
        if stop.wanted:
            _save(terminal, run, done, stop)
            raise typer.Exit(stop.exit_code)
    except CommandError:
        if all(frame.report is None for frame in run.done.frames):
            run.unfinished.remove()
        raise
    except (OSError, MemoryError) as error:
        what = "files can be written again" if isinstance(error, OSError) else "there is more memory"
        terminal.say(f"nacre reconstruct --resume {run.out} goes on where {what}")
        raise
    run.unfinished.remove()
    if terminal.json:
        print(to_json(report))
    rows = [] if run.feed is None else run.feed.rows
    terminal.say(table([*trajectory_rows(done), *rows, *file_rows(run.out)]))
    if live is not None:
        live.finish()
        terminal.say(f"the model stays at {live.viewer.url}; Ctrl-C ends it")
        with suppress(Stopped), stop.at_once():
            live.viewer.wait()
        live.viewer.close()
    if run.feed is not None and run.feed.error is not None:
        raise CommandError(f"{run.feed.error}; what there is was written")
    if done.num_tracked == 0:
        reasons = list(dict.fromkeys(frame.reason for frame in done.frames))
        others = " (and other reasons)" * (len(reasons) > 1)
        raise CommandError(
            f"every frame was lost: {reasons[0]}{others}; nacre info {run.asked.source} looks at its depth"
        )


def _run_all(terminal: Terminal, run: Run, stop: Interruption, live: LiveView | None) -> Reconstruction:
    """Run the frames that are not done yet; return the reconstruction, which may be another one by then."""
    done = run.done
    if run.feed is not None:
        with closing(run.feed):
            _run_feed(terminal, run, run.feed, stop, live)
        if run.feed.is_camera and stop.number == signal.SIGINT:
            stop.number = 0  # who stops a camera is content with what it saw
    elif run.indices is not None:
        done = run_staged(terminal, done, run.indices, run.unfinished, stop, live)
    if run.asked.retry and not stop.wanted:
        retry_lost(terminal, done, stop, watching(done, run.unfinished, None))
    return done


def _run_feed(
    terminal: Terminal, run: Run, feed: LiveFeed, stop: Interruption, live: LiveView | None
) -> None:
    """Run the frames that come by themselves."""
    from nacre.datasets.recorder import GrowingRecording

    tell = watching(run.done, run.unfinished, live)

    def watch(frame: FrameRecord) -> None:
        run.unfinished.stage.live = feed.figures
        if isinstance(run.sequence, GrowingRecording):
            run.sequence.settle()  # what the journal names can be read again
        tell(frame)

    run_frames(terminal, run.done, feed, stop, watch=watch)
    run.unfinished.stage.live = feed.figures


def _write(run: Run, done: Reconstruction, stop: Interruption) -> dict[str, Any]:
    """Write the results; of a run that is stopped without the page, whose pictures take long."""
    done.evaluate_trajectory()
    feed, stage = run.feed, run.unfinished.stage
    calibration = done.depth_calibration
    return write_results(
        run.out,
        done,
        title=run.sequence.name,
        source=run.words if feed is None else f"{run.words}; {feed.summary}",
        document={
            "recording": recording(run.sequence),
            "preset": run.asked.preset,
            "interrupted": stop.wanted,
            "depth_calibration": calibration
            and dataclasses.asdict(calibration) | {"used": calibration.is_significant},
            "live": stage.live,
        },
        figures=None if feed is None else dict(feed.rows),
        page=not stop.wanted,
    )


def _save(terminal: Terminal, run: Run, done: Reconstruction, stop: Interruption) -> None:
    """Save a run that is stopped, and write what there is."""
    run.unfinished.save(done)
    report = _write(run, done, stop)
    if terminal.json:
        print(to_json(report))
    total = f" of {len(run.indices)}" if run.indices is not None else ""
    terminal.say(
        f"interrupted after {len(done.frames)}{total} frames; what there is was written, but report.html\n"
        f"nacre reconstruct --resume {run.out} goes on"
    )


def recording(sequence: Sequence) -> dict[str, Any]:
    """Return what report.json says about the recording."""
    camera = sequence.camera
    names: tuple[str, ...] = ("model", "width", "height", "pixel_size")
    if camera.model != "orthographic":
        names = ("model", "width", "height", "fx", "fy", "cx", "cy", "distortion", "depth")
    return {
        "path": str(sequence.path),
        "name": sequence.name,
        "format": sequence.format,
        "num_frames": len(sequence),
        "camera": {name: getattr(camera, name) for name in names},
        "depth_scale": sequence.depth_scale,
        "color": sequence.has_color,
        "truth": sequence.truth is not None,
    }
