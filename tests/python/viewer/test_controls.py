"""The buttons of a live camera's window, and its pictures."""

from __future__ import annotations

import io

import numpy as np
import pytest

import nacre
from nacre.datasets import SequenceFrame
from nacre.viewer import Controls

CAMERA = nacre.Camera(1000, 60, 900, 900, 499.5, 29.5)


def frame(color: np.ndarray | None = None) -> SequenceFrame:
    return SequenceFrame(0, np.full((60, 1000), 0.8, np.float32), CAMERA, None, color, None)


def pressed(*buttons: str) -> str:
    controls = Controls()
    for button in buttons:
        controls.press(button)
    return controls.state


@pytest.mark.parametrize(
    ("buttons", "state"),
    [
        ([], "ready"),
        (["start"], "recording"),
        (["start", "start"], "recording"),
        (["pause"], "ready"),
        (["start", "pause"], "paused"),
        (["start", "pause", "start"], "recording"),
        (["start", "stop"], "stopped"),
        (["start", "pause", "stop", "start"], "stopped"),
        (["stop"], "stopped"),
    ],
)
def test_the_states(buttons: list[str], state: str) -> None:
    assert pressed(*buttons) == state


def test_there_is_no_other_button() -> None:
    with pytest.raises(KeyError, match="ready"):
        Controls().press("ready")


def test_what_was_seen_is_counted_with_its_rate(monkeypatch: pytest.MonkeyPatch) -> None:
    times = iter(np.arange(10) / 20)
    monkeypatch.setattr("nacre.viewer.controls.time.monotonic", lambda: next(times))
    controls = Controls("recording")
    assert controls.as_dict()["rate"] is None
    for _ in range(5):
        controls.see(frame())
    told = controls.as_dict()
    assert (told["numSeen"], told["rate"], told["hasColor"]) == (5, 20.0, False)


def test_pictures_are_small() -> None:
    image = pytest.importorskip("PIL.Image")
    controls = Controls()
    with pytest.raises(KeyError, match="depth"):
        controls.picture("depth")
    controls.see(frame(np.full((60, 1000, 3), (250, 5, 5), np.uint8)))
    assert image.open(io.BytesIO(controls.picture("depth"))).size == (334, 20)
    color = image.open(io.BytesIO(controls.picture("color")))
    assert color.size == (334, 20)
    assert color.getpixel((100, 10))[0] > 240
    controls.see(frame())
    with pytest.raises(KeyError, match="color"):
        controls.picture("color")
