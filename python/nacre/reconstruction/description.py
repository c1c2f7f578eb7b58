"""Recordings and cameras in words, and in figures."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from nacre.camera import Camera
    from nacre.datasets import Sequence


def describe(sequence: Sequence, indices: range) -> str:
    """Return in words where the frames come from."""
    step = f", every {indices.step} frames" if indices.step > 1 else ""
    part = "" if len(indices) == len(sequence) else f" (frames {indices[0]} to {indices[-1]}{step})"
    truth = ", with true poses" if sequence.truth is not None else ""
    return (
        f"{len(indices)} of {len(sequence)} frames{part}, {sequence.format} format, "
        f"{describe_camera(sequence.camera)}{truth}"
    )


def describe_camera(camera: Camera) -> str:
    """Return a camera in words."""
    size = f"{camera.model} camera {camera.width} x {camera.height}"
    if camera.model == "orthographic":
        return f"{size}, {1000 * camera.pixel_size:g} mm per pixel"
    return f"{size}, fx {camera.fx:g}, fy {camera.fy:g}"


def describe_recording(sequence: Sequence) -> dict[str, Any]:
    """Return what report.json says about the recording."""
    camera = sequence.camera
    names: tuple[str, ...] = ("model", "width", "height", "pixel_size")
    if camera.model != "orthographic":
        names = ("model", "width", "height", "fx", "fy", "cx", "cy", "distortion", "depth")
    return {
        "path": str(sequence.path),
        "name": sequence.name,
        "format": sequence.format,
        "num_frames": len(sequence),
        "camera": {name: getattr(camera, name) for name in names},
        "depth_scale": sequence.depth_scale,
        "color": sequence.has_color,
        "truth": sequence.truth is not None,
    }
