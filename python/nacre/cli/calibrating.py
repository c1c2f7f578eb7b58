"""Running a recording whose depth may be systematically wrong: found out on the way, it is begun again."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from nacre.cli.running import run_frames
from nacre.cli.stopping import Interruption, Stopped
from nacre.cli.terminal import Terminal
from nacre.cli.unfinished import Stage, Unfinished

if TYPE_CHECKING:
    from nacre import DepthCalibration
    from nacre.datasets import Sequence as Recording
    from nacre.reconstruction import FrameRecord, Reconstruction
    from nacre.viewer import LiveView


class Views:
    """Frames in different directions, as far as a calibration of depth needs them, kept in a stage."""

    def __init__(self, stage: Stage) -> None:
        self.chosen = stage.views

    @property
    def are_enough(self) -> bool:
        """Whether no more are needed."""
        from nacre.depth_calibration import MOST_VIEWS

        return len(self.chosen) == MOST_VIEWS

    def add(self, frame: FrameRecord) -> bool:
        """Take a frame that looks in a new direction; say whether there are enough."""
        from nacre.depth_calibration import LEAST_TURN, turn_between
        from nacre.run_state import pose_from

        pose = frame.world_from_camera
        if pose is not None and frame.status != "WEAK":
            last = pose_from(self.chosen[-1][1]) if self.chosen else None
            if last is None or turn_between(last, pose) >= LEAST_TURN:
                self.chosen.append((frame.index, pose.ravel().tolist()))
        return self.are_enough

    def calibrate(self, recording: Recording) -> DepthCalibration | None:
        """Return what the views say; None where they are too few."""
        import nacre
        from nacre.depth_calibration import LEAST_VIEWS
        from nacre.run_state import pose_from

        if len(self.chosen) < LEAST_VIEWS:
            return None
        views = ((recording[index].depth, pose_from(pose)) for index, pose in self.chosen)
        return nacre.calibrate_depth(views, recording.camera)


def run_staged(
    terminal: Terminal,
    done: Reconstruction,
    recording: Recording,
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
    import nacre
    from nacre.reconstruction import Reconstruction

    stage = unfinished.stage
    watch = watching(done, unfinished, live)
    if stage.name == "views":
        views = Views(stage)
        if not views.are_enough:
            rest = indices[len(done.frames) :]
            run_frames(terminal, done, rest, stop, until=views.add, watch=watch)
        if stop.wanted:
            return done
        try:
            with stop.at_once():
                calibration = views.calibrate(recording)
        except Stopped:
            return done
        stage.calibration = calibration
        if calibration is not None and stage.corrects_depth:
            terminal.say(
                f"depth is tilted by {calibration.tilt:.4f} (sigma {calibration.sigma:.4f}) per metre: "
                "beginning again with corrected depth"
            )
            corrected = recording.with_depth_calibration(calibration)
            done = Reconstruction(corrected, nacre.Model(recording.camera, parameters=done.model.parameters))
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
