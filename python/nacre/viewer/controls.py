"""What the window of a live camera and the run behind it tell each other."""

from __future__ import annotations

import threading
import time
from collections import deque
from typing import Any, Literal

from nacre.datasets.sequence import SequenceFrame
from nacre.io.images import encode_jpeg
from nacre.parameters import DepthParameters
from nacre.pictures.image_files import encode_png
from nacre.viewer.depth_picture import depth_picture

State = Literal["ready", "recording", "paused", "stopped", "finished"]

_AFTER: dict[tuple[str, str], State] = {
    ("ready", "start"): "recording",
    ("ready", "stop"): "stopped",
    ("recording", "pause"): "paused",
    ("recording", "stop"): "stopped",
    ("paused", "start"): "recording",
    ("paused", "stop"): "stopped",
}
_MAX_WIDTH = 480  # [pixels] of a picture
_RATE_OVER = 30  # frames


class Controls:
    """
    The buttons of a window, and the picture of what the camera sees.

    The threads of the camera, of the run and of the window use it together.

    Parameters
    ----------
    state : str
        "ready" waits for the button; "recording" begins at once.

    Attributes
    ----------
    state : str
        "ready", "recording", "paused", "stopped" (no more frames are taken), or "finished" (all is written).
    message : str
        What the window says beside the state.
    """

    def __init__(self, state: Literal["ready", "recording"] = "ready") -> None:
        self.state: State = state
        self.message = ""
        self._changing = threading.Lock()
        self._newest: SequenceFrame | None = None
        self._times: deque[float] = deque(maxlen=_RATE_OVER)
        self._num_seen = 0

    @property
    def is_recording(self) -> bool:
        """Whether the frames that come are wanted."""
        return self.state == "recording"

    @property
    def is_over(self) -> bool:
        """Whether no more frames are wanted."""
        return self.state in ("stopped", "finished")

    def press(self, button: str) -> None:
        """
        Press "start", "pause" or "stop"; what does not fit the state, as a second click, changes nothing.

        Raises
        ------
        KeyError
            There is no such button.
        """
        if all(button != known for _, known in _AFTER):
            raise KeyError(button)
        with self._changing:
            self.state = _AFTER.get((self.state, button), self.state)

    def end(self, message: str = "", *, finished: bool = False) -> None:
        """Note that the camera gives no more frames, or that all is written."""
        with self._changing:
            self.state = "finished" if finished else "stopped"
            self.message = message

    def see(self, frame: SequenceFrame) -> None:
        """Show a frame that came, whether it is wanted or not."""
        with self._changing:
            self._newest = frame
            self._num_seen += 1
            self._times.append(time.monotonic())

    def as_dict(self) -> dict[str, Any]:
        """Return what JSON can say."""
        with self._changing:
            newest, times = self._newest, list(self._times)
        seconds = times[-1] - times[0] if times else 0.0
        return {
            "state": self.state,
            "message": self.message,
            "numSeen": self._num_seen,
            "rate": round((len(times) - 1) / seconds, 1) if seconds else None,
            "hasColor": newest is not None and newest.color is not None,
        }

    def picture(self, kind: str, parameters: DepthParameters | None = None) -> bytes:
        """
        Return what the camera sees, as the bytes of an image file.

        Parameters
        ----------
        kind : str
            "color" or "depth".
        parameters : DepthParameters, optional
            What is marked as removed in the depth image.

        Raises
        ------
        KeyError
            There is no such picture.
        """
        newest = self._newest
        if newest is None or kind not in ("color", "depth"):
            raise KeyError(kind)
        if kind == "depth":
            return encode_png(depth_picture(newest.depth, newest.camera, parameters, max_width=_MAX_WIDTH))
        if newest.color is None:
            raise KeyError(kind)
        step = max(-(-newest.color.shape[1] // _MAX_WIDTH), 1)
        return encode_jpeg(newest.color[::step, ::step])
