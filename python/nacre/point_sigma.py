"""How far a model's points are expected to be from the surface."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from nacre.camera import Camera
from nacre.frame_report import FrameReport
from nacre.noise import NoiseModel
from nacre.parameters import ModelParameters

Array = npt.NDArray[np.float64]


class FusedModel(Protocol):
    """What of a :class:`nacre.Model` tells it."""

    @property
    def points(self) -> npt.NDArray[np.float32]:
        """(N, 3) [m]."""
        ...

    @property
    def confidence(self) -> npt.NDArray[np.float32]:
        """(N,), in frontal observations."""
        ...

    @property
    def last_seen(self) -> npt.NDArray[Any]:
        """(N,): which frame saw each point last."""
        ...

    @property
    def frames(self) -> Sequence[FrameReport]:
        """What became of each frame."""
        ...

    @property
    def poses(self) -> Array:
        """(F, 4, 4) ``world_from_camera``."""
        ...

    @property
    def camera(self) -> Camera:
        """Of every frame."""
        ...

    @property
    def parameters(self) -> ModelParameters:
        """Of the model."""
        ...

    @property
    def noise(self) -> NoiseModel:
        """Of a pixel, as one image shows it."""
        ...

    @property
    def noise_factor(self) -> float:
        """By how much it is more."""
        ...


_WINDOW_RADIUS = 4  # [pixels] largest window of pixels that fusion averages (fusion_limits::largest_support)
_CORRELATION_LENGTH = 3.3  # [pixels] of the errors that neighbouring pixels share (docs/algorithms/noise.md)
_CELLS = 40  # across an image, to find what its pixels see


def point_sigma(model: FusedModel) -> Array:
    """Return the standard deviation of each point across the surface (N,) [m]; see `Model.point_sigma`."""
    confidence = model.confidence.astype(np.float64)
    fused = (frame.world_from_camera for frame in model.frames if frame.status in ("TRACKED", "RELOCALISED"))
    first = next(fused, None)
    is_fused = model.parameters.fusion_method == "fuse" and len(confidence) > 0
    if not is_fused or first is None or not _knows_noise(model):
        return np.full(len(confidence), np.nan)
    noise, factor = model.noise, model.noise_factor
    reference = model.parameters.fusion.reference_sigma or _median_sigma(model, first)
    independent, shared = _variance_of_window()
    averaged = (1 - noise.shared) * independent + noise.shared * shared
    with np.errstate(divide="ignore", invalid="ignore"):
        variance = averaged * reference**2 / (factor**2 * confidence)
    variance += (1 - factor**-2) * _observation_sigma(model) ** 2
    return np.where(confidence > 0, np.sqrt(variance), np.nan)


def _knows_noise(model: FusedModel) -> bool:
    """
    Say whether the whole noise is given, or a frame has told by how much it is more than one image shows.

    None tells it of the points whose pose was given, for nobody knows how far that is off, and none of an
    object that turned on its plane, after which the views before it are adjusted, too.
    """
    parameters = model.parameters
    if parameters.depth.noise is not None or parameters.registration.final_distance > 0:
        return True
    return any(frame.num_inliers > 0 and not frame.corrects_earlier for frame in model.frames)


def _observation_sigma(model: FusedModel) -> Array:
    """Return the noise of a pixel that shows each point, in the last frame that saw it (N,) [m]."""
    pose = model.poses[model.last_seen]
    depth = np.einsum("ni,ni->n", model.points - pose[:, :3, 3], pose[:, :3, 2])
    return model.noise_factor * np.asarray(model.noise.sigma(depth))


def _variance_of_window() -> tuple[float, float]:
    """Return the variance of a window's mean times its sum of weights: of independent, of shared errors."""
    side = np.arange(-_WINDOW_RADIUS, _WINDOW_RADIUS + 1)
    pixels = np.stack(np.meshgrid(side, side), axis=-1).reshape(-1, 2)
    weights = np.maximum(1 - (pixels**2).sum(axis=1) / _WINDOW_RADIUS**2, 0) ** 2
    squares = ((pixels[:, None] - pixels[None]) ** 2).sum(axis=2)
    correlation = np.exp(-squares / _CORRELATION_LENGTH**2)
    total = weights.sum()
    return float(weights @ weights / total), float(weights @ correlation @ weights / total)


def _median_sigma(model: FusedModel, world_from_camera: Array) -> float:
    """Return the median noise of what the pixels of a camera see of the model."""
    inside = (model.points - world_from_camera[:3, 3]) @ world_from_camera[:3, :3]
    pixels = np.asarray(model.camera.project(inside), np.float64)
    size = np.array([model.camera.width, model.camera.height])
    with np.errstate(invalid="ignore"):
        seen = (inside[:, 2] > 0) & ((pixels >= 0) & (pixels < size)).all(axis=1)
    if not seen.any():
        return float(model.noise.sigma(float(np.median(np.abs(inside[:, 2])))))
    cells = (pixels[seen] * _CELLS / size.max()).astype(np.int64) @ (1, _CELLS)
    nearest = np.full(_CELLS**2, np.inf)
    np.minimum.at(nearest, cells, inside[seen, 2])
    return float(np.median(np.asarray(model.noise.sigma(nearest[np.isfinite(nearest)]))))
