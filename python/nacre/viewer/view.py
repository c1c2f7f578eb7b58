"""From where to look at a model, and how a file says so."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

_SIZES = {"target": 3, "direction": 3, "up": 3, "radius": 1}
_COMMENT = re.compile(
    "first view: " + ", ".join(rf"{name} ((?:\S+ ){{{n - 1}}}[^\s,]+)" for name, n in _SIZES.items())
)
_LEAST_LENGTH = 0.5  # [1] of what should be a unit vector
_LEAST_ACROSS = 0.1  # [1] of the upward one, to the direction of sight
_LARGEST = 1e9  # [m] so that no sum of squares overflows


class View(NamedTuple):
    """
    From where to look: all in the world frame.

    Attributes
    ----------
    target : (3,) array
        What is in the middle [m].
    direction, up : (3,) array
        Unit vectors: from the target to the eye, and upwards.
    radius : float
        Of a sphere about the target that should be in the picture [m].
    """

    target: Array
    direction: Array
    up: Array
    radius: float

    def as_dict(self) -> dict[str, Any]:
        """Return what JSON can say, to a micrometre."""
        return {name: np.asarray(value).round(6).tolist() for name, value in self._asdict().items()}

    def as_comment(self) -> str:
        """Return a line for the header of a file of what is to be looked at."""
        told = ((name, " ".join(f"{x:g}" for x in np.ravel(value))) for name, value in self._asdict().items())
        return "first view: " + ", ".join(f"{name} {numbers}" for name, numbers in told)

    @classmethod
    def of_comments(cls, comments: Iterable[str]) -> View | None:
        """Return the view that one of a file's comments tells; None where none does."""
        found = next(filter(None, map(_COMMENT.search, comments)), None)
        try:
            values = [] if found is None else [np.array(text.split(), np.float64) for text in found.groups()]
        except ValueError:
            return None
        if not values or not (np.abs(np.concatenate(values)) < _LARGEST).all():  # nor NaN
            return None
        target, direction, up, (radius,) = values
        lengths = np.linalg.norm([direction, up], axis=1)
        is_unit = (lengths > _LEAST_LENGTH) & (lengths < 1 / _LEAST_LENGTH)
        if not is_unit.all() or np.linalg.norm(np.cross(direction, up)) < _LEAST_ACROSS or radius <= 0:
            return None
        return cls(target, direction / lengths[0], up / lengths[1], float(radius))
