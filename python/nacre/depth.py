"""Depth images: cleaning (edge noise above all), back-projection, normals of organised points."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, overload

import numpy as np
import numpy.typing as npt

from nacre import _core
from nacre._internal.arrays import as_camera, as_count, as_depth, as_flag, as_mask
from nacre._internal.core_options import mirrored, to_core
from nacre._internal.guided import guided
from nacre._internal.kinds import as_kind
from nacre.noise import Noise, NoiseModel, as_noise, estimate_noise
from nacre.parameters import DepthParameters, EdgeTest

__all__ = [
    "PIXEL_LABELS",
    "DepthReport",
    "Noise",
    "NoiseModel",
    "back_project",
    "depth_normals",
    "estimate_noise",
    "label_pixels",
    "preprocess_depth",
]

PIXEL_LABELS = ("kept", "invalid", "out_of_range", "masked", "edge", "slanted", "isolated")
"""What the values of :func:`label_pixels` mean."""

_FARTHEST = 1e15  # [m]: beyond it single precision cannot tell a normal

DepthArray = npt.NDArray[np.float32]


@dataclass(frozen=True)
class DepthReport:
    """How many pixels each step of :func:`preprocess_depth` removed; the counts add up to ``num_pixels``."""

    num_pixels: int
    num_invalid: int
    num_out_of_range: int
    num_masked: int
    num_edge: int
    num_slanted: int
    num_isolated: int
    num_kept: int


@overload
def preprocess_depth(
    depth: npt.ArrayLike,
    camera: _core.Camera,
    *,
    mask: npt.ArrayLike | None = ...,
    depth_scale: float = ...,
    edge_test: EdgeTest = ...,
    min_depth: float = ...,
    max_depth: float = ...,
    gradient_threshold: float = ...,
    edge_dilation: int = ...,
    edge_sigmas: float = ...,
    planar_keep_sigmas: float = ...,
    max_slant: float = ...,
    max_missing: float = ...,
    min_component: int = ...,
    tilt: float = ...,
    noise: Noise = ...,
    return_report: Literal[False] = ...,
    num_threads: int = ...,
) -> DepthArray: ...
@overload
def preprocess_depth(
    depth: npt.ArrayLike,
    camera: _core.Camera,
    *,
    mask: npt.ArrayLike | None = ...,
    depth_scale: float = ...,
    edge_test: EdgeTest = ...,
    min_depth: float = ...,
    max_depth: float = ...,
    gradient_threshold: float = ...,
    edge_dilation: int = ...,
    edge_sigmas: float = ...,
    planar_keep_sigmas: float = ...,
    max_slant: float = ...,
    max_missing: float = ...,
    min_component: int = ...,
    tilt: float = ...,
    noise: Noise = ...,
    return_report: Literal[True],
    num_threads: int = ...,
) -> tuple[DepthArray, DepthReport]: ...
@guided()
def preprocess_depth(
    depth: npt.ArrayLike,
    camera: _core.Camera,
    *,
    mask: npt.ArrayLike | None = None,
    depth_scale: float = 1.0,
    edge_test: EdgeTest = "inverse_depth",
    min_depth: float = 0.0,
    max_depth: float = math.inf,
    gradient_threshold: float = 0.005,
    edge_dilation: int = 1,
    edge_sigmas: float = 4.0,
    planar_keep_sigmas: float = 3.0,
    max_slant: float = 1.3962634,
    max_missing: float = 0.6,
    min_component: int = 20,
    tilt: float = 0.0,
    noise: Noise = None,
    return_report: bool = False,
    num_threads: int = 0,
) -> DepthArray | tuple[DepthArray, DepthReport]:
    """
    Return a copy of a depth image in metres in which noise is NaN.

    Pixels go, in this order: without a measurement (0, negative, NaN, inf; 65535 of integer images; a largest
    value to which nothing comes near); outside the depth range; outside the mask; at depth edges, where a
    pixel mixes two surfaces; on surfaces seen too steeply; isolated ones. What is kept has the value that it
    came with, but for two kinds of images: depth in units coarser than its noise is interpolated between its
    plateaus, by half a unit at most; and where cracks or pixels missing at random riddle surfaces, gaps one
    pixel wide are filled.

    Parameters
    ----------
    depth : (H, W) array
        Depth image in units of 1 / ``depth_scale`` metres, any real dtype.
    camera : Camera
        The camera of the image.
    mask : (H, W) array, optional
        Pixels where it is not 0 are used.
    depth_scale : float
        Stored units per metre: 1000 for millimetres, 5000 for TUM RGB-D.
    edge_test : {"inverse_depth", "gradient", "none"}
        ``"gradient"`` removes strong edges: the gradient of the depth (3 x 3 Sobel) exceeds
        ``gradient_threshold``; a missing neighbour is a strong edge. ``"inverse_depth"`` removes pixels where
        the second difference of inverse depth (of depth for an orthographic camera), which is zero on any
        plane, exceeds its noise, and so keeps slanted surfaces; a pixel beside a missing one is held against
        the plane through its two inner neighbours.
    min_depth, max_depth : float
        Nearer and farther measurements are removed [m].
    gradient_threshold : float
        Gradient test: the step in depth from a pixel to the next [m].
    edge_dilation : int
        Both tests: an edge grows by so many pixels.
    edge_sigmas : float
        Inverse-depth test: the threshold in standard deviations of the second difference.
    planar_keep_sigmas : float
        Inverse-depth test: a pixel at an edge stays after all where it is no farther than so many standard
        deviations from the plane through the surface on one side of it, as no mixed pixel is; 0 for none.
    max_slant : float
        Inverse-depth test: surfaces slanted more than this are removed [rad].
    max_missing : float
        A pixel goes where more than this part of its 5 x 5 neighbours is missing.
    min_component : int
        Connected speckles of fewer pixels go.
    tilt : float
        A systematic error of a pinhole camera whose depth is along its axis, which is taken away first:
        measured less true inverse depth, for each unit of x / z (1/m); see :func:`nacre.calibrate_depth`.
    noise : NoiseModel, float, "kinect", "stereo", "tof", "auto" or None
        The noise of the depth; a number is a constant standard deviation [m]; a name is that of a kind of
        sensor (see :class:`NoiseModel`); None and "auto" measure it from the image.
    return_report : bool
        Also return a :class:`DepthReport`.
    num_threads : int
        0 uses every processor. The result does not depend on it.

    Returns
    -------
    clean : (H, W) float32
        Depth in metres, of the kind that the camera says (z or radial); NaN where removed.
    report : DepthReport
        How many pixels each step removed, if ``return_report``.

    Raises
    ------
    TypeError, ValueError
        An argument of the wrong type, shape or range; depth, camera or mask differ in size; the median
        depth lies outside 0.05-50 m (a wrong ``depth_scale``); an option is out of its range.
    """
    image = as_depth("depth", depth, depth_scale)
    camera, wants_report = as_camera("camera", camera), as_flag("return_report", return_report)
    parameters = DepthParameters(
        edge_test=edge_test,
        min_depth=min_depth,
        max_depth=max_depth,
        gradient_threshold=gradient_threshold,
        edge_dilation=edge_dilation,
        edge_sigmas=edge_sigmas,
        planar_keep_sigmas=planar_keep_sigmas,
        max_slant=max_slant,
        max_missing=max_missing,
        min_component=min_component,
        tilt=tilt,
        noise=as_noise("noise", noise, camera),
    )
    shape = (image.shape[0], image.shape[1])
    clean, report = _core.preprocess_depth(
        image,
        camera,
        to_core(parameters, _core.DepthOptions()),
        as_mask("mask", mask, shape),
        as_count("num_threads", num_threads),
    )
    return (clean, mirrored(DepthReport, report)) if wants_report else clean


@guided()
def label_pixels(
    depth: npt.ArrayLike,
    camera: _core.Camera,
    parameters: DepthParameters | None = None,
    *,
    mask: npt.ArrayLike | None = None,
    depth_scale: float = 1.0,
    num_threads: int = 0,
) -> npt.NDArray[np.uint8]:
    """
    Return why :func:`preprocess_depth` removes each pixel.

    Parameters
    ----------
    depth : (H, W) array
        Depth image in units of 1 / ``depth_scale`` metres, any real dtype.
    camera : Camera
        The camera of the image.
    parameters : DepthParameters, optional
        What is removed.
    mask : (H, W) array, optional
        Pixels where it is not 0 are used.
    depth_scale : float
        Stored units per metre.
    num_threads : int
        0 uses every processor. The result does not depend on it.

    Returns
    -------
    labels : (H, W) uint8
        Indices of :data:`PIXEL_LABELS`, 0 where a pixel is kept. They count up to the :class:`DepthReport`.

    Raises
    ------
    TypeError, ValueError
        An argument of the wrong type, shape or range, as for :func:`preprocess_depth`.
    """
    image = as_depth("depth", depth, depth_scale)
    camera = as_camera("camera", camera)
    given = DepthParameters() if parameters is None else parameters
    as_kind("parameters", given, DepthParameters, "nacre.DepthParameters")
    options = to_core(given.for_camera(camera), _core.DepthOptions())
    labels: npt.NDArray[np.uint8] = _core.label_pixels(
        image,
        camera,
        options,
        as_mask("mask", mask, (image.shape[0], image.shape[1])),
        as_count("num_threads", num_threads),
    )
    return labels


@guided(
    intrinsic="camera",
    intrinsics="camera",
    scale="depth_scale",
    depth_trunc="nacre.preprocess_depth(depth, camera, max_depth=...) cuts off",
)
def back_project(
    depth: npt.ArrayLike, camera: _core.Camera, *, depth_scale: float = 1.0, num_threads: int = 0
) -> npt.NDArray[np.float32]:
    """
    Return the valid pixels of a depth image as points of the camera's frame, row by row.

    Parameters
    ----------
    depth : (H, W) array
        Depth image in units of 1 / ``depth_scale`` metres.
    camera : Camera
        The camera of the image.
    depth_scale : float
        Stored units per metre.
    num_threads : int
        0 uses every processor. The result does not depend on it.

    Returns
    -------
    points : (N, 3) float32
        One point per valid pixel [m].

    Raises
    ------
    TypeError, ValueError
        An argument of the wrong type, shape or range; depth and camera differ in size.
    """
    points: npt.NDArray[np.float32] = _core.back_project(
        as_depth("depth", depth, depth_scale),
        as_camera("camera", camera),
        as_count("num_threads", num_threads),
    )
    return points


@guided()
def depth_normals(
    depth: npt.ArrayLike,
    camera: _core.Camera,
    *,
    depth_scale: float = 1.0,
    noise: Noise = None,
    num_threads: int = 0,
) -> npt.NDArray[np.float32]:
    """
    Return the normals of a depth image: the fast path for organised points.

    A plane is affine in inverse depth over the image of a pinhole camera, and affine in depth for an
    orthographic one, so a normal is one linear fit over a window. The window grows with the noise, from 5 x 5
    to 11 x 11; pixels across a depth edge do not count.

    Parameters
    ----------
    depth : (H, W) array
        Depth image in units of 1 / ``depth_scale`` metres, best a cleaned one (:func:`preprocess_depth`).
    camera : Camera
        The camera of the image.
    depth_scale : float
        Stored units per metre.
    noise : NoiseModel, float, "kinect", "stereo", "tof", "auto" or None
        The noise of the depth; a number is a constant standard deviation [m]; a name is that of a kind of
        sensor (see :class:`NoiseModel`); None and "auto" measure it from the image.
    num_threads : int
        0 uses every processor. The result does not depend on it.

    Returns
    -------
    normals : (H, W, 3) float32
        Unit length, towards the camera; NaN where the depth is missing (or beyond 1e15 m) or no plane fits.

    Raises
    ------
    TypeError, ValueError
        An argument of the wrong type, shape or range; depth and camera differ in size.
    """
    image = as_depth("depth", depth, depth_scale)
    model = as_noise("noise", noise, as_camera("camera", camera))
    core_model = None if model is None else model.to_core()
    threads = as_count("num_threads", num_threads)
    too_far = image > _FARTHEST
    if too_far.any():
        image = np.where(too_far, np.float32(np.nan), image)
    normals: npt.NDArray[np.float32] = _core.depth_normals(image, camera, core_model, threads)
    return normals.reshape(*image.shape, 3)
