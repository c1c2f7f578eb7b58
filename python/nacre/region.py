"""Region of interest: which part of a depth image is modelled."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal, overload

import numpy as np
import numpy.typing as npt

from nacre import _core
from nacre._internal.arrays import as_camera, as_count, as_depth, as_flag, as_mask
from nacre._internal.core_options import mirrored, to_core, updated
from nacre._internal.guided import guided
from nacre._internal.value_equality import Value
from nacre.noise import Noise, as_noise
from nacre.parameters import RegionParameters

Mask = npt.NDArray[np.bool_]


@dataclass(frozen=True, eq=False, repr=False)
class RegionReport(Value):
    """
    What was left out of a frame.

    Attributes
    ----------
    num_inside, num_outside : int
        Pixels with a point.
    planes : (P, 4) float64
        The planes that were put aside, largest first: unit normal towards the camera and offset [m], so that
        ``normal . point = offset`` in the camera's frame.
    support : int
        The row of ``planes`` that the thing stands on; -1 where there is none.
    reason : str
        Why nothing is inside; empty otherwise.
    """

    num_inside: int
    num_outside: int
    planes: npt.NDArray[np.float64]
    support: int
    reason: str


@overload
def select_region(
    depth: npt.ArrayLike,
    camera: _core.Camera,
    *,
    depth_scale: float = ...,
    previous: npt.ArrayLike | None = ...,
    noise: Noise = ...,
    return_report: Literal[False] = ...,
    num_threads: int = ...,
    **changes: Any,
) -> Mask: ...
@overload
def select_region(
    depth: npt.ArrayLike,
    camera: _core.Camera,
    *,
    depth_scale: float = ...,
    previous: npt.ArrayLike | None = ...,
    noise: Noise = ...,
    return_report: Literal[True],
    num_threads: int = ...,
    **changes: Any,
) -> tuple[Mask, RegionReport]: ...
@guided()
def select_region(
    depth: npt.ArrayLike,
    camera: _core.Camera,
    *,
    depth_scale: float = 1.0,
    previous: npt.ArrayLike | None = None,
    noise: Noise = None,
    return_report: bool = False,
    num_threads: int = 0,
    **changes: Any,
) -> Mask | tuple[Mask, RegionReport]:
    """
    Return the pixels of a depth image that belong to a region of interest.

    With ``object=True``, planes on which things stand are found and put aside with all that lies behind them:
    large planes that other surfaces rise from, as from tables, floors and walls, and not the faces of a box,
    which fall off. Of the connected things that remain and stand on such a plane the largest is taken, or the
    one that ``previous`` shows. Where there is no such plane, the largest thing is taken.

    Parameters
    ----------
    depth : (H, W) array
        Depth image in units of 1 / ``depth_scale`` metres, best a cleaned one (:func:`preprocess_depth`).
    camera : Camera
        The camera of the image.
    depth_scale : float
        Stored units per metre.
    previous : (H, W) array, optional
        The mask of the last frame, so that the choice does not jump.
    noise : NoiseModel, float, "kinect" or None
        The noise of the depth; a number is a constant standard deviation [m]; None measures it from the
        image.
    return_report : bool
        Also return a :class:`RegionReport`.
    num_threads : int
        0 uses every processor. The result does not depend on it.
    **changes
        Fields of :class:`RegionParameters`:

        min_x, max_x, min_y, max_y, min_z, max_z : float
            A box in the camera's frame [m]: x right, y down, z forward. For a camera that stands still before
            a turning object; with ``object``, the thing within the box.
        object : bool
            Only the largest thing that stands on a plane.
        min_object : float
            Things of a smaller part of the image's pixels are none.
        plane_margin : float
            So near to a plane a point belongs to it [m]; 0: from the noise and the pixels.

    Returns
    -------
    mask : (H, W) bool
        True inside of the region, where there is a measurement. All False where nothing is inside; the report
        says why.
    report : RegionReport
        If ``return_report``.

    Raises
    ------
    TypeError, ValueError
        An argument of the wrong type, shape or range; depth, camera or ``previous`` differ in size; an
        option is out of its range or does not exist.
    """
    image = as_depth("depth", depth, depth_scale)
    wants_report = as_flag("return_report", return_report)
    model = as_noise("noise", noise, as_camera("camera", camera))
    mask, report = _core.select_region(
        image,
        camera,
        to_core(updated(RegionParameters(), changes), _core.RegionOptions()),
        as_mask("previous", previous, (image.shape[0], image.shape[1])),
        None if model is None else model.to_core(),
        as_count("num_threads", num_threads),
    )
    selected: Mask = mask != 0
    return (selected, mirrored(RegionReport, report)) if wants_report else selected
