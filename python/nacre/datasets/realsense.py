"""RealSense cameras, live, and the SDK's recordings played back; read by pyrealsense2."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from contextlib import suppress
from typing import Any

import numpy as np

from nacre._internal.warned import warn
from nacre.camera import Camera
from nacre.datasets.closable import Closable
from nacre.datasets.sequence import SequenceFrame
from nacre.errors import CameraError, FileFormatError

_MISSING = 'RealSense cameras need pyrealsense2: pip install "nacre[realsense]"'


class RealSense(Closable):
    """
    A RealSense camera that runs: depth, and colour laid over it where the camera has colour.

    Iterating it waits for frames; put :class:`nacre.datasets.LiveQueue` around it, which drops frames
    rather than falling behind. Depth has the camera's own units, intrinsics and time stamps; pixels of no
    confidence (L515) are masked.

    Parameters
    ----------
    serial : str, optional
        Which camera. None takes the first.
    file : path-like, optional
        A recording of the SDK, played back as if it were a camera.
    color : bool
        Whether colour is wanted.
    timeout : float
        How long to wait for a frame [s].

    Attributes
    ----------
    name, serial : str
        What the camera says of itself.
    camera : Camera
        The depth camera.
    depth_scale : float
        Stored units per metre.

    Raises
    ------
    ImportError
        When pyrealsense2 is missing, with the command that installs it.
    CameraError
        No such camera, it is in use, or it stops to give frames.
    FileFormatError
        When ``file`` is no recording that the SDK can play.
    """

    def __init__(
        self,
        serial: str | None = None,
        *,
        file: str | os.PathLike[str] | None = None,
        color: bool = True,
        timeout: float = 5.0,
    ) -> None:
        self._rs = rs = _library()
        self.timeout = timeout
        config = rs.config()
        if file is not None:
            config.enable_device_from_file(os.fspath(file), repeat_playback=False)
        else:
            config.enable_device(_chosen(rs, serial))
        self._pipeline = rs.pipeline()
        try:
            device = config.resolve(rs.pipeline_wrapper(self._pipeline)).get_device()
            offered = _offered(device)
            if rs.stream.depth not in offered:
                raise CameraError(f"{_told(device, rs.camera_info.name)} has no depth; take another camera")
            config.enable_stream(rs.stream.depth, format=rs.format.z16, framerate=0)
            if color and rs.stream.color in offered:
                config.enable_stream(rs.stream.color, format=rs.format.rgb8, framerate=0)
            if rs.stream.confidence in offered:
                config.enable_stream(rs.stream.confidence)
            profile = self._pipeline.start(config)
        except RuntimeError as error:
            if isinstance(error, CameraError):
                raise
            if file is not None:
                raise FileFormatError(file, f"the RealSense library cannot play it: {error}") from error
            raise CameraError(
                f"the RealSense camera does not start: {error}; is another program using it?"
            ) from error
        self._device = profile.get_device()
        self.name = _told(self._device, rs.camera_info.name)
        self.serial = _told(self._device, rs.camera_info.serial_number)
        units = self._device.first_depth_sensor().get_depth_scale()
        self.depth_scale = round(1 / units, 3)
        self.camera = _camera(profile.get_stream(rs.stream.depth).as_video_stream_profile().get_intrinsics())
        self._align = rs.align(rs.stream.depth)
        self._closed = False

    def close(self) -> None:
        """Stop the camera."""
        if not self._closed:
            self._closed = True
            with suppress(RuntimeError):  # of a camera that is gone
                self._pipeline.stop()

    def __iter__(self) -> Iterator[SequenceFrame]:
        index, last = 0, None
        while not self._closed:
            frames = self._next()
            if frames is None:
                return
            depth = frames.get_depth_frame()
            # The same depth image comes again where colours are faster.
            if not depth or depth.get_frame_number() == last:
                continue
            last = depth.get_frame_number()
            yield self._frame(index, frames)
            index += 1

    def _next(self) -> Any:
        """Return the next frames; None at the end of a recording, and of a camera that was closed."""
        rs, end = self._rs, time.monotonic() + self.timeout
        while not self._closed and time.monotonic() < end:
            try:
                arrived, frames = self._pipeline.try_wait_for_frames(200)
            except RuntimeError as error:
                if self._closed:
                    return None
                raise CameraError(f"{self.name} stopped: {error}") from error
            if arrived:
                return frames
            if self._device.is_playback():
                if self._device.as_playback().current_status() == rs.playback_status.stopped:
                    return None
            elif self.serial not in _serials(rs):
                raise CameraError(f"{self.name} {self.serial} was unplugged")
        if self._closed:
            return None
        raise CameraError(
            f"{self.name} gave no frame for {self.timeout:g} s: plug it in again, into a USB 3 port"
        )

    def _frame(self, index: int, frames: Any) -> SequenceFrame:
        rs = self._rs
        measured = frames.get_depth_frame()
        stored = np.asanyarray(measured.get_data())
        depth = stored / np.float32(self.depth_scale)
        depth[(stored == 0) | (stored == 65535)] = np.nan
        color = mask = sure = None
        if frames.get_color_frame():
            color = np.array(self._align.process(frames).get_color_frame().get_data(), np.uint8)
        confidence = frames.first_or_default(rs.stream.confidence)
        if confidence:
            values = np.asanyarray(confidence.get_data())
            if values.shape == stored.shape:
                sure = np.clip(values, 0, 255).astype(np.uint8)
                mask = sure > 0
        time = 1e-3 * measured.get_timestamp()
        return SequenceFrame(index, depth, self.camera, time, color, None, mask, confidence=sure)


def _library() -> Any:
    try:
        import pyrealsense2
    except ImportError as error:
        raise ImportError(_MISSING) from error
    return pyrealsense2


def _serials(rs: Any) -> list[str]:
    return [_told(device, rs.camera_info.serial_number) for device in rs.context().query_devices()]


def _chosen(rs: Any, serial: str | None) -> str:
    found = _serials(rs)
    if not found:
        raise CameraError(
            "no RealSense camera was found: plug one into a USB 3 port (Linux needs its udev rules, too)"
        )
    if serial is not None and serial not in found:
        raise CameraError(f"no RealSense camera has the serial number {serial}; there are {', '.join(found)}")
    return found[0] if serial is None else serial


def _told(device: Any, what: Any) -> str:
    return str(device.get_info(what)) if device.supports(what) else "camera"


def _offered(device: Any) -> set[Any]:
    return {
        profile.stream_type() for sensor in device.query_sensors() for profile in sensor.get_stream_profiles()
    }


def _camera(intrinsics: Any) -> Camera:
    distortion = [float(c) for c in intrinsics.coeffs]
    model = str(intrinsics.model).rpartition(".")[2]
    if any(distortion) and model != "brown_conrady":
        warn(f"the depth camera's distortion ({model}) is left out")
        distortion = [0.0] * 5
    return Camera(
        intrinsics.width, intrinsics.height, intrinsics.fx, intrinsics.fy, intrinsics.ppx, intrinsics.ppy,
        distortion=distortion,
    )  # fmt: skip
