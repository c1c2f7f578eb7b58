"""Small pictures for notebooks, which show them in place of the words of ``repr``; no display is needed."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
import numpy.typing as npt

_SIZE = (480, 400)
_MOST_POINTS = 100_000


def picture_of_points(points: npt.ArrayLike, normals: Any = None, colors: Any = None) -> bytes | None:
    """Return a PNG image of points from above at an angle, shaded by normals; None where there are none."""
    from nacre.normals import estimate_normals
    from nacre.rendering import OBLIQUE, View, measure_spacing, render_points

    cloud = np.asarray(points)
    finite = np.flatnonzero(np.isfinite(cloud).all(axis=1))
    if not len(finite):
        return None
    rows = finite[:: -(-len(finite) // _MOST_POINTS)]
    shown = cloud[rows]
    view = View.fit(shown, OBLIQUE, size=_SIZE)
    if normals is not None:
        sides = normals[rows]
    elif len(shown) >= 3:
        sides = estimate_normals(
            shown, viewpoint=shown.mean(axis=0) - 1e3 * np.asarray(view.view_from_model)[2]
        )
    else:
        sides = None
    image = render_points(
        shown,
        sides,
        None if colors is None else colors[rows],
        view=view,
        spacing=measure_spacing(shown),
        background=None,
    )
    return _png(image)


def picture_of_depth(depth: npt.NDArray[np.floating[Any]]) -> bytes | None:
    """Return a PNG image of a depth image by inverse depth, near yellow; None where nothing was measured."""
    from nacre.pictures.colormap import viridis

    step = max(1, -(-depth.shape[1] // _SIZE[0]))
    part = depth[::step, ::step]
    measured = np.isfinite(part) & (part > 0)
    if not measured.any():
        return None
    low, high = np.percentile(1.0 / part[measured], [1, 99])
    inverse = 1.0 / np.where(measured, part, 1.0)
    color = viridis((inverse - low) / (high - low) if high > low else np.ones(part.shape))
    alpha = np.where(measured, np.uint8(255), np.uint8(0))
    return _png(np.concatenate([color, alpha[..., None]], axis=2))


def _png(image: npt.NDArray[np.uint8]) -> bytes | None:
    from nacre.pictures.image_files import encode_png

    try:
        return encode_png(image)
    except ImportError as error:
        warnings.warn(f"no picture is shown: {error}", stacklevel=4)
        return None
