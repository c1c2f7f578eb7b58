"""How noisy depth is: models of sensors, and measuring one from its images."""

from __future__ import annotations

import numbers
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Literal, overload

import numpy as np
import numpy.typing as npt

from nacre import _core
from nacre._internal.arrays import as_camera, as_count, as_depth, as_number, as_real
from nacre._internal.core_options import TypedFields, mirrored, to_core
from nacre._internal.guided import guided
from nacre._internal.kinds import as_items

NoiseName = Literal["auto", "kinect", "stereo", "tof"]


@dataclass(frozen=True)
class NoiseModel(TypedFields):
    """
    The standard deviation of a depth value: ``sigma(z) = constant + quadratic * (z - offset) ** 2``.

    It is that of a surface seen from the front. On a slanted one the depth is noisier, since pixels also err
    to the side [1]_; across the surface the two effects of the slant cancel.

    Parameters
    ----------
    constant, offset : float
        [m].
    quadratic : float
        [1/m].
    shared : float
        Part of the variance that pixels near each other have in common, from 0 to below 1. Structured light
        and stereo match windows, so that their images look smoother than they are right. A simulated camera
        ignores it.

    References
    ----------
    .. [1] C. V. Nguyen, S. Izadi, D. Lovell: Modeling Kinect sensor noise for improved 3D reconstruction and
       tracking. 3DIMPVT 2012.
    """

    constant: float = 0.0
    quadratic: float = 0.0
    offset: float = 0.0
    shared: float = 0.0

    @overload
    def sigma(self, z: float) -> float: ...
    @overload
    def sigma(self, z: npt.NDArray[Any]) -> npt.NDArray[Any]: ...
    def sigma(self, z: float | npt.NDArray[Any]) -> float | npt.NDArray[Any]:
        """Return the standard deviation at depth ``z``, both in metres."""
        depth = as_real("z", z)
        with np.errstate(over="ignore", invalid="ignore"):
            sigma = self.constant + self.quadratic * (depth - self.offset) ** 2
        return sigma if depth.ndim else float(sigma)

    def local(self) -> NoiseModel:
        """Return the noise about a smooth surface fitted to 7 x 7 pixels, without most of what they share."""
        return mirrored(type(self), self.to_core().local())

    @classmethod
    def kinect(cls) -> NoiseModel:
        """Return that of structured light, Nguyen et al. 2012: 1.2 mm + 1.9 mm (z - 0.4 m)^2."""
        return mirrored(cls, _core.NoiseModel.kinect())

    @classmethod
    def stereo(cls, fx: float, baseline: float = 0.05, disparity_sigma: float = 0.08) -> NoiseModel:
        """
        Return that of two cameras: ``disparity_sigma z^2 / (fx baseline)``.

        Parameters
        ----------
        fx : float
            Focal length [pixels].
        baseline : float
            Between the cameras [m].
        disparity_sigma : float
            Of the match [pixels]. The defaults are those of a RealSense D435 on good texture.

        Returns
        -------
        NoiseModel
        """
        return mirrored(
            cls,
            _core.NoiseModel.stereo(
                as_number("fx", fx),
                as_number("baseline", baseline),
                as_number("disparity_sigma", disparity_sigma),
            ),
        )

    @classmethod
    def time_of_flight(cls) -> NoiseModel:
        """Return that of time of flight, Fankhauser et al. 2015: 1.5 mm - 0.5 mm z + 0.3 mm z^2."""
        return mirrored(cls, _core.NoiseModel.time_of_flight())

    def to_core(self) -> Any:
        """Return the C++ model with these values."""
        return to_core(self, _core.NoiseModel())


Noise = NoiseModel | float | NoiseName | None


def as_noise(name: str, value: Noise, camera: _core.Camera | None = None) -> NoiseModel | None:
    """Return a noise argument as a model: a number is a constant [m]; None and "auto" are None: measured."""
    choice = as_noise_choice(name, value)
    if choice is None or isinstance(choice, NoiseModel):
        return choice
    if choice == "stereo":
        if camera is None or camera.model != "pinhole":
            raise ValueError(f"{name}='stereo' needs a pinhole camera, got {camera!r}")
        return NoiseModel.stereo(camera.fx)
    return NoiseModel.kinect() if choice == "kinect" else NoiseModel.time_of_flight()


def as_noise_choice(name: str, value: Noise) -> NoiseModel | NoiseName | None:
    """Return a noise argument as a model, or as the name of one for which the camera is still to come."""
    expected = f"{name} must be a NoiseModel, a number of metres, 'auto', 'kinect', 'stereo', 'tof' or None"
    if value is None or isinstance(value, NoiseModel):
        return value
    if isinstance(value, str):
        if value not in ("auto", "kinect", "stereo", "tof"):
            raise ValueError(f"{expected}, got {value!r}")
        return None if value == "auto" else value
    if isinstance(value, bool) or not isinstance(value, numbers.Real):
        raise TypeError(f"{expected}, got {type(value).__name__}")
    return NoiseModel(constant=as_number(name, value))


@guided()
def estimate_noise(
    depth: npt.ArrayLike, camera: _core.Camera, *, depth_scale: float = 1.0, num_threads: int = 0
) -> NoiseModel:
    """
    Return the noise of a depth image, measured from the residuals of local surface fits.

    Where neighbouring pixels are too alike for independent noise, as behind matching windows, what they share
    is added: it stays in the model's points however many pixels are averaged.

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
    TypeError, ValueError
        An argument of the wrong type, shape or range; depth and camera differ in size.
    """
    return mirrored(
        NoiseModel,
        _core.estimate_noise(
            as_depth("depth", depth, depth_scale),
            as_camera("camera", camera),
            as_count("num_threads", num_threads),
        ),
    )


@guided()
def calibrate_noise(
    images: Iterable[npt.ArrayLike],
    camera: _core.Camera,
    *,
    depth_scale: float = 1.0,
    num_threads: int = 0,
) -> NoiseModel:
    """
    Return the noise of a sensor, measured from several images of a recording.

    What :func:`estimate_noise` finds in each image is pooled, and for a pinhole camera the curve over depth
    is measured too, where the images show several depths. A :class:`Model` without given noise does the same
    with its frames.

    Parameters
    ----------
    images : iterable of (H, W) arrays
        Depth images in units of 1 / ``depth_scale`` metres.
    camera : Camera
        Of all images.
    depth_scale : float
        Stored units per metre.
    num_threads : int
        0 uses every processor. The result does not depend on it.

    Returns
    -------
    noise : NoiseModel
        Without images what :func:`estimate_noise` returns for an image without smooth patches.

    Raises
    ------
    TypeError, ValueError
        An argument of the wrong type, shape or range; a depth image and the camera differ in size.
    """
    calibration = _core.NoiseCalibration(as_camera("camera", camera))
    threads = as_count("num_threads", num_threads)
    for image in as_items("images", images):
        calibration.add(as_depth("images", image, depth_scale), threads)
    return mirrored(NoiseModel, calibration.model())
