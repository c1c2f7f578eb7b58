"""How a model that deforms was bent, over all frames of a run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from nacre.report.limits import LEAST_STRAIN
from nacre.run_data.reported_frame import ReportedFrame


@dataclass(frozen=True)
class DeformationFigures:
    """The warp of a model that deforms, of tracked frames."""

    num_nodes: int  #: of the warp field, at the end
    num_bent: int  #: frames at which the shape is another than the canonical one
    explained: float | None  #: median part of the points in view that a frame shows where they were bent to
    strain_median: float  #: root mean square change of distances between neighbouring nodes, as a part
    strain_max: float  #: the same at the frame where it is largest

    @property
    def is_bent(self) -> bool:
        """Whether the shape was ever another: else the model is the rigid one."""
        return self.num_bent > 0


def deformation_figures(frames: Sequence[ReportedFrame]) -> DeformationFigures | None:
    """Return how a model was bent; None where it has no warp field."""
    tracked = [frame for frame in frames if frame.is_tracked and frame.may_be_bent]
    if not tracked:
        return None
    strains = [_of(frame, "strain") for frame in tracked]
    explained = [share for frame in tracked if (share := explained_part(frame)) is not None]
    return DeformationFigures(
        num_nodes=max(int(_of(frame, "num_nodes")) for frame in tracked),
        num_bent=sum(strain > LEAST_STRAIN for strain in strains),
        explained=float(np.median(explained)) if explained else None,
        strain_median=float(np.median(strains)),
        strain_max=max(strains),
    )


def explained_part(frame: ReportedFrame) -> float | None:
    """Return the part of the points in view that a frame shows where they were bent to, where it is known."""
    is_registered = frame.is_tracked and frame.num_inliers and frame.may_be_bent
    return _of(frame, "explained") if is_registered else None


def _of(frame: ReportedFrame, name: str) -> float:
    figures: dict[str, Any] = frame.deformation or {}
    return float(figures.get(name) or 0.0)
