"""A recording that grows while a camera runs: each view is kept, so that it can be looked at again."""

from __future__ import annotations

import dataclasses
import os
import threading
from collections import deque
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path

import numpy as np

from nacre.camera import Camera
from nacre.datasets import plain
from nacre.datasets.sequence import FrameSource, Sequence, SequenceFrame
from nacre.errors import CameraError
from nacre.io.atomic import atomic_writer, remove_leftovers
from nacre.io.cameras import write_camera
from nacre.io.images import write_color_jpeg, write_color_png, write_depth_png

_MOST_UNWRITTEN = 16
_OPTIONAL = ("color", "mask", "confidence")


class GrowingRecording(Sequence):
    """
    A plain recording that views are added to; a thread of its own writes them.

    What is in the folder is a whole recording at any moment, but for the view that is just being written:
    :func:`mend` takes that back. Colours are kept as JPEG, for the time that PNG takes.

    Parameters
    ----------
    path : path-like
        The folder; it is made where it does not exist.
    camera : Camera
        The depth camera.
    depth_scale : float
        Stored units per metre.
    name : str
        The recording's name.

    Raises
    ------
    FileExistsError
        The folder holds a recording already.
    """

    def __init__(self, path: str | os.PathLike[str], camera: Camera, depth_scale: float, name: str) -> None:
        folder = Path(path)
        plain.require_no_recording(folder)
        super().__init__(
            folder, format=plain.FORMAT, camera=camera, depth_scale=depth_scale, sources=(), name=name
        )
        for inside in ("depth", *_OPTIONAL):
            (folder / inside).mkdir(parents=True, exist_ok=True)
        write_camera(folder / "camera.json", camera, depth_scale)
        self._newest: SequenceFrame | None = None
        self._grown: list[FrameSource] = []
        self._sources = self._grown
        self._writer = ThreadPoolExecutor(1, "nacre-recording")
        self._unwritten: deque[Future[None]] = deque()
        self._settling = threading.Lock()

    def add(self, frame: SequenceFrame) -> int:
        """Keep a view and return its index; waits where the disk is far behind."""
        index = len(self._grown)
        name = f"{index:06d}"
        source = FrameSource(
            index,
            self.path / "depth" / f"{name}.png",
            None if frame.color is None else self.path / "color" / f"{name}.jpg",
            frame.timestamp,
            mask=None if frame.mask is None else self.path / "mask" / f"{name}.png",
            confidence=None if frame.confidence is None else self.path / "confidence" / f"{name}.png",
        )
        self._unwritten.append(self._writer.submit(self._write, frame, source))
        self._settle(_MOST_UNWRITTEN)
        self._grown.append(source)
        self._newest = dataclasses.replace(frame, index=index, camera=self.camera, truth=None, attributes={})
        return index

    def close(self) -> None:
        """Wait until everything is written, with the time stamps; leave nothing where no view was added."""
        try:
            self._settle(0)
        finally:
            self._writer.shutdown()
        if self._grown and self.has_timestamps:
            with atomic_writer(self.path / "timestamps.txt") as stream:
                stream.write("".join(f"{source.timestamp!r}\n" for source in self._grown).encode())
        for inside in ("depth", *_OPTIONAL):
            folder = self.path / inside
            if folder.is_dir() and not any(folder.iterdir()):
                folder.rmdir()
        if not self._grown:
            (self.path / "camera.json").unlink(missing_ok=True)
            with suppress(OSError):  # there is something else in it
                self.path.rmdir()

    def _settle(self, most: int) -> None:
        """Wait until at most so many views are not yet written."""
        with self._settling:  # a viewer reads from threads of its own
            while len(self._unwritten) > most:
                try:
                    self._unwritten.popleft().result()
                except OSError as error:
                    raise CameraError(f"images cannot be kept in {self.path}: {error.strerror}") from error

    def _write(self, frame: SequenceFrame, source: FrameSource) -> None:
        if source.color is not None and frame.color is not None:
            write_color_jpeg(source.color, frame.color)
        if source.mask is not None and frame.mask is not None:
            white = np.repeat(frame.mask[..., None], 3, axis=2).astype(np.uint8) * 255
            write_color_png(source.mask, white)
        if source.confidence is not None and frame.confidence is not None:
            write_color_png(source.confidence, np.repeat(frame.confidence[..., None], 3, axis=2))
        stored = np.rint(np.nan_to_num(frame.depth) * self.depth_scale)
        write_depth_png(source.depth, np.where(stored < 65535, stored, 0).astype(np.uint16), fast=True)
        if source.timestamp is not None:
            with (self.path / "timestamps.txt").open("ab", buffering=0) as stream:
                stream.write(f"{source.timestamp!r}\n".encode())

    def settle(self) -> None:
        """Wait until all views are written."""
        self._settle(0)

    def _read(self, source: FrameSource) -> SequenceFrame:
        if self._newest is not None and source.index == self._newest.index:
            return self._newest
        self._settle(0)
        return super()._read(source)


def mend(path: str | os.PathLike[str]) -> None:
    """Take back the view that a killed process was writing to a :class:`GrowingRecording`."""
    folder = Path(path)
    for inside in ("", "depth", *_OPTIONAL):
        remove_leftovers(folder / inside)
    times = folder / "timestamps.txt"
    if not times.exists():
        return
    lines = [line for line in times.read_bytes().splitlines(keepends=True) if line.endswith(b"\n")]
    depth = sorted((folder / "depth").glob("*.png"))
    for image in depth[len(lines) :]:
        image.unlink()
    with atomic_writer(times) as stream:
        stream.write(b"".join(lines[: len(depth)]))
