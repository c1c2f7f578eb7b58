"""Colours of one surface in several images, brought to one exposure, and without steps at the seams."""

from __future__ import annotations

from typing import NamedTuple

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
_POWERS = (2, 4, 6)  # of the distance from the middle of the image
_LEAST_IMAGES = 8  # from whose differences the error of what they have in common is estimated
_RUNS = 50  # of places, which are as independent as the images
_SURE = 5.0  # standard errors: beyond chance
_SEEN_RADIUS = 0.99  # quantile of the distances from the middle: farther out little is known
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


class Falloff(NamedTuple):
    """
    How the light of a lens falls off to the corners of its images, in half diagonals from their middle.

    Attributes
    ----------
    coefficients : (3,)
        Of the second, fourth and sixth power of the distance: they add up to the logarithm of the light that
        is lacking. Zeros: none.
    radius : float
        Beyond it the light is that at this distance.
    """

    coefficients: Array
    radius: float

    @property
    def is_seen(self) -> bool:
        """Whether there is any."""
        return bool(self.coefficients.any())

    def factors(self, radii: Array) -> Array:
        """Return by what colours at distances from the middle are to be multiplied."""
        powers = np.minimum(radii, self.radius)[..., None] ** _POWERS
        factors: Array = np.exp(powers @ self.coefficients)
        return factors


def light_falloff(colors: Array, radii: Array, is_visible: Bools) -> Falloff:
    """
    Return how much light all images lack away from their middle, as far as that is beyond chance.

    Parameters
    ----------
    colors : (K, P, 3)
        Of P places in K images, from 0 to 255.
    radii : (K, P)
        Where the images show them, from the middle of the image [half diagonals].
    is_visible : (K, P) bool
        Where an image shows a place.

    Returns
    -------
    Falloff
        None with fewer than eight images, nor where what is lacking at the largest distances is less than
        five times its standard error.

    Notes
    -----
    One least squares with :func:`image_gains`, of the mean logarithm of the channels. The standard error is
    of residuals that are alike within an image, and within runs of successive places, which gloss has in
    common (Cameron, Gelbach and Miller 2011, "Robust inference with multiway clustering", without the term
    that takes away what is counted twice).
    """
    usable = _usable(colors, is_visible)
    if usable.any(axis=1).sum() < _LEAST_IMAGES:
        return Falloff(np.zeros(len(_POWERS)), 1.0)
    radius = float(np.quantile(radii[usable], _SEEN_RADIUS))
    # Powers of the part of the largest distance are no larger than 1, as are the gains.
    powers = (np.where(usable, np.minimum(radii / radius, 1), 0.0)[..., None]) ** _POWERS
    _, lacking, covariance = _fit_exposure(_logarithms(colors, usable).mean(axis=2), usable, powers)
    if not lacking.sum() > _SURE * np.sqrt(covariance.sum()):
        lacking = np.zeros(len(_POWERS))
    return Falloff(lacking / radius ** np.array(_POWERS), radius)


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
    usable = _usable(colors, is_visible)
    logarithms, nothing = _logarithms(colors, usable), np.zeros((*usable.shape, 0))
    gains = np.stack([_fit_exposure(logarithms[..., i], usable, nothing)[0] for i in range(3)], axis=1)
    return np.exp(gains)


def _usable(colors: Array, is_visible: Bools) -> Bools:
    usable = is_visible & (colors > _DARKEST).all(axis=2) & (colors < _BRIGHTEST).all(axis=2)
    several: Bools = usable & (usable.sum(axis=0) >= 2)
    return several


def _logarithms(colors: Array, usable: Bools) -> Array:
    return np.asarray(np.log(np.where(usable[..., None], colors, 1.0)), np.float64)


def _fit_exposure(logarithms: Array, usable: Bools, columns: Array) -> tuple[Array, Array, Array]:
    """
    Return what is to be added to the (K, P) logarithms of images to make them agree.

    That is (K,) of each image, with the mean 0, and of (K, P, M) columns that they share (M,) coefficients,
    with their covariance (M, M).
    """
    num_images, _, num_columns = columns.shape
    weights = usable.astype(np.float64)
    values = np.concatenate([logarithms[..., None], columns], axis=2)
    for _ in range(_REWEIGHTINGS):
        totals = np.maximum(weights.sum(axis=0), 1e-12)
        # The mean of a place is its own colour's.
        means = np.einsum("kp,kpm->pm", weights, values) / totals[:, None]
        differences = values - means
        lacking, shared = differences[..., 0], differences[..., 1:]
        weighted = weights[..., None] * shared
        matrix = np.empty((num_images + num_columns,) * 2)
        matrix[:num_images, :num_images] = np.diag(weights.sum(axis=1)) - (weights / totals) @ weights.T
        matrix[:num_images, num_images:] = weighted.sum(axis=1)
        matrix[num_images:, :num_images] = matrix[:num_images, num_images:].T
        matrix[num_images:, num_images:] = np.einsum("kpm,kpn->mn", weighted, shared)
        right = -np.append((weights * lacking).sum(axis=1), np.einsum("kpm,kp->m", weighted, lacking))
        # Images that share no place with others, and the mean, are left as they are.
        damping = 1e-6 * max(1.0, float(np.trace(matrix)) / len(matrix))
        inverse = np.linalg.inv(matrix + damping * np.eye(len(matrix)))
        gains, coefficients = np.split(inverse @ right, [num_images])
        added = gains[:, None] - (weights * gains[:, None]).sum(axis=0) / totals
        residuals = lacking + added + shared @ coefficients
        scores = weighted * residuals[..., None]
        weights = usable / (1 + (residuals / _TRUST) ** 2)
    parts = [scores.sum(axis=1), np.add.reduceat(scores.sum(axis=0), _starts(scores.shape[1]), axis=0)]
    influences = np.concatenate(parts) @ inverse[num_images:, num_images:]
    return gains - gains.mean(), coefficients, influences.T @ influences


def _starts(num_places: int) -> npt.NDArray[np.intp]:
    """Return where runs of places begin: successive ones are near each other, and shine alike."""
    return np.unique(np.linspace(0, num_places, _RUNS, endpoint=False).astype(np.intp))


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
