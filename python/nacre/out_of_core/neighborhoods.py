"""How far the neighbours of points are looked for."""

from __future__ import annotations

import math

from nacre.out_of_core.survey import Survey

_TIMES_MEDIAN = 16.0  # density falls with the square of the distance from a scanner


def default_radius(survey: Survey, k: int) -> float:
    """Return how far neighbours are looked for: k points lie within a sixteenth of it, at median density."""
    radius = _TIMES_MEDIAN * survey.spacing * math.sqrt(k / math.pi)
    if not 0 < radius < math.inf:
        raise ValueError("max_radius must be given, got None: the points lie on top of each other")
    return radius
