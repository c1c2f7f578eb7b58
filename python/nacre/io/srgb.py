"""Colours as screens have them (sRGB, IEC 61966-2-1) and as light adds up (linear)."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt


def linear_from_srgb(colors: npt.NDArray[np.uint8]) -> npt.NDArray[np.float32]:
    """Return linear light from 0 to 1."""
    encoded = np.arange(256) / 255.0
    linear = np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
    return linear.astype(np.float32)[colors]


def srgb_from_linear(linear: npt.NDArray[np.floating]) -> npt.NDArray[np.uint8]:
    """Return the nearest colours of 8 bits; what is outside 0 to 1 becomes the nearer end."""
    light = np.clip(linear.astype(np.float64), 0, 1)
    encoded = np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)
    return np.asarray(np.rint(255 * encoded), np.uint8)
