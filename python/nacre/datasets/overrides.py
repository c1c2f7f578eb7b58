"""What the caller of ``open_sequence`` says about a recording, over what its files say."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from nacre.camera import Camera
from nacre.errors import UnknownRecordingError
from nacre.io.cameras import read_camera


@dataclass(frozen=True)
class Overrides:
    """The caller's arguments; None where nothing was said."""

    camera: Camera | None = None
    depth_scale: float | None = None
    max_difference: float = 0.02

    def filled_from(self, camera_file: Path) -> Overrides:
        """Return the arguments with what is missing taken from a camera file."""
        if self.camera is not None and self.depth_scale is not None:
            return self
        found = read_camera(camera_file)
        return Overrides(
            self.camera if self.camera is not None else found.camera,
            self.depth_scale if self.depth_scale is not None else found.depth_scale,
            self.max_difference,
        )

    def scale_or(self, default: float) -> float:
        """Return the depth scale, or a format's own."""
        return default if self.depth_scale is None else self.depth_scale

    def required(self, path: Path, hint: str) -> tuple[Camera, float]:
        """Return camera and depth scale, or raise with a hint where they are missing."""
        missing = [n for n, v in (("camera", self.camera), ("depth_scale", self.depth_scale)) if v is None]
        if self.camera is None or self.depth_scale is None:
            raise UnknownRecordingError(path, f"{' and '.join(missing)} not known: {hint}")
        return self.camera, self.depth_scale
