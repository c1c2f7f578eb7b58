"""Depth cameras that OpenCV drives, live: by OpenNI 2 (Kinect, Xtion, Structure, Astra), or Orbbec's own."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from nacre._internal.warned import warn
from nacre.camera import Camera
from nacre.datasets.closable import Closable
from nacre.datasets.sequence import SequenceFrame
from nacre.errors import CameraError

_MISSING = (
    "cameras of OpenNI and Orbbec need OpenCV's cv2, built with -D WITH_OPENNI2=ON or -D WITH_OBSENSOR=ON; "
    "that from pip is not, on Linux"
)
_VGA = 640  # [pixels], the width that OpenNI's focal length is of
_REST = 0.005  # s, before asking again a driver that does not wait for frames
_MAX_DIFFERENCE = 0.05  # s, between a depth image and colours that come apart
_MILLIMETRES = 1000.0


class _Driver(NamedTuple):
    """A driver of OpenCV: what it is called, how it is built in, its numbers by name."""

    title: str
    option: str
    backends: tuple[str, ...]
    depth: str
    color: str


_DRIVERS = {
    "openni": _Driver(
        "OpenNI 2", "WITH_OPENNI2", ("CAP_OPENNI2", "CAP_OPENNI2_ASUS"), "CAP_OPENNI_DEPTH_MAP",
        "CAP_OPENNI_BGR_IMAGE",
    ),
    "orbbec": _Driver(
        "Orbbec", "WITH_OBSENSOR", ("CAP_OBSENSOR",), "CAP_OBSENSOR_DEPTH_MAP", "CAP_OBSENSOR_BGR_IMAGE"
    ),
}  # fmt: skip


class OpenCVCamera(Closable):
    """
    A depth camera that OpenCV drives, which must be built with its driver: that from pip is not, on Linux.

    Iterating it waits for frames; put :class:`nacre.datasets.LiveQueue` around it. Depth is in millimetres,
    laid over the colours where the camera can do that; the time stamps are those of the frames' arrival.

    Parameters
    ----------
    index : int
        Which camera, from 0.
    driver : str, optional
        "openni" (OpenNI 2) or "orbbec"; None takes the first that finds the camera.
    color : bool
        Whether colour is wanted; colours of another size than the depth images are left out, with a warning.
    timeout : float
        How long to wait for a frame [s].

    Attributes
    ----------
    name, serial : str
        The driver's name and the index.
    camera : Camera
        The depth camera; OpenNI tells the focal length alone, so that its centre is the image's.
    depth_scale : float
        Stored units per metre.

    Raises
    ------
    ImportError
        There is no OpenCV, or it was built without the driver; with what to do.
    CameraError
        No such camera, what it gives is no depth, or it stops to give frames.
    """

    depth_scale = _MILLIMETRES

    def __init__(
        self, index: int = 0, *, driver: str | None = None, color: bool = True, timeout: float = 5.0
    ) -> None:
        if driver is not None and driver not in _DRIVERS:
            raise ValueError(f"driver must be {' or '.join(map(repr, _DRIVERS))}, got {driver!r}")
        self._cv2 = cv2 = _library()
        self.timeout = timeout
        self.serial = str(index)
        self._driver, self._capture = _opened(cv2, index, list(_DRIVERS) if driver is None else [driver])
        self.name = f"{self._driver.title} camera"
        self._title = f"{self.name} {index}"
        self._wants_color = color
        self._color: tuple[float, npt.NDArray[np.uint8]] | None = None
        self._grabbed_at = 0.0
        self._turn = threading.Lock()  # of who grabs or closes
        self._closed = False
        try:
            if self._driver is _DRIVERS["openni"]:
                self._capture.set(cv2.CAP_PROP_OPENNI2_MIRROR, 0)
                self._capture.set(cv2.CAP_OPENNI_DEPTH_GENERATOR_REGISTRATION, int(color))
            first = self._next()
            self.camera = self._lens(first.shape[1], first.shape[0])
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Stop the camera."""
        with self._turn:
            if not self._closed:
                self._closed = True
                self._capture.release()

    def __iter__(self) -> Iterator[SequenceFrame]:
        index = 0
        while len(stored := self._next()):
            now = time.time()
            if stored.shape != (self.camera.height, self.camera.width):
                raise CameraError(
                    f"{self._title} gave an image of {stored.shape[1]} x {stored.shape[0]} after "
                    f"those of {self.camera.width} x {self.camera.height}"
                )
            depth = np.divide(stored, self.depth_scale, dtype=np.float32)
            depth[(stored == 0) | (stored == 65535)] = np.nan
            yield SequenceFrame(index, depth, self.camera, now, self._color_now(), None)
            index += 1

    def _next(self) -> npt.NDArray[np.uint16]:
        """Return the next depth image; an empty one when this is closed."""
        end = time.monotonic() + self.timeout
        while True:
            with self._turn:
                if self._closed:
                    return np.zeros((0, 0), np.uint16)
                depth = self._grabbed()
            if depth is not None:
                return depth
            if time.monotonic() > end:
                raise CameraError(
                    f"{self._title} gave no depth image for {self.timeout:g} s: plug it in again"
                )
            time.sleep(_REST)

    def _grabbed(self) -> npt.NDArray[np.uint16] | None:
        """Return the depth image that is there now, if one is, and keep the colours."""
        cv2 = self._cv2
        try:
            if not self._capture.grab():
                return None
            self._grabbed_at = time.monotonic()
            has_depth, depth = self._capture.retrieve(None, getattr(cv2, self._driver.depth))
            if self._wants_color:
                has_color, color = self._capture.retrieve(None, getattr(cv2, self._driver.color))
                if has_color:
                    self._color = self._grabbed_at, np.ascontiguousarray(color[..., ::-1])
        except cv2.error as error:
            raise CameraError(f"{self._title} stopped: {error}") from error
        if not has_depth:
            return None
        if depth.dtype != np.uint16 or depth.ndim != 2:
            shape = " x ".join(map(str, depth.shape))
            raise CameraError(
                f"{self._title} must give depth images of 16 bits, but gave {depth.dtype}, {shape}"
            )
        return np.asarray(depth)

    def _lens(self, width: int, height: int) -> Camera:
        cv2, get = self._cv2, self._capture.get
        center = [0.5 * (width - 1), 0.5 * (height - 1)]
        if self._driver is _DRIVERS["openni"]:
            focal = [get(cv2.CAP_OPENNI_DEPTH_GENERATOR_FOCAL_LENGTH) * width / _VGA] * 2
        else:
            focal = [get(cv2.CAP_PROP_OBSENSOR_INTRINSIC_FX), get(cv2.CAP_PROP_OBSENSOR_INTRINSIC_FY)]
            center = [get(cv2.CAP_PROP_OBSENSOR_INTRINSIC_CX), get(cv2.CAP_PROP_OBSENSOR_INTRINSIC_CY)]
        if not all(np.isfinite(focal)) or min(focal) <= 0:
            raise CameraError(f"{self._title} does not tell its focal length, but {focal[0]:g}")
        return Camera(width, height, *focal, *center)

    def _color_now(self) -> npt.NDArray[np.uint8] | None:
        """Return the newest colours, if they were there with the newest depth image, or just before."""
        if self._color is None or self._grabbed_at - self._color[0] > _MAX_DIFFERENCE:
            return None
        color = self._color[1]
        if color.shape[:2] == (self.camera.height, self.camera.width):
            return color
        self._wants_color, self._color = False, None
        size, wanted = f"{color.shape[1]} x {color.shape[0]}", f"{self.camera.width} x {self.camera.height}"
        warn(f"colours are left out: the images are {size}, and the depth images {wanted}")
        return None


def _library() -> Any:
    try:
        import cv2
    except ImportError as error:
        raise ImportError(_MISSING) from error
    return cv2


def _opened(cv2: Any, index: int, names: list[str]) -> tuple[_Driver, Any]:
    """Return the first of some drivers that finds the camera, with what it captures."""
    drivers = [_DRIVERS[name] for name in names]
    titles = " or ".join(driver.title for driver in drivers)
    has_any = False
    for driver in drivers:
        for backend in driver.backends:
            number = getattr(cv2, backend, None)
            if number is None or not cv2.videoio_registry.hasBackend(number):
                continue
            has_any = True
            capture = cv2.VideoCapture(index, number)
            if capture.isOpened():
                return driver, capture
            capture.release()
    if not has_any:
        options = " or ".join(f"-D {driver.option}=ON" for driver in drivers)
        raise ImportError(
            f"OpenCV {cv2.__version__} has no driver of {titles}, as those from pip have none on Linux: "
            f"build it with {options}"
        )
    raise CameraError(f"no {titles} camera {index} was found: plug it in; is another program using it?")
