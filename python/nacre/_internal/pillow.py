"""Pillow, which is imported where it is needed."""

from __future__ import annotations

from typing import Any


def import_pillow() -> Any:
    """Return ``PIL.Image``, or say how to install it."""
    try:
        import PIL.Image
    except ImportError as error:
        raise ImportError(
            'PNG and JPEG images need pillow: pip install "nacre[images]"', name="PIL"
        ) from error
    return PIL.Image
