"""Colours that people with any colour vision can tell apart."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

# Viridis (van der Walt and Smith, public domain), nine of its 256 colours.
_VIRIDIS = np.array(
    [
        (68, 1, 84),
        (71, 44, 122),
        (59, 81, 139),
        (44, 113, 142),
        (33, 144, 141),
        (39, 173, 129),
        (92, 200, 99),
        (170, 220, 50),
        (253, 231, 37),
    ],
    dtype=np.float64,
)

# Okabe and Ito 2008, in the order in which charts use them.
CATEGORIES = ("#0072b2", "#e69f00", "#009e73", "#cc79a7", "#56b4e9", "#d55e00", "#8c8c8c")

_REASON_COLORS = {
    "edge": 5,
    "slanted": 1,
    "isolated": 3,
    "out_of_range": 0,
    "masked": 4,
    "outside": 2,
    "removed": 5,
}


def viridis(values: npt.ArrayLike) -> npt.NDArray[np.uint8]:
    """Return the colours (N, 3) of values between 0 and 1."""
    position = np.clip(np.asarray(values, dtype=np.float64), 0, 1) * (len(_VIRIDIS) - 1)
    steps = np.arange(len(_VIRIDIS))
    return (
        np.stack([np.interp(position, steps, channel) for channel in _VIRIDIS.T], axis=-1)
        .round()
        .astype(np.uint8)
    )


def category_rgb(index: int) -> npt.NDArray[np.uint8]:
    """Return a colour of :data:`CATEGORIES` as three bytes."""
    return np.frombuffer(bytes.fromhex(CATEGORIES[index % len(CATEGORIES)][1:]), dtype=np.uint8)


def reason_color(name: str, index: int) -> int:
    """Return the index of the colour that stands for a reason to remove pixels."""
    return _REASON_COLORS.get(name, index)
