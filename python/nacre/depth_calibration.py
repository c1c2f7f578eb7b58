"""Systematic errors of depth cameras, found from overlapping views."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import astuple, dataclass

import numpy as np
import numpy.typing as npt

from nacre import _core
from nacre._internal.arrays import as_camera, as_depth, as_pose
from nacre._internal.core_options import mirrored
from nacre._internal.guided import guided
from nacre._internal.kinds import as_items
from nacre.camera import Camera
from nacre.depth import preprocess_depth


@dataclass(frozen=True)
class DepthCalibration:
    """
    How a camera's inverse depth is off across the image, its focal length, and along what depth is measured.

    Structured light and stereo measure a disparity along the image's rows, which is ``fx * baseline``
    times the inverse depth. Where pattern and camera, or the two cameras, do not fit each other quite in
    direction or focal length, it is off in proportion to the column, and so is the inverse depth.

    Attributes
    ----------
    tilt : float
        Measured less true inverse depth, for each unit of x / z (1/m): a depth z at x / z = 1 is about
        ``tilt * z**2`` too small.
    sigma : float
        Its standard deviation, from how much pairs of views differ (1/m); infinite with fewer than two.
    num_pairs : int
        Pairs of views that it is from.
    focal_scale : float
        The focal length that makes the views agree best, by the camera's: a wrong one stretches the scene
        along the camera's axis. Depth that is wrong by a factor shows in nothing.
    focal_sigma : float
        Its standard deviation, likewise.
    radial : float
        0 where depth is along the camera's axis, as was said, 1 where it is the distance along each pixel's
        ray; what the views agree best with.
    radial_sigma : float
        Its standard deviation, likewise.
    """

    tilt: float
    sigma: float
    num_pairs: int
    focal_scale: float = 1.0
    focal_sigma: float = math.inf
    radial: float = 0.0
    radial_sigma: float = math.inf

    @property
    def is_significant(self) -> bool:
        """Whether the error matters (0.002 / m) and is beyond doubt (as five sigma of many pairs)."""
        return _core.DepthCalibration(*astuple(self)).is_significant

    @property
    def has_wrong_focal_length(self) -> bool:
        """Whether the focal length is off by more than 4 %, as five sigma of many pairs are."""
        return _core.DepthCalibration(*astuple(self)).has_wrong_focal_length

    @property
    def has_radial_depth(self) -> bool:
        """Whether depth is along the rays rather than the axis (`radial` above a half), as surely."""
        return _core.DepthCalibration(*astuple(self)).has_radial_depth

    def camera_advice(self, camera: Camera) -> str:
        """
        Return what seems to be wrong with a camera as it was given, and what would be right.

        Parameters
        ----------
        camera : Camera
            The pinhole camera that was calibrated.

        Returns
        -------
        str
            A sentence; empty where nothing is clearly wrong.

        Raises
        ------
        TypeError, ValueError
            It is no camera, or no pinhole camera.
        """
        _check_camera(camera)
        told = []
        if self.has_radial_depth:
            told.append(
                "views in different directions fit each other best if depth is the distance along each "
                f"pixel's ray, not along the camera's axis ({self.radial:.2f} times the difference, sigma "
                f"{self.radial_sigma:.3f}): give the camera depth='radial'"
            )
        if self.has_wrong_focal_length:
            fx, fy = (self.focal_scale * length for length in (camera.fx, camera.fy))
            told.append(
                f"views in different directions fit each other best with fx {fx:.0f} and fy {fy:.0f} pixels, "
                f"{self.focal_scale:.2f} times what the camera says (sigma {self.focal_sigma:.3f}): "
                "its focal length is wrong"
            )
        return "; ".join(told)

    def correct(self, depth: npt.ArrayLike, camera: Camera) -> npt.NDArray[np.float32]:
        """
        Return a depth image without the error.

        Parameters
        ----------
        depth : (H, W) array
            Metres.
        camera : Camera
            A pinhole camera.

        Returns
        -------
        (H, W) float32
            Metres; NaN where the correction would be more than a half, which no calibration reaches.

        Raises
        ------
        TypeError, ValueError
            If the camera is not a pinhole camera or the image does not have its size.
        """
        _check_camera(camera)
        return _core.correct_depth(_checked(depth, camera), camera, self.tilt, 0)


@guided()
def calibrate_depth(views: Iterable[tuple[npt.ArrayLike, npt.ArrayLike]], camera: Camera) -> DepthCalibration:
    """
    Find what is systematically wrong with a camera's depth, by which overlapping views agree best.

    Two views of one surface from different directions see it in different columns, stretched along
    different axes; what the tilt of the inverse depth, a focal length and their relative pose together
    explain is fitted to all pairs of successive views that are 0.1 to 0.6 rad apart (point to plane, Gauss
    and Newton, robust), and whether depth is the distance along the rays. Poses need to be about right
    only. The idea, to calibrate depth by what overlaps in a recording, is that of Teichman, Miller and Thrun
    2013. A :class:`nacre.Model` does the same with its own frames (``calibrate_depth``); what is known of a
    camera can be given to it as ``depth.tilt``.

    Parameters
    ----------
    views : iterable of (depth, world_from_camera)
        Depth images (H, W) in metres and poses (4, 4), in the order of the recording. Views that turned by
        less than 0.1 rad are skipped; at most 24 are used.
    camera : Camera
        A pinhole camera.

    Returns
    -------
    DepthCalibration
        With ``num_pairs`` 0 where no two views tell anything.

    Raises
    ------
    TypeError, ValueError
        An argument of the wrong type, shape or range; not a pinhole camera, or an image or a pose does
        not fit.
    """
    _check_camera(camera)
    calibrator = _core.DepthCalibrator(camera)
    for view in as_items("views", views):
        if not isinstance(view, tuple | list) or len(view) != 2:
            raise TypeError(f"views must be pairs of depth and world_from_camera, got {type(view).__name__}")
        depth, pose = view
        matrix = as_pose("world_from_camera", pose)
        image = _checked(depth, camera)
        if calibrator.has_enough:
            break
        if calibrator.is_new_direction(matrix):
            calibrator.add(preprocess_depth(image, camera), matrix)
    return mirrored(DepthCalibration, calibrator.fit(0))


def _checked(depth: npt.ArrayLike, camera: Camera) -> npt.NDArray[np.float32]:
    image = as_depth("depth", depth)
    if image.shape != (camera.height, camera.width):
        raise ValueError(f"depth: expected {camera.height} x {camera.width} pixels, got {image.shape}")
    return image


def _check_camera(camera: Camera) -> None:
    as_camera("camera", camera)
    if not _core.can_calibrate_depth(camera):
        raise ValueError(f"camera: expected a pinhole camera with depth along its axis, got {camera!r}")
