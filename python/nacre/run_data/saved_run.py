"""What a reconstruction wrote to ``OUT/``, read again."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from nacre._internal.arrays import stacked_poses
from nacre.errors import FileFormatError, shown
from nacre.frame_report import STATUSES, count_statuses
from nacre.io.cameras import camera_of
from nacre.io.json_files import read_json
from nacre.run_data.reported_frame import NUMBERS, ReportedFrame

if TYPE_CHECKING:
    from nacre.camera import Camera

Matrix = npt.NDArray[np.float64]


class SavedRun:
    """
    The folder of a reconstruction.

    Parameters
    ----------
    folder : Path
        It holds ``report.json``.

    Attributes
    ----------
    frames : list of ReportedFrame
        In the order in which they came.
    camera : Camera or None
        The recording's camera, where the report names it.

    Raises
    ------
    FileFormatError
        When ``report.json`` is not a report of nacre reconstruct.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        path = folder / "report.json"
        report = read_json(path)
        if not isinstance(report, dict) or not isinstance(report.get("frames"), list):
            raise FileFormatError(path, "not a report of nacre reconstruct")
        self.report: dict[str, Any] = report
        for i, frame in enumerate(report["frames"]):
            wrong = _wrong_in_frame(frame)
            if wrong:
                raise FileFormatError(path, f"not a report of nacre reconstruct: frames[{i}]{wrong}")
        wrong = _wrong_in_report(report)
        if wrong:
            raise FileFormatError(path, f"not a report of nacre reconstruct: {wrong}")
        self.frames = [ReportedFrame.of(frame) for frame in report["frames"]]
        document = (report.get("recording") or {}).get("camera")
        self.camera: Camera | None = None if document is None else camera_of(path, document).camera

    @property
    def poses(self) -> Matrix:
        """(F, 4, 4) ``world_from_camera``; NaN where it is not known."""
        return stacked_poses(frame.world_from_camera for frame in self.frames)

    @property
    def truths(self) -> Matrix | None:
        """(F, 4, 4) true poses, NaN where they are not known; None where none is."""
        poses = stacked_poses(frame.truth for frame in self.frames)
        return poses if np.isfinite(poses).any() else None

    @property
    def truth_from_world(self) -> Matrix | None:
        """What takes the model into the frame of the true poses, by the first frame that has both."""
        for frame in self.frames:
            if frame.truth is not None and frame.world_from_camera is not None:
                pose: Matrix = frame.truth @ np.linalg.inv(frame.world_from_camera)
                return pose
        return None

    @property
    def depth_range(self) -> tuple[float, float]:
        """Outside of which depth was not used [m]; all, where the report does not say."""
        depth = (self.report.get("parameters") or {}).get("depth") or {}
        nearest, farthest = depth.get("min_depth"), depth.get("max_depth")
        return nearest or 0.0, math.inf if farthest is None else farthest

    @property
    def counts(self) -> dict[str, int]:
        """How many frames there are, and how many of each status."""
        counts = {f"num_{status.lower()}": count for status, count in count_statuses(self.frames).items()}
        return {"num_frames": len(self.frames), **counts}


def _wrong_in_report(report: dict[str, Any]) -> str | None:
    """Say what is not as nacre reconstruct writes it, apart from the frames."""
    title, recording = report.get("title"), report.get("recording")
    if title is not None and not isinstance(title, str):
        return f"title must be a text, got {shown(title)}"
    if recording is not None and not isinstance(recording, dict):
        return f"recording must be an object, got {shown(recording)}"
    for name in ("path", "format"):
        value = (recording or {}).get(name)
        if value is not None and not (isinstance(value, str) and "\0" not in value):
            return f"recording.{name} must be a text, got {shown(value)}"
    parameters = report.get("parameters") or {}
    depth = parameters.get("depth") or {} if isinstance(parameters, dict) else None
    if not isinstance(depth, dict):
        return f"parameters must be groups of names and values, got {shown(parameters)}"
    numbers = {f"parameters.depth.{name}": depth.get(name) for name in ("min_depth", "max_depth")}
    numbers["spacing"] = report.get("spacing")
    for name, value in numbers.items():
        if value is not None and not _is_number(value):
            return f"{name} must be a number, got {shown(value)}"
    return None


def _wrong_in_frame(frame: Any) -> str | None:
    """Say what is not as nacre reconstruct writes a frame."""
    if not isinstance(frame, dict):
        return f" must be an object, got {shown(frame)}"
    index, status = frame.get("index"), frame.get("status")
    if type(index) is not int or index < 0:
        return f".index must be a whole number, got {shown(index)}"
    if status not in STATUSES:
        return f".status must be one of {', '.join(STATUSES)}, got {shown(status)}"
    for name in ("world_from_camera", "truth"):
        pose = frame.get(name)
        if pose is not None and not _is_pose(pose):
            return f".{name} must be a rigid 4x4 matrix, got {shown(pose)}"
    for name in NUMBERS:
        value = frame.get(name)
        if value is not None and not _is_number(value):
            return f".{name} must be a number, got {shown(value)}"
    milliseconds = frame.get("milliseconds")
    if milliseconds is None or (
        isinstance(milliseconds, dict) and all(v is None or _is_number(v) for v in milliseconds.values())
    ):
        return None
    return f".milliseconds must be an object of numbers, got {shown(milliseconds)}"


def _is_number(value: Any) -> bool:
    return type(value) in (int, float) and -1e300 < value < 1e300


def _is_pose(value: Any) -> bool:
    try:
        pose = np.array(value, dtype=np.float64)
    except (ValueError, TypeError, OverflowError):
        return False
    if pose.shape != (4, 4) or not np.isfinite(pose).all() or (np.abs(pose[:3, :3]) > 2).any():
        return False
    is_rotation = np.allclose(pose[:3, :3] @ pose[:3, :3].T, np.eye(3), atol=0.01)
    return bool(is_rotation and np.linalg.det(pose[:3, :3]) > 0 and np.allclose(pose[3], (0, 0, 0, 1)))
