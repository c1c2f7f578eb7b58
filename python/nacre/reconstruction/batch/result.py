"""What became of one recording of a batch."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from nacre.reconstruction.batch.sources import thumbnail_path

if TYPE_CHECKING:
    from nacre.run_data.saved_run import SavedRun

Outcome = Literal["reconstructed", "resumed", "finished before", "failed", "not done"]


@dataclass(frozen=True)
class BatchResult:
    """
    What became of one recording of :func:`nacre.batch`.

    Attributes
    ----------
    name : str
        Of the recording, and of its folder.
    source : str
        The recording's path.
    folder : Path
        What ``nacre reconstruct`` writes is here.
    outcome : str
        "reconstructed"; "resumed", where an earlier batch had begun it; "finished before"; "failed", and
        ``message`` says why; or "not done", where the batch ended before.
    message : str
        What is wrong; empty where nothing is.
    level, verdict : str
        Of the report: "ok", "weak" or "lost", and the sentence.
    num_frames, num_tracked : int
        How many frames were used, and how many of them tracked.
    trajectory_error : float or None
        RMSE of the camera's path against the true one [m]; None where nobody knows that.
    frame_seconds : float or None
        How long the frames took [s]; opening the recording and writing the results is not counted.
    has_page, has_thumbnail : bool
        Whether the folder holds ``report.html``, and whether there is a picture of the model.
    """

    name: str
    source: str
    folder: Path
    outcome: Outcome = "not done"
    message: str = ""
    level: str = ""
    verdict: str = ""
    num_frames: int = 0
    num_tracked: int = 0
    trajectory_error: float | None = None
    frame_seconds: float | None = None
    has_page: bool = False
    has_thumbnail: bool = False

    @property
    def has_results(self) -> bool:
        """Whether the folder holds a finished reconstruction."""
        return self.outcome in ("reconstructed", "resumed", "finished before")

    def as_dict(self) -> dict[str, Any]:
        """Return it as ``index.json`` has it."""
        return dataclasses.asdict(self) | {"folder": self.folder.name}


def failed(result: BatchResult, message: str) -> BatchResult:
    """Return the result of a recording that failed."""
    return dataclasses.replace(result, outcome="failed", message=message)


def finished(result: BatchResult, run: SavedRun, outcome: Outcome, min_tracked: float) -> BatchResult:
    """Return the result with what the report of a finished reconstruction says."""
    num_tracked, total = sum(frame.is_tracked for frame in run.frames), len(run.frames)
    too_few = num_tracked < min_tracked * total
    verdict, error = run.report.get("verdict"), run.report.get("absolute_trajectory_error")
    times = [frame.total_milliseconds for frame in run.frames]
    return dataclasses.replace(
        result,
        outcome=outcome,
        message=f"only {num_tracked} of {total} frames were tracked" if too_few else "",
        level=verdict["level"] if verdict else "",
        verdict=verdict["sentence"] if verdict else "",
        num_frames=total,
        num_tracked=num_tracked,
        trajectory_error=error["rmse"] if error else None,
        frame_seconds=sum(time for time in times if time is not None) / 1000,
        has_page=(result.folder / "report.html").is_file(),
        has_thumbnail=thumbnail_path(result.folder).is_file(),
    )
