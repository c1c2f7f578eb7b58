"""What became of the frames of a model."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, Protocol, overload

import numpy as np
import numpy.typing as npt

from nacre._internal.core_options import mirrored
from nacre._internal.value_equality import Value
from nacre.depth import DepthReport
from nacre.region import RegionReport

if TYPE_CHECKING:
    import threading

STATUSES = ("TRACKED", "WEAK", "LOST", "RELOCALISED")


@dataclass(frozen=True)
class DeformationReport:
    """
    How a model that deforms is at a frame; zeros where it does not.

    Attributes
    ----------
    num_nodes : int
        Of the warp field.
    explained : float
        Part of the model's points in view that the frame shows where they were bent to.
    strain : float
        Root mean square of how much the distances of neighbouring nodes changed, as a part of them.
    """

    num_nodes: int = 0
    explained: float = 0.0
    strain: float = 0.0


@dataclass(frozen=True, eq=False, repr=False)
class FrameReport(Value):
    """
    What became of one frame.

    Attributes
    ----------
    index : int
        Number of the frame, from 0.
    timestamp : float or None
        As given [s].
    status : str
        TRACKED: registered and fused. WEAK: registered, but the data leaves a direction of the pose open;
        not fused. LOST: not registered, the model is as it was. RELOCALISED: registered again after being
        lost.
    reason : str
        Why the frame is weak or lost; empty otherwise.
    world_from_camera : (4, 4) float64
        The camera's pose; of a lost frame the last known one. Where a later frame corrects earlier ones, the
        reports in ``Model.frames`` have what is known then.
    num_inliers, overlap, rmse, center, information, weak_directions
        Of the registration; see :class:`nacre.AlignResult`. The target is the model, its frame the world.
    consistency : float
        Part of the model's points in view that the frame does not see through.
    score : float
        The registration score, that the pose is right, against chance: what the residuals tell a match, times
        overlap^2 and consistency^4 (consistency^12 far from all guesses); less where residuals of neighbours
        agree beyond what noise explains. Unrelated surfaces seldom reach 0.3; good registrations have 0.35 to
        3, those of an object that turned far on its plane less.
    probability : float
        That the registration is right, by its score; of a lost frame, that the best one was, which was not
        taken. 0.9 of all views that the search on the plane found, on which an object was turned. NaN where
        the pose came without a registration, as the first frame's.
    loop_frame : int or None
        The earlier frame that this one closed a loop with: model and poses were corrected.
    loop_distance : float
        Between the surfaces that the two saw, before the correction [m].
    corrects_earlier : bool
        Whether it changed reports of earlier frames: a loop was closed, the views of an object adjusted, or
        the model begun anew.
    depth : DepthReport
        Pixels that were removed, by reason.
    region : RegionReport
        What was left out of the rest.
    num_moving : int
        Pixels that were left out after that, since what they show moved before the scene, or came along with
        the camera.
    num_updated, num_inserted, num_removed : int
        Points of the model that the frame moved, added and removed.
    deformation : DeformationReport
        How the model is bent, where it deforms.
    num_points : int
        Points of the model after the frame.
    spacing : float
        Of the model's points [m].
    milliseconds : dict
        Wall time by step of the loop, and "total".
    """

    index: int
    timestamp: float | None
    status: str
    reason: str
    world_from_camera: npt.NDArray[np.float64]
    num_inliers: int
    overlap: float
    consistency: float
    score: float
    probability: float
    rmse: float
    center: npt.NDArray[np.float64]
    information: npt.NDArray[np.float64]
    weak_directions: npt.NDArray[np.float64]
    loop_frame: int | None
    loop_distance: float
    corrects_earlier: bool
    depth: DepthReport
    region: RegionReport
    num_moving: int
    num_updated: int
    num_inserted: int
    num_removed: int
    deformation: DeformationReport
    num_points: int
    spacing: float
    milliseconds: dict[str, float]

    @property
    def tracked(self) -> bool:
        """Whether the camera's pose is known: every status but LOST."""
        return self.status != "LOST"

    @property
    def removed(self) -> dict[str, int]:
        """Measured pixels that were not used, by reason."""
        depth = {name.removeprefix("num_"): number for name, number in asdict(self.depth).items()}
        for name in ("pixels", "invalid", "kept"):
            del depth[name]
        return {**depth, "outside": self.region.num_outside, "moving": self.num_moving}

    def as_dict(self) -> dict[str, Any]:
        """Return every figure but ``information`` under its name; reports in it as dictionaries."""
        figures = asdict(self) | {"removed": self.removed}
        del figures["information"]
        return figures

    def __repr__(self) -> str:
        reason = f" ({self.reason})" if self.reason else ""
        return (
            f"FrameReport(index={self.index}, {self.status}{reason}, overlap={self.overlap:.2f}, "
            f"num_points={self.num_points}, {self.milliseconds['total']:.1f} ms)"
        )


def report_from(core: Any) -> FrameReport:
    """Return the report that C++ made."""
    depth, region = mirrored(DepthReport, core.depth), mirrored(RegionReport, core.region)
    deformation = mirrored(DeformationReport, core.deformation)
    return mirrored(FrameReport, core, depth=depth, region=region, deformation=deformation)


class _HasStatus(Protocol):
    @property
    def status(self) -> str: ...


def count_statuses(frames: Iterable[_HasStatus]) -> dict[str, int]:
    """Return how many frames have each status."""
    found = Counter(frame.status for frame in frames)
    return {status: found[status] for status in STATUSES}


class FrameReports(Sequence[FrameReport]):
    """
    The reports of a model's frames up to now, oldest first.

    As a tuple of them, except that each is made when it is asked for. Two are equal when their reports are;
    pickled, they become a tuple.
    """

    def __init__(self, core: Any, lock: threading.RLock, count: int) -> None:
        self._core = core
        self._lock = lock
        self._count = count

    def __len__(self) -> int:
        return self._count

    @overload
    def __getitem__(self, index: int) -> FrameReport: ...
    @overload
    def __getitem__(self, index: slice) -> tuple[FrameReport, ...]: ...
    def __getitem__(self, index: int | slice) -> FrameReport | tuple[FrameReport, ...]:
        place = range(self._count)[index]
        if isinstance(place, range):
            return tuple(self[i] for i in place)
        with self._lock:
            return report_from(self._core.report(place))

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, FrameReports | tuple):
            return NotImplemented
        return tuple(self) == tuple(other)

    def __hash__(self) -> int:
        raise TypeError("reports of frames have no hash")

    def __reduce__(self) -> Any:
        return tuple, (list(self),)

    def __repr__(self) -> str:
        return f"FrameReports({self._count} frames)"
