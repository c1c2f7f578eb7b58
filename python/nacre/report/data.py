"""What a report is made of."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt


@dataclass(frozen=True, eq=False)
class FrameEntry:
    """What became of one frame. Figures that are not known are None and left out of the page."""

    index: int
    status: str  #: TRACKED, WEAK, LOST or RELOCALISED
    reason: str = ""  #: why it is weak or lost
    milliseconds: Mapping[str, float] = field(default_factory=dict)  #: of each step; "total" may contain more
    num_inliers: int | None = None
    overlap: float | None = None  #: part of the frame that matches the model
    rmse: float | None = None  #: of the registration [m]
    world_from_camera: npt.NDArray[np.float64] | None = None  #: None where the frame was not tracked
    truth: npt.NDArray[np.float64] | None = None  #: true world_from_camera, in any world frame
    translation_error: float | None = None  #: [m]; worked out from the poses where no frame has it
    rotation_error: float | None = None  #: [rad]; likewise
    num_points: int | None = None  #: of the model, after the frame
    consistency: float | None = None  #: of what is in view, the part that nothing was seen through
    evidence: float | None = None  #: that the registration is right
    num_pixels: int | None = None  #: of the depth image
    num_measured: int | None = None  #: pixels with a depth
    removed: Mapping[str, int] = field(default_factory=dict)  #: measured pixels that were not used, by reason
    num_updated: int | None = None  #: points of the model that the frame moved
    num_inserted: int | None = None  #: and that it added
    loop_frame: int | None = None  #: the earlier frame that this one closed a loop with


@dataclass(frozen=True, eq=False)
class ModelCloud:
    """The model, in the first camera's frame (x right, y down, z forward)."""

    points: npt.NDArray[np.floating[Any]]  #: (N, 3) [m]
    normals: npt.NDArray[np.floating[Any]] | None = None
    colors: npt.NDArray[np.uint8] | None = None
    confidence: npt.NDArray[Any] | None = None  #: (N,), in frontal observations


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
    frames: Sequence[FrameEntry] = ()
    model: ModelCloud | None = None
    depth: Sequence[DepthExample] = ()
    evaluation: Mapping[str, Any] = field(default_factory=dict)  #: heading -> a result of nacre.evaluation
    figures: Mapping[str, Any] = field(default_factory=dict)  #: further figures, name -> number or text
    parameters: Mapping[str, Any] = field(default_factory=dict)  #: name -> value, or a group of them
    interrupted: bool = False  #: whether it was stopped before the last frame
