"""A depth camera of OpenCV that is not there: as much of cv2 as the reader uses."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from types import SimpleNamespace
from typing import Any

import numpy as np

WIDTH, HEIGHT = 64, 48
OPENNI, ASUS, ORBBEC = 1600, 1610, 2600


class Error(Exception):
    """cv2.error."""


class Library:
    """
    The module, and what it captures.

    Parameters
    ----------
    grabs : iterable of (depth, color)
        What each grab finds, None where there is none; after them nothing. An exception is raised.
    built : tuple of int
        The drivers that OpenCV was built with.
    plugged : tuple of (int, int)
        Drivers with the indices of cameras.
    focal : float
        What the driver tells.
    """

    __version__ = "4.9"
    error = Error
    CAP_OPENNI2, CAP_OPENNI2_ASUS, CAP_OBSENSOR = OPENNI, ASUS, ORBBEC
    CAP_OPENNI_DEPTH_MAP, CAP_OPENNI_BGR_IMAGE = 0, 5
    CAP_OBSENSOR_DEPTH_MAP, CAP_OBSENSOR_BGR_IMAGE = 10, 11
    CAP_PROP_OPENNI2_MIRROR, CAP_OPENNI_DEPTH_GENERATOR_REGISTRATION = 111, 102
    CAP_OPENNI_DEPTH_GENERATOR_FOCAL_LENGTH = 103
    CAP_PROP_OBSENSOR_INTRINSIC_FX, CAP_PROP_OBSENSOR_INTRINSIC_FY = 26001, 26002
    CAP_PROP_OBSENSOR_INTRINSIC_CX, CAP_PROP_OBSENSOR_INTRINSIC_CY = 26003, 26004

    def __init__(
        self,
        grabs: Iterable[Any] = (),
        built: tuple[int, ...] = (OPENNI, ASUS, ORBBEC),
        plugged: tuple[tuple[int, int], ...] = ((OPENNI, 0),),
        focal: float = 575.0,
    ) -> None:
        self._grabs, self._plugged, self._focal = iter(grabs), plugged, focal
        self._now: tuple[Any, Any] = None, None
        self.is_open = False
        self.settings: dict[int, float] = {}
        self.videoio_registry = SimpleNamespace(hasBackend=built.__contains__)

    def VideoCapture(self, index: int, driver: int) -> Library:  # noqa: N802
        self.is_open = (driver, index) in self._plugged
        return self

    def isOpened(self) -> bool:  # noqa: N802
        return self.is_open

    def release(self) -> None:
        self.is_open = False

    def set(self, setting: int, value: float) -> None:
        self.settings[setting] = value

    def get(self, setting: int) -> float:
        return {26003: 30.0, 26004: 25.0}.get(setting, self._focal)

    def grab(self) -> bool:
        found = next(self._grabs, None)
        if isinstance(found, Exception):
            raise found
        self._now = (None, None) if found is None else found
        return found is not None

    def retrieve(self, image: None, flag: int) -> tuple[bool, Any]:
        found = self._now[0 if flag in (0, 10) else 1]
        return found is not None, found


def grabs(count: int, depth_of: Callable[[int], np.ndarray] | None = None) -> list[tuple[Any, Any]]:
    """Return pictures of something flat that comes nearer, with colours."""
    colors = np.broadcast_to(np.array([9, 10, 200], np.uint8), (HEIGHT, WIDTH, 3))  # blue, green, red
    flat = lambda i: np.full((HEIGHT, WIDTH), 700 - i, np.uint16)  # noqa: E731
    return [((depth_of or flat)(i), colors) for i in range(count)]
