"""Colours of one surface in several images, brought to one exposure, and without steps at the seams."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]

_DARKEST, _BRIGHTEST = 8, 247  # of 255: beyond, a pixel tells little of the exposure
_BLOCK = 16  # [pixels] over which detail is averaged: patches should be larger
_LEAST_CONTRAST = 0.02  # a pixel: that of noise
_CLIPPED = 0.2  # of its contrast: a white pixel has lost its colour
_REWEIGHTINGS = 6
_TRUST = 0.1  # of the logarithm: residuals of gloss and of wrong places are larger
_FADING = 100  # rounds of smoothing: the correction of a seam reaches some ten triangles


def blurred(image: npt.NDArray[np.uint8]) -> npt.NDArray[np.float32]:
    """Return the means of 3 by 3 pixels."""
    padded = np.pad(image.astype(np.float32), ((1, 1), (1, 1), (0, 0)), mode="edge")
    rows = padded[:-2] + padded[1:-1] + padded[2:]
    means: npt.NDArray[np.float32] = (rows[:, :-2] + rows[:, 1:-1] + rows[:, 2:]) / 9
    return means


def detail_at(image: npt.NDArray[np.float32], pixels: Array) -> Array:
    """Return the detail around (P, 2) places of an image: relative gradients, few where it is white."""
    light = image.mean(axis=2)
    slopes = [np.gradient(light, axis=i) if light.shape[i] > 1 else 0 * light for i in (0, 1)]
    contrast = np.hypot(*slopes) / (light + _DARKEST) + _LEAST_CONTRAST
    contrast[image.max(axis=2) >= _BRIGHTEST] *= _CLIPPED
    side = min(_BLOCK, *light.shape)
    rows, columns = (size // side for size in light.shape)
    blocks = contrast[: rows * side, : columns * side].reshape(rows, side, columns, side)
    return colors_at(blocks.mean(axis=(1, 3))[..., None], (pixels + 0.5) / side - 0.5)[:, 0]


def colors_at(image: npt.NDArray[np.floating], pixels: Array) -> Array:
    """Return the colours of an image at (P, 2) places between its pixels; beyond its edges, those there."""
    last = np.array(image.shape[1::-1]) - 1
    places = np.clip(np.nan_to_num(pixels), 0, last)
    first = np.minimum(places.astype(np.intp), np.maximum(last - 1, 0))
    second = np.minimum(first + 1, last)
    right, down = (places - first).T[..., None]
    upper = (1 - right) * image[first[:, 1], first[:, 0]] + right * image[first[:, 1], second[:, 0]]
    lower = (1 - right) * image[second[:, 1], first[:, 0]] + right * image[second[:, 1], second[:, 0]]
    colors: Array = (1 - down) * upper + down * lower
    return colors


def image_gains(colors: Array, is_visible: Bools) -> Array:
    """
    Return the factors that bring images to one exposure.

    Parameters
    ----------
    colors : (K, P, 3)
        Of P places in K images, from 0 to 255.
    is_visible : (K, P) bool
        Where an image shows a place.

    Returns
    -------
    (K, 3)
        Of each image and channel; their logarithms have the mean 0 over the images.

    Notes
    -----
    Least squares of ``log(color) + log(gain) - log(place)`` over all places in two images or more, weighted
    again by Cauchy's function of the residuals. The unknown colours of the places are eliminated: K equations
    are left.
    """
    usable = is_visible & (colors > _DARKEST).all(axis=2) & (colors < _BRIGHTEST).all(axis=2)
    usable &= usable.sum(axis=0) >= 2
    logarithms = np.log(np.where(usable[..., None], colors, 1.0))
    gains = np.stack([_log_gains(logarithms[..., i], usable) for i in range(3)], axis=1)
    return np.exp(gains)


def _log_gains(logarithms: Array, usable: Bools) -> Array:
    gains = np.zeros(len(logarithms))
    weights = usable.astype(np.float64)
    for _ in range(_REWEIGHTINGS):
        totals = np.maximum(weights.sum(axis=0), 1e-12)
        means = (weights * logarithms).sum(axis=0) / totals
        matrix = np.diag(weights.sum(axis=1)) - np.einsum("kp,lp->kl", weights / totals, weights)
        right = (weights * (means - logarithms)).sum(axis=1)
        # Images that share no place with others, and the mean, are left as they are.
        damping = 1e-6 * max(1.0, float(np.trace(matrix)) / len(matrix))
        gains = np.linalg.solve(matrix + damping * np.eye(len(matrix)), right)
        corrected = logarithms + gains[:, None]
        residuals = corrected - (weights * corrected).sum(axis=0) / totals
        weights = usable / (1 + (residuals / _TRUST) ** 2)
    centered: Array = gains - gains.mean()
    return centered


def seam_corrections(
    colors: Array,
    vertices: npt.NDArray[np.intp],
    edges: npt.NDArray[np.intp],
    is_photographed: Bools,
) -> Array:
    """
    Return what to add to colours so that patches meet without a step.

    Parameters
    ----------
    colors : (N, 3)
        Of the corners of patches.
    vertices : (N,)
        Of which vertex of the mesh they are; corners of one vertex are a seam.
    edges : (E, 2)
        Corners that an edge of the mesh joins within a patch, in both directions.
    is_photographed : (N,) bool
        Where the colour is an image's; the others follow these where they meet.

    Returns
    -------
    (N, 3)
        At a seam the difference from the mean of those that meet there; within a patch it fades.
    """
    weights = np.where(is_photographed, 1.0, 1e-6)
    counts = np.bincount(vertices)
    totals = np.bincount(vertices, weights)
    means = np.stack([np.bincount(vertices, weights * colors[:, i]) for i in range(3)], axis=1)
    is_seam = counts[vertices] > 1
    at_seams = np.where(
        is_seam[:, None], means[vertices] / np.maximum(totals[vertices], 1e-12)[:, None] - colors, 0
    )
    if not is_seam.any():
        return at_seams
    corrections = at_seams
    num_neighbors = np.maximum(np.bincount(edges[:, 0], minlength=len(colors)), 1)
    for _ in range(_FADING):
        sums = [
            np.bincount(edges[:, 0], corrections[edges[:, 1], i], minlength=len(colors)) for i in range(3)
        ]
        corrections = np.where(is_seam[:, None], at_seams, np.stack(sums, axis=1) / num_neighbors[:, None])
    return corrections
