"""Running a recording whose depth may be systematically wrong: found out on the way, it is begun again."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from nacre.cli.running import run_frames
from nacre.cli.terminal import Terminal

if TYPE_CHECKING:
    from nacre import DepthCalibration
    from nacre.datasets import Sequence as Recording
    from nacre.reconstruction import FrameRecord, Reconstruction
    from nacre.viewer import LiveView


class Views:
    """Frames in different directions, as far as a calibration of depth needs them."""

    def __init__(self) -> None:
        self.frames: list[FrameRecord] = []

    def add(self, frame: FrameRecord) -> bool:
        """Take a frame that looks in a new direction; say whether there are enough."""
        from nacre.depth_calibration import LEAST_TURN, MOST_VIEWS, turn_between

        pose = frame.world_from_camera
        if pose is not None and frame.status != "WEAK":
            last = self.frames[-1].world_from_camera if self.frames else None
            if last is None or turn_between(last, pose) >= LEAST_TURN:
                self.frames.append(frame)
        return len(self.frames) == MOST_VIEWS

    def calibrate(self, recording: Recording) -> DepthCalibration | None:
        """Return what the views say; None where they are too few."""
        import nacre
        from nacre.depth_calibration import LEAST_VIEWS

        if len(self.frames) < LEAST_VIEWS:
            return None
        views = (
            (recording[frame.index].depth, pose)
            for frame in self.frames
            if (pose := frame.world_from_camera) is not None
        )
        return nacre.calibrate_depth(views, recording.camera)


def run_calibrated(
    terminal: Terminal,
    done: Reconstruction,
    recording: Recording,
    indices: Sequence[int],
    live: LiveView | None = None,
) -> tuple[Reconstruction, DepthCalibration | None, bool]:
    """
    Run the frames of a recording; where they show that its depth is wrong, run them again with it corrected.

    ``live`` shows the run that is going on.

    Returns
    -------
    done : Reconstruction
        The given one, or a new one.
    calibration : DepthCalibration or None
        What was found, whether or not it was used; None where nothing could be.
    interrupted : bool
        Whether Ctrl-C stopped the run.
    """
    import nacre
    from nacre.reconstruction import Reconstruction

    watch = live.add if live else None
    views = Views()
    interrupted = run_frames(terminal, done, indices, views.add, watch)
    calibration = None if interrupted else views.calibrate(recording)
    rest = indices[len(done.frames) :]
    if calibration is not None and calibration.is_significant:
        terminal.say(
            f"depth is tilted by {calibration.tilt:.4f} (sigma {calibration.sigma:.4f}) per metre: "
            "beginning again with corrected depth"
        )
        recording = recording.with_depth_calibration(calibration)
        done = Reconstruction(recording, nacre.Model(recording.camera, parameters=done.model.parameters))
        rest = indices
        if live is not None:
            live.begin_again(done)
    if rest and not interrupted:
        interrupted = run_frames(terminal, done, rest, watch=watch)
    return done, calibration, interrupted
