"""Cameras: from intrinsics, from a matrix, or from a field of view."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from nacre import _core
from nacre._internal.arrays import as_count, as_number, as_real
from nacre._internal.guided import GuidedNames, guided, no_such_member

_NO_DISTORTION = (0.0, 0.0, 0.0, 0.0, 0.0)
_FROM_FOV = "Camera.from_fov(width, height, horizontal_degrees) makes one of a field of view"
_FROM_MATRIX = "Camera.from_matrix(width, height, K) of a 3x3 matrix"


class _GuidedClass(type(_core.Camera)):  # type: ignore[misc]
    """The type of a class whose missing constructors are answered by what takes their place."""

    if not TYPE_CHECKING:

        def __getattr__(cls, name: str) -> Any:
            raise no_such_member(cls, name, cls)


class Camera(GuidedNames, _core.Camera, metaclass=_GuidedClass):
    """
    An immutable camera model. Pixel centres are integers; axes are OpenCV's (x right, y down, z forward).

    Parameters
    ----------
    width, height : int
        Size of the image [pixels].
    fx, fy, cx, cy : float
        Focal lengths and principal point [pixels]: x = (u - cx) z / fx.
    distortion : 4 or 5 floats
        Brown-Conrady coefficients k1 k2 p1 p2 (k3), in OpenCV's order.
    depth : "z" or "radial"
        What a depth value measures: the distance along the optical axis, or along the pixel's ray.

    Raises
    ------
    TypeError, ValueError
        Names the argument that is missing, of the wrong type or out of range.
    """

    __slots__ = ()

    @guided(
        f"{_FROM_FOV}, {_FROM_MATRIX}",
        fov=_FROM_FOV,
        K=_FROM_MATRIX,
        matrix=_FROM_MATRIX,
        intrinsic_matrix=_FROM_MATRIX,
        intrinsics=_FROM_MATRIX,
        ppx="cx",
        ppy="cy",
        coeffs="distortion",
        depth_scale="it belongs to the images: nacre.Model(camera, depth_scale=...)",
    )
    def __init__(
        self,
        width: int,
        height: int,
        fx: float,
        fy: float,
        cx: float,
        cy: float,
        *,
        distortion: Sequence[float] | npt.NDArray[np.float64] = _NO_DISTORTION,
        depth: str = "z",
    ) -> None:
        if isinstance(distortion, np.ndarray):  # OpenCV's are (1, 5) or (5, 1)
            distortion = distortion.ravel().tolist()
        super().__init__(width, height, fx, fy, cx, cy, distortion=distortion, depth=depth)

    @classmethod
    @guided(f"it is {_FROM_FOV}", **dict.fromkeys(("fov", "hfov", "fov_x"), "horizontal_degrees"))
    def from_fov(
        cls,
        width: int,
        height: int,
        horizontal_degrees: float,
        vertical_degrees: float | None = None,
        *,
        depth: str = "z",
    ) -> Camera:
        """
        Return the pinhole camera with a field of view, whose axis goes through the middle of the image.

        Parameters
        ----------
        width, height : int
            Size of the image [pixels].
        horizontal_degrees : float
            From the left edge of the first column to the right edge of the last, as data sheets have it
            [degrees]: fx = width / (2 tan(horizontal / 2)). Angles up to pi are taken for radians, and
            refused.
        vertical_degrees : float, optional
            From the upper to the lower edge [degrees]. Pixels are square without it.
        depth : "z" or "radial"
            As of :class:`Camera`.

        Returns
        -------
        Camera

        Raises
        ------
        TypeError, ValueError
            Names the argument that is of the wrong type or out of range.
        """
        columns, rows = as_count("width", width), as_count("height", height)
        fx = _focal_length("horizontal_degrees", horizontal_degrees, columns)
        fy = fx if vertical_degrees is None else _focal_length("vertical_degrees", vertical_degrees, rows)
        return cls(columns, rows, fx, fy, (columns - 1) / 2, (rows - 1) / 2, depth=depth)

    @classmethod
    @guided(f"it is {_FROM_MATRIX}", K="matrix", dist="distortion", coeffs="distortion")
    def from_matrix(
        cls,
        width: int,
        height: int,
        matrix: npt.ArrayLike,
        *,
        distortion: Sequence[float] | npt.NDArray[np.float64] = _NO_DISTORTION,
        depth: str = "z",
    ) -> Camera:
        """
        Return the pinhole camera of an intrinsic matrix K, as OpenCV and ROS have it.

        Parameters
        ----------
        width, height : int
            Size of the image [pixels].
        matrix : (3, 3) array_like of real numbers
            [[fx, 0, cx], [0, fy, cy], [0, 0, 1]].
        distortion, depth
            As of :class:`Camera`.

        Returns
        -------
        Camera

        Raises
        ------
        TypeError, ValueError
            Names the argument that is of the wrong type or out of range.
        """
        given = as_real("matrix", matrix).astype(np.float64)
        if given.shape != (3, 3):
            raise ValueError(f"matrix must have shape (3, 3), got {given.shape}: it is {_FROM_MATRIX}")
        (fx, skew, cx), (lower, fy, cy), last = given.tolist()
        if not np.isfinite(given).all():
            raise ValueError(f"matrix must be finite, got {given.tolist()}")
        if skew or lower or last != [0.0, 0.0, 1.0]:
            raise ValueError(f"matrix must be [[fx, 0, cx], [0, fy, cy], [0, 0, 1]], got {given.tolist()}")
        return cls(width, height, fx, fy, cx, cy, distortion=distortion, depth=depth)

    @classmethod
    def orthographic(cls, width: int, height: int, pixel_size: float) -> Camera:  # type: ignore[override]
        """
        Return a camera with parallel rays: x = (u - (width - 1) / 2) pixel_size.

        Parameters
        ----------
        width, height : int
            Size of the image [pixels].
        pixel_size : float
            [m].

        Returns
        -------
        Camera
        """
        return camera_of(_core.Camera.orthographic(width, height, pixel_size))

    def project(self, points: npt.ArrayLike) -> npt.NDArray[np.float64]:
        """
        Return the pixels that see points of the camera frame, distortion included.

        Parameters
        ----------
        points : (N, 3) array_like of real numbers
            [m].

        Returns
        -------
        (N, 2) float64
            (u, v) [pixels]; NaN behind the camera and where the distortion model has ended.
        """
        return super().project(points)

    @property
    def matrix(self) -> npt.NDArray[np.float64]:
        """The intrinsic matrix K of a pinhole camera, (3, 3): [[fx, 0, cx], [0, fy, cy], [0, 0, 1]]."""
        if self.model != "pinhole":
            raise AttributeError("matrix belongs to a pinhole camera; this one has a pixel_size")
        return np.array([[self.fx, 0.0, self.cx], [0.0, self.fy, self.cy], [0.0, 0.0, 1.0]])


def camera_of(core: _core.Camera) -> Camera:
    """Return a camera of the core as users have it."""
    camera = Camera.__new__(Camera)
    camera.__setstate__(core.__getstate__())
    return camera


def _focal_length(name: str, degrees: float, size: int) -> float:
    angle = as_number(name, degrees)
    if 0 < angle <= math.pi:
        raise ValueError(
            f"{name} must be degrees, got {angle:g}: numpy.degrees makes them of radians, and "
            "Camera(width, height, fx, fy, cx, cy) a camera with so narrow a view"
        )
    if not 0 < angle < 180:
        raise ValueError(f"{name} must be more than 0 and less than 180, got {angle:g}")
    return size / (2 * math.tan(math.radians(angle) / 2))
