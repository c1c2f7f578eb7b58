"""Running a recording whose depth may be systematically wrong: found out on the way, it is begun again."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from nacre.cli.running import run_frames
from nacre.cli.signals import Interruption, Stopped
from nacre.cli.terminal import Terminal
from nacre.cli.unfinished import Unfinished

if TYPE_CHECKING:
    from nacre.reconstruction import Reconstruction
    from nacre.reconstruction.frame_record import FrameRecord
    from nacre.viewer import LiveView


def run_staged(
    terminal: Terminal,
    done: Reconstruction,
    indices: Sequence[int],
    unfinished: Unfinished,
    stop: Interruption,
    live: LiveView | None = None,
) -> Reconstruction:
    """
    Run the frames of a recording that are not done yet, from the stage where the run is.

    Where they show that its depth is wrong, they are run again with it corrected. ``live`` shows the run that
    is going on. Returns the given run, or the new one.
    """
    from nacre.reconstruction.calibration import DepthViews

    stage = unfinished.stage
    watch = watching(done, unfinished, live)
    if stage.name == "views":
        views = DepthViews(stage.views)
        if not views.are_enough:
            rest = indices[len(done.frames) :]
            run_frames(terminal, done, rest, stop, until=views.add, watch=watch)
        if stop.wanted:
            return done
        try:
            with stop.at_once():
                calibrated = views.calibrate(done)
        except Stopped:
            return done
        calibration = calibrated.depth_calibration
        if calibration is not None and calibrated is not done:
            done = calibrated
            terminal.say(
                f"depth is tilted by {calibration.tilt:.4f} (sigma {calibration.sigma:.4f}) per metre: "
                "beginning again with corrected depth"
            )
            watch = watching(done, unfinished, live)
            if live is not None:
                live.begin_again(done)
        stage.name = "frames"
    rest = indices[len(done.frames) :]
    if rest:
        run_frames(terminal, done, rest, stop, watch=watch)
    return done


def watching(
    done: Reconstruction, unfinished: Unfinished, live: LiveView | None
) -> Callable[[FrameRecord], None]:
    """Return what is to be told of each frame: the files of the unfinished run, and the viewer."""

    def watch(frame: FrameRecord) -> None:
        unfinished.add(done, frame)
        if live is not None:
            live.add(frame)

    return watch
