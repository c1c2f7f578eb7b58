#!/usr/bin/env python3
"""
Compare the noise that nacre measures with what repeated measurements of the same surface differ by.

``noise.py RECORDING...`` takes recordings with true poses. Pixels of one frame are moved into another by the
true poses and compared along the ray, on smooth surfaces seen at less than 45 degrees. What the differences
of a block of 24 x 24 pixels have in common is error of the poses, or systematic: it is left out ("local").
Prints standard deviations [mm] by depth, each as of one frame.
"""

from __future__ import annotations

import argparse
import itertools
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

import nacre

Array = npt.NDArray[Any]
EDGES = np.array([0.5, 0.75, 1.0, 1.25, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0])
BLOCK = 24
PER_MAD = 1.4826 / np.sqrt(2)
"""Of a difference of two Gaussian values, to the standard deviation of one."""


def differences(sequence: Any, first: int, second: int) -> tuple[Array, Array, Array]:
    """Return the depth, the difference along the ray [m] and the block of pixels seen in two frames."""
    camera = sequence.camera
    one, two = sequence[first], sequence[second]
    depths = [nacre.preprocess_depth(frame.depth, camera) for frame in (one, two)]
    normals = [nacre.depth_normals(depth, camera) for depth in depths]
    valid = np.isfinite(depths[0])
    second_from_first = np.linalg.inv(two.truth) @ one.truth
    rotation, shift = second_from_first[:3, :3], second_from_first[:3, 3]
    moved = nacre.back_project(depths[0], camera) @ rotation.T + shift
    turned = normals[0][valid] @ rotation.T
    pixels = np.rint(camera.project(moved))
    inside = (np.isfinite(pixels) & (pixels >= 0) & (pixels < (camera.width, camera.height))).all(axis=1)
    u, v = pixels[inside].astype(int).T
    everywhere = nacre.back_project(np.where(np.isfinite(depths[1]), depths[1], np.float32(1)), camera)
    here = everywhere.reshape(camera.height, camera.width, 3)[v, u].astype(float)
    normal, ray = normals[1][v, u], here / here[:, 2:]
    slope = -np.einsum("ij,ij->i", normal, ray)
    gap = np.einsum("ij,ij->i", normal, moved[inside] - here) / slope
    z = depths[1][v, u]
    with np.errstate(invalid="ignore"):
        good = (
            np.isfinite(z)
            & (np.einsum("ij,ij->i", normal, turned[inside]) > 0.9)
            & (slope > 0.7 * np.linalg.norm(ray, axis=1))
            & (np.abs(gap) < 0.02 + 0.03 * z)
        )
    block = (v // BLOCK) * 1000 + u // BLOCK
    return z[good], gap[good], block[good]


def without_blocks(gap: Array, block: Array) -> Array:
    """Return the differences less the median of their block; NaN in blocks of few."""
    left = np.full(len(gap), np.nan)
    order = np.argsort(block, kind="stable")
    for rows in np.split(order, np.flatnonzero(np.diff(block[order])) + 1):
        if len(rows) > 100:
            left[rows] = gap[rows] - np.median(gap[rows])
    return left


def measured(sequence: Any, apart: int, pairs: int) -> Iterator[tuple[Array, Array]]:
    """Return the local and the raw standard deviations of pairs of frames, by depth."""
    starts = range(0, len(sequence) - apart, max(1, (len(sequence) - apart) // pairs))
    for start in starts:
        if sequence[start].truth is None or sequence[start + apart].truth is None:
            continue
        z, gap, block = differences(sequence, start, start + apart)
        local, bins = without_blocks(gap, block), np.digitize(z, EDGES) - 1
        rows = []
        for values in (local, gap):
            row = np.full(len(EDGES) - 1, np.nan)
            for k in range(len(row)):
                some = values[(bins == k) & np.isfinite(values)]
                if len(some) > 300:
                    row[k] = PER_MAD * np.median(np.abs(some - np.median(some)))
            rows.append(row)
        yield rows[0], rows[1]


def main() -> None:
    """Print a table for each recording."""
    layout = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=layout)
    parser.add_argument("recordings", nargs="+", type=Path)
    parser.add_argument("--apart", type=int, default=5, help="frames from one to the other")
    parser.add_argument("--pairs", type=int, default=12, help="of frames")
    options = parser.parse_args()
    middles = 0.5 * (EDGES[1:] + EDGES[:-1])
    heads = [f"{a:g}-{b:g} m" for a, b in itertools.pairwise(EDGES)]
    for path in options.recordings:
        sequence = nacre.open_sequence(path).without_color()
        images = [sequence[i].depth for i in range(0, len(sequence), max(1, len(sequence) // 20))]
        single = [nacre.estimate_noise(image, sequence.camera) for image in images]
        pooled = nacre.calibrate_noise(images, sequence.camera)
        local, raw = (
            np.nanmedian(rows, axis=0)
            for rows in zip(*measured(sequence, options.apart, options.pairs), strict=True)
        )
        spread = np.std([np.log(model.sigma(1.0)) for model in single])
        rows = {
            "frame to frame, local": local,
            "frame to frame, raw": raw,
            "nacre, pooled over the recording": pooled.sigma(middles),
            "nacre, about local fits": pooled.local().sigma(middles),
            "Kinect (Nguyen et al. 2012)": nacre.NoiseModel.kinect().sigma(middles),
        }
        print(f"\n{path.name}: {pooled}; image by image it varies by {100 * spread:.1f} %\n")
        print("| sigma [mm] | " + " | ".join(heads) + " |\n" + "| --- " * (len(heads) + 1) + "|")
        for name, row in rows.items():
            print(f"| {name} | " + " | ".join("-" if np.isnan(x) else f"{1e3 * x:.2f}" for x in row) + " |")


if __name__ == "__main__":
    main()
