"""Depth images: cleaning (edge noise above all), back-projection, normals of organised points."""

from __future__ import annotations

import math
import numbers
from dataclasses import dataclass, fields
from typing import Any, Literal, overload

import numpy as np
import numpy.typing as npt

from nacre import _core
from nacre.arrays import as_depth, as_mask
from nacre.parameters import to_core

DepthArray = npt.NDArray[np.float32]
EdgeTest = Literal["inverse_depth", "gradient", "none"]


@dataclass(frozen=True)
class NoiseModel:
    """
    The standard deviation of a depth value: ``sigma(z) = constant + quadratic * (z - offset) ** 2``.

    Parameters
    ----------
    constant, offset : float
        [m].
    quadratic : float
        [1/m].
    """

    constant: float = 0.0
    quadratic: float = 0.0
    offset: float = 0.0

    @overload
    def sigma(self, z: float) -> float: ...
    @overload
    def sigma(self, z: npt.NDArray[Any]) -> npt.NDArray[Any]: ...
    def sigma(self, z: float | npt.NDArray[Any]) -> float | npt.NDArray[Any]:
        """Return the standard deviation at depth ``z``, both in metres."""
        return self.constant + self.quadratic * (z - self.offset) ** 2

    @classmethod
    def kinect(cls) -> NoiseModel:
        """Structured light, Nguyen et al. 2012: 1.2 mm + 1.9 mm (z - 0.4 m)^2."""
        return cls._from_core(_core.NoiseModel.kinect())

    def to_core(self) -> Any:
        """Return the C++ model with these values."""
        return to_core(self, _core.NoiseModel())

    @classmethod
    def _from_core(cls, core: Any) -> NoiseModel:
        return cls(*(getattr(core, field.name) for field in fields(cls)))


Noise = NoiseModel | float | Literal["kinect"] | None


@dataclass(frozen=True)
class DepthParameters:
    """
    What :func:`preprocess_depth` removes; see there for each field.

    Mirrors the C++ ``DepthOptions``; ``noise=None`` measures the noise from the image itself.
    """

    edge_test: EdgeTest = "inverse_depth"
    min_depth: float = 0.0
    max_depth: float = math.inf
    gradient_threshold: float = 0.005
    edge_dilation: int = 1
    edge_sigmas: float = 4.0
    max_slant: float = 1.3962634
    max_missing: float = 0.6
    min_component: int = 20
    noise: NoiseModel | None = None


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

    @classmethod
    def _from_core(cls, core: Any) -> DepthReport:
        return cls(*(getattr(core, field.name) for field in fields(cls)))


def as_noise(name: str, value: Noise) -> NoiseModel | None:
    """Return a noise argument as a model: a number is a constant [m]; None stays None."""
    expected = f"{name} must be a NoiseModel, a number of metres, 'kinect' or None"
    if value is None or isinstance(value, NoiseModel):
        return value
    if isinstance(value, str):
        if value != "kinect":
            raise ValueError(f"{expected}, got {value!r}")
        return NoiseModel.kinect()
    if isinstance(value, bool) or not isinstance(value, numbers.Real):
        raise TypeError(f"{expected}, got {type(value).__name__}")
    return NoiseModel(constant=float(value))


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
    max_slant: float = ...,
    max_missing: float = ...,
    min_component: int = ...,
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
    max_slant: float = ...,
    max_missing: float = ...,
    min_component: int = ...,
    noise: Noise = ...,
    return_report: Literal[True],
    num_threads: int = ...,
) -> tuple[DepthArray, DepthReport]: ...
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
    max_slant: float = 1.3962634,
    max_missing: float = 0.6,
    min_component: int = 20,
    noise: Noise = None,
    return_report: bool = False,
    num_threads: int = 0,
) -> DepthArray | tuple[DepthArray, DepthReport]:
    """
    Return a copy of a depth image in metres in which noise is NaN.

    Pixels go, in this order: without a measurement (0, negative, NaN, inf; 65535 of integer images); outside
    the depth range; outside the mask; at depth edges, where a pixel mixes two surfaces; on surfaces seen too
    steeply; isolated ones.

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
    max_slant : float
        Inverse-depth test: surfaces slanted more than this are removed [rad].
    max_missing : float
        A pixel goes where more than this part of its 5 x 5 neighbours is missing.
    min_component : int
        Connected specks of fewer pixels go.
    noise : NoiseModel, float, "kinect" or None
        The noise of the depth; a number is a constant standard deviation [m]; None measures it from the
        image.
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
    ValueError
        Depth, camera or mask differ in size; the median depth lies outside 0.05-50 m (a wrong
        ``depth_scale``); an option is out of its range.
    """
    image = as_depth("depth", depth, depth_scale)
    parameters = DepthParameters(
        edge_test=edge_test,
        min_depth=min_depth,
        max_depth=max_depth,
        gradient_threshold=gradient_threshold,
        edge_dilation=edge_dilation,
        edge_sigmas=edge_sigmas,
        max_slant=max_slant,
        max_missing=max_missing,
        min_component=min_component,
        noise=as_noise("noise", noise),
    )
    shape = (image.shape[0], image.shape[1])
    clean, report = _core.preprocess_depth(
        image,
        camera,
        to_core(parameters, _core.DepthOptions()),
        as_mask("mask", mask, shape),
        num_threads,
    )
    return (clean, DepthReport._from_core(report)) if return_report else clean


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
    ValueError
        Depth and camera differ in size.
    """
    points: npt.NDArray[np.float32] = _core.back_project(
        as_depth("depth", depth, depth_scale), camera, num_threads
    )
    return points


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
    noise : NoiseModel, float, "kinect" or None
        The noise of the depth; a number is a constant standard deviation [m]; None measures it from the
        image.
    num_threads : int
        0 uses every processor. The result does not depend on it.

    Returns
    -------
    normals : (H, W, 3) float32
        Unit length, towards the camera; NaN where the depth is missing or no plane fits.

    Raises
    ------
    ValueError
        Depth and camera differ in size.
    """
    image = as_depth("depth", depth, depth_scale)
    model = as_noise("noise", noise)
    core_model = None if model is None else model.to_core()
    normals: npt.NDArray[np.float32] = _core.depth_normals(image, camera, core_model, num_threads)
    return normals.reshape(*image.shape, 3)


def estimate_noise(
    depth: npt.ArrayLike, camera: _core.Camera, *, depth_scale: float = 1.0, num_threads: int = 0
) -> NoiseModel:
    """
    Return the noise of a depth image, measured from the residuals of local surface fits.

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
    noise : NoiseModel
        For a pinhole camera the Kinect's curve scaled to the image, for an orthographic camera a constant. A
        clean image gives a small positive floor; an image without smooth patches the Kinect's curve itself,
        or a tenth of a pixel for an orthographic camera.

    Raises
    ------
    ValueError
        Depth and camera differ in size.
    """
    return NoiseModel._from_core(
        _core.estimate_noise(as_depth("depth", depth, depth_scale), camera, num_threads)
    )
