"""A RealSense camera that is not there: as much of pyrealsense2 as the reader uses."""

from __future__ import annotations

import itertools
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

WIDTH, HEIGHT = 96, 72


def wave(i: int) -> np.ndarray:
    """Return the i-th depth image [mm]: a wavy surface that comes and goes by 10 mm, 1 mm a frame."""
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH]
    depth = (690 + abs(i % 20 - 10) + 30 * np.sin(x / 6) * np.cos(y / 7)).astype(np.uint16)
    depth[0] = 0
    return depth


class Frames:
    """A frameset, and the depth frame in it."""

    def __init__(self, i: int, confident: bool, hole: slice) -> None:
        self.i, self.confident, self.hole = i, confident, hole

    def get_depth_frame(self) -> Any:
        return self

    def get_color_frame(self) -> Any:
        return None

    def first_or_default(self, stream: str) -> Any:
        values = np.full((HEIGHT, WIDTH), 128, np.uint8)
        values[:, :10] = 0
        return SimpleNamespace(get_data=lambda: values) if self.confident else None

    def get_data(self) -> np.ndarray:
        depth = wave(self.i)
        depth[self.hole, self.hole] = 0
        return depth

    def get_frame_number(self) -> int:
        return self.i

    def get_timestamp(self) -> float:
        return 1000 + 33.3 * self.i


class Library:
    """
    The module. ``frames`` come, then the camera is silent, or gone where ``unplugged``.

    Nothing is measured in the rows and columns of ``hole``.
    """

    stream = SimpleNamespace(depth="depth", color="color", confidence="confidence")
    format = SimpleNamespace(z16="z16", rgb8="rgb8")
    camera_info = SimpleNamespace(name="name", serial_number="serial")

    def __init__(
        self,
        serials: tuple[str, ...] = ("0815",),
        frames: int | None = None,
        unplugged: bool = False,
        confident: bool = False,
        streams: tuple[str, ...] = ("depth", "confidence"),
        coefficients: tuple[float, ...] = (0.0,) * 5,
        busy: bool = False,
        seconds: float = 1 / 30,
        hole: slice = slice(0),
    ) -> None:
        self.serials, self.unplugged, self.confident, self.seconds = serials, unplugged, confident, seconds
        self.hole = hole
        self.streams, self.coefficients, self.busy = streams, coefficients, busy
        self.numbers = itertools.count() if frames is None else iter(range(frames))
        self.enabled: dict[str, Any] = {}
        self.stopped = False

    def device(self, serial: str) -> Any:
        told = {"name": "Fake D435", "serial": serial}
        sensor = SimpleNamespace(
            get_stream_profiles=lambda: [SimpleNamespace(stream_type=lambda s=s: s) for s in self.streams]
        )
        return SimpleNamespace(
            get_info=told.get, supports=lambda what: what in told, is_playback=lambda: False,
            query_sensors=lambda: [sensor],
            first_depth_sensor=lambda: SimpleNamespace(get_depth_scale=lambda: 0.0010000000474974513),
        )  # fmt: skip

    def context(self) -> Any:
        return SimpleNamespace(query_devices=lambda: [self.device(serial) for serial in self.serials])

    def config(self) -> Any:
        return SimpleNamespace(
            enable_device=lambda serial: self.enabled.update(device=serial),
            enable_stream=lambda stream, **more: self.enabled.update({stream: more}),
            resolve=lambda pipeline: SimpleNamespace(get_device=lambda: self.device(self.enabled["device"])),
        )

    def pipeline_wrapper(self, pipeline: Any) -> Any:
        return pipeline

    def pipeline(self) -> Any:
        return SimpleNamespace(start=self.start, stop=self.stop, try_wait_for_frames=self.try_wait_for_frames)

    def start(self, config: Any) -> Any:
        if self.busy:
            raise RuntimeError("xioctl(VIDIOC_S_FMT) failed, errno=16: Device or resource busy")
        intrinsics = SimpleNamespace(
            width=WIDTH, height=HEIGHT, fx=90.0, fy=91.0, ppx=47.5, ppy=35.5,
            coeffs=list(self.coefficients), model="distortion.brown_conrady",
        )  # fmt: skip
        profile = SimpleNamespace(get_intrinsics=lambda: intrinsics)
        return SimpleNamespace(
            get_device=lambda: self.device(self.enabled["device"]),
            get_stream=lambda stream: SimpleNamespace(as_video_stream_profile=lambda: profile),
        )

    def stop(self) -> None:
        self.stopped = True

    def align(self, stream: str) -> Any:
        return None

    def try_wait_for_frames(self, milliseconds: int) -> tuple[bool, Any]:
        i = next(self.numbers, None)
        time.sleep(self.seconds)
        if i is None:
            self.serials = () if self.unplugged else self.serials
            return False, None
        return True, Frames(i, self.confident, self.hole)


_PROGRAM = """
import sys
sys.path.insert(0, {here!r})
import fake_realsense
from nacre.cli import main
from nacre.datasets import realsense
library = fake_realsense.Library({options})
realsense._library = lambda: library
main(sys.argv[1:])
"""


def start(options: str, *arguments: str) -> subprocess.Popen[str]:
    """Start a command in a process of its own, with a camera of the given options."""
    code = _PROGRAM.format(here=str(Path(__file__).parent), options=options)
    return subprocess.Popen(
        [sys.executable, "-c", code, *arguments], text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )
