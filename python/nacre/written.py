"""What a reconstruction wrote to ``OUT/``, read again."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from nacre.errors import FileFormatError

if TYPE_CHECKING:
    from nacre import Camera

Matrix = npt.NDArray[np.float64]


class Written:
    """
    The folder of a reconstruction.

    Parameters
    ----------
    folder : Path
        It holds ``report.json``.

    Raises
    ------
    FileFormatError
        When ``report.json`` is not a report of nacre reconstruct.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        path = folder / "report.json"
        try:
            self.report: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
            frames = self.report["frames"]
            good = isinstance(frames, list)
        except (ValueError, KeyError, TypeError):
            good = False
        if not good:
            raise FileFormatError(path, "not a report of nacre reconstruct")
        self.frames: list[dict[str, Any]] = frames

    @property
    def poses(self) -> Matrix:
        """(F, 4, 4) ``world_from_camera``; NaN where it is not known."""
        return self._stacked("world_from_camera")

    @property
    def truths(self) -> Matrix | None:
        """(F, 4, 4) true poses, NaN where they are not known; None where none is."""
        poses = self._stacked("truth")
        return poses if np.isfinite(poses).any() else None

    @property
    def camera(self) -> Camera | None:
        """The recording's camera, where the report names it."""
        from nacre.io.cameras import camera_of

        document = (self.report.get("recording") or {}).get("camera")
        return None if document is None else camera_of(self.folder / "report.json", document).camera

    @property
    def truth_from_world(self) -> Matrix | None:
        """What takes the model into the frame of the true poses, by the first frame that has both."""
        for frame in self.frames:
            if frame["truth"] is not None and frame["world_from_camera"] is not None:
                pose: Matrix = np.array(frame["truth"]) @ np.linalg.inv(frame["world_from_camera"])
                return pose
        return None

    @property
    def counts(self) -> dict[str, int]:
        """How many frames there are, and how many of each status."""
        from nacre.run_state import STATUSES

        found = [frame.get("status") for frame in self.frames]
        return {"num_frames": len(found), **{f"num_{s.lower()}": found.count(s) for s in STATUSES}}

    def _stacked(self, name: str) -> Matrix:
        missing = np.full((4, 4), np.nan)
        poses = [missing if frame.get(name) is None else frame[name] for frame in self.frames]
        return np.array(poses, dtype=np.float64).reshape(-1, 4, 4)
