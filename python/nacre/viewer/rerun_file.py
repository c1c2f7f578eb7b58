"""A recording for the Rerun viewer (.rrd): model, cameras, depth images and figures on one time line."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from nacre._internal.kinds import as_kind
from nacre.errors import FileFormatError
from nacre.io.atomic import atomic_path
from nacre.run_data.reported_frame import ReportedFrame
from nacre.viewer.camera_path import make_path
from nacre.viewer.colors import STATUS_COLORS, point_colors
from nacre.viewer.snapshot import Snapshot
from nacre.viewer.timeline import Timeline, words

_MISSING = 'files for Rerun need rerun-sdk: pip install "nacre[rerun]"'
_MOST_DEPTH_IMAGES = 100


def export_rrd(timeline: Timeline, path: str | os.PathLike[str]) -> None:
    """
    Write a timeline for the Rerun viewer: ``rerun FILE`` opens it.

    The world is nacre's: metres, x right, y down, z forward. Depth images, of at most 100 frames, are stored
    in millimetres.

    Parameters
    ----------
    timeline : Timeline
        What is told.
    path : path-like
        The file, usually ``view.rrd``.

    Raises
    ------
    ImportError
        When rerun-sdk is missing, with the command that installs it.
    OSError
        When the file cannot be written.
    """
    as_kind("timeline", timeline, Timeline, "a nacre.viewer.Timeline")
    try:
        import rerun
    except ImportError as error:
        raise ImportError(_MISSING) from error
    rr: Any = rerun
    with atomic_path(path) as temporary:
        _write(rr, temporary, timeline)


def _write(rr: Any, path: Path, timeline: Timeline) -> None:
    recording = rr.RecordingStream("nacre")
    recording.save(str(path))
    recording.send_recording_name(timeline.title)
    recording.log("world", rr.ViewCoordinates.RDF, static=True)
    states = [shape for place, cloud in timeline.snapshots for shape in _shapes(place, cloud)]
    for place, cloud in states:
        if len(states) > 1:
            recording.set_time("frame", sequence=timeline.frames[place].index)
        points = rr.Points3D(cloud.points, colors=point_colors(cloud), radii=0.6 * cloud.spacing)
        recording.log("world/model", points, static=len(states) == 1)
    step = -(-len(timeline.frames) // _MOST_DEPTH_IMAGES)
    for place, frame in enumerate(timeline.frames):
        recording.set_time("frame", sequence=frame.index)
        _log_frame(rr, recording, timeline, frame, place % step == 0)
    path_points = [m.world_from_camera[:3, 3] for m in timeline.frames if m.world_from_camera is not None]
    if make_path(timeline.frames):
        recording.log("world/path", rr.LineStrips3D([np.array(path_points)]), static=True)
    recording.flush()
    recording.disconnect()


def _shapes(place: int, cloud: Snapshot) -> Iterator[tuple[int, Snapshot]]:
    """Yield a state of the model, or each shape that what bends had, with the place of the frame."""
    if cloud.motion is None:
        yield place, cloud
        return
    moments = cloud.motion.moments
    for place in np.flatnonzero((moments % 1 == 0) & (np.diff(moments, prepend=-1) > 0)).tolist():
        yield place, cloud.at(place)


def _log_frame(rr: Any, recording: Any, timeline: Timeline, frame: ReportedFrame, with_depth: bool) -> None:
    """Log the camera of a frame, its depth image, its status and its figures."""
    level = rr.TextLogLevel.WARN if frame.status in ("LOST", "WEAK") else rr.TextLogLevel.INFO
    told = ", ".join(f"{name} {value}" for name, value in words(frame).items())
    reason = f": {frame.reason}" if frame.reason else ""
    text = f"frame {frame.index} {frame.status}{reason}; {told}"
    recording.log("frames", rr.TextLog(text, level=level, color=STATUS_COLORS[frame.status]))
    for name, pose in (("camera", frame.world_from_camera), ("truth", frame.truth)):
        if pose is None:
            recording.log(f"world/{name}", rr.Clear(recursive=True))
            continue
        recording.log(f"world/{name}", rr.Transform3D(translation=pose[:3, 3], mat3x3=pose[:3, :3]))
        camera = timeline.camera
        if camera is not None and camera.model == "pinhole":
            matrix = [[camera.fx, 0, camera.cx], [0, camera.fy, camera.cy], [0, 0, 1]]
            pinhole = rr.Pinhole(
                image_from_camera=matrix, resolution=[camera.width, camera.height],
                camera_xyz=rr.ViewCoordinates.RDF, image_plane_distance=0.1,
            )  # fmt: skip
            recording.log(f"world/{name}", pinhole)
    if with_depth and timeline.depth_of is not None and frame.world_from_camera is not None:
        try:
            depth = timeline.depth_of(frame.index)
        except (FileFormatError, OSError):
            return
        stored = np.rint(np.clip(np.nan_to_num(1000 * depth), 0, 65535)).astype(np.uint16)
        recording.log("world/camera/depth", rr.DepthImage(stored, meter=1000.0))
