"""Lenses whose radial distortion is a ratio of polynomials: OpenCV's rational model, the Azure Kinect's."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt


def polynomial_of(k: npt.NDArray[np.float64], radius: float) -> tuple[npt.NDArray[np.float64], float]:
    """
    Bring the rational lens (1 + k1 r^2 + k2 r^4 + k3 r^6) / (1 + k4 r^2 + k5 r^4 + k6 r^6) into Brown's form.

    Least squares in the image, up to a radius there; returns k1 k2 k3 and the largest error [focal lengths].
    """
    r = np.linspace(0, 2, 2001)[1:]
    powers = np.stack([r**2, r**4, r**6], axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):  # a radius that the lens sends to infinity
        seen = r * (1 + powers @ k[:3]) / (1 + powers @ k[3:])
        inside = (seen <= radius) & (np.gradient(seen) > 0)
    terms = (powers * r[:, None])[inside]
    fitted = np.asarray(np.linalg.lstsq(terms, (seen - r)[inside], rcond=None)[0], np.float64)
    return fitted, float(np.abs(terms @ fitted - (seen - r)[inside]).max(initial=0))
