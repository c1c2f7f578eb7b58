"""What a report is made of."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.camera import Camera
from nacre.report.doubled_surfaces import DoubledSurfaces
from nacre.report.limits import MIN_TRACKED
from nacre.run_data.reported_frame import ReportedFrame


@dataclass(frozen=True, eq=False)
class ModelCloud:
    """The model, in the first camera's frame (x right, y down, z forward)."""

    points: npt.NDArray[np.floating[Any]]  #: (N, 3) [m]
    normals: npt.NDArray[np.floating[Any]] | None = None
    colors: npt.NDArray[np.uint8] | None = None
    confidence: npt.NDArray[Any] | None = None  #: (N,), in frontal observations
    sigma: npt.NDArray[np.floating[Any]] | None = None  #: (N,) expected standard deviation [m]


@dataclass(frozen=True, eq=False)
class DepthExample:
    """One depth image before and after noise was removed."""

    before: npt.NDArray[np.floating[Any]]  #: (H, W) [m]; not finite or not positive: no measurement
    after: npt.NDArray[np.floating[Any]]  #: (H, W) [m]; NaN where removed
    reasons: npt.NDArray[np.integer[Any]] | None = (
        None  #: (H, W); i > 0: removed because of reason_names[i - 1]
    )
    reason_names: Sequence[str] = ()
    index: int = 0  #: of the frame
    note: str = ""  #: why this one is shown


@dataclass(frozen=True, eq=False)
class ReportData:
    """Everything that a report shows; whatever is missing is left out of the page."""

    title: str
    source: str = ""  #: where the frames come from, in words
    frames: Sequence[ReportedFrame] = ()
    camera: Camera | None = None  #: of every frame
    model: ModelCloud | None = None
    depth: Sequence[DepthExample] = ()
    evaluation: Mapping[str, Any] = field(default_factory=dict)  #: heading -> a result of nacre.evaluation
    figures: Mapping[str, Any] = field(default_factory=dict)  #: further figures, name -> number or text
    parameters: Mapping[str, Any] = field(default_factory=dict)  #: name -> value, or a group of them
    interrupted: bool = False  #: whether it was stopped before the last frame
    doubled: DoubledSurfaces | None = None  #: of the model; None where nobody looked
    num_dropped: int = 0  #: frames that came faster than they could be registered
    camera_doubt: str = ""  #: what the frames say is wrong with the camera as it was given
    animation: str = ""  #: where the model as it moved is, relative to the page; empty where nowhere
    min_tracked: float = MIN_TRACKED  #: part of the frames; with less the run has failed
