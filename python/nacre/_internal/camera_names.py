"""Live cameras by the names that the command line gives them."""

from __future__ import annotations

from pathlib import Path
from typing import Literal, cast, get_args

CameraKind = Literal["realsense", "opencv", "openni", "orbbec", "ros2"]
CAMERAS = (
    "realsense, openni, orbbec or opencv, where there are several as realsense:SERIAL or openni:INDEX; "
    "ros2:/DEPTH/TOPIC or ros2:/DEPTH/TOPIC,/COLOUR/TOPIC"
)


def is_camera(source: Path) -> bool:
    """Say whether a source is a live camera, and not a file of that name."""
    return str(source).partition(":")[0] in get_args(CameraKind) and not source.exists()


def kind_of(source: Path) -> tuple[CameraKind, str]:
    """Return the kind of a live camera, and which of them it is."""
    kind, _, which = str(source).partition(":")
    return cast("CameraKind", kind), which
