#!/usr/bin/env python
"""
Triangles over models of painted objects and real recordings, beside other libraries', from the same poses.

Each method lays triangles over what nacre tracked: `triangulate` and `close_surface` over the model's points,
Open3D's Poisson and ball pivoting and CGAL's advancing front over the same points, and TSDFs of the images at
nacre's poses, in voxels of the points' spacing, by Open3D and by scikit-image's marching cubes over the same
voxels. `mesh_scenes.py` says what is compared with the truth of an object, and with held-out images of a
recording. Parts are what edges join, holes rings of open edges, memory is how much the peak rises; times are
the processor's, of all threads, so that other work on the machine does not count.

    pip install open3d scikit-image cgal                         # peers, in an environment of their own
    python benchmarks/meshing.py [CASE ...] [--page docs/algorithms/meshing.md]
"""

from __future__ import annotations

import argparse
import contextlib
import importlib
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import cases
import numpy as np
import numpy.typing as npt
from mesh_methods import METHODS, OverBudgetError
from mesh_scenes import Laid, Painted, Recorded, Scene
from suite.worker import give_back_memory, memory, reset_peak

OBJECTS = ["bunny-kinect36", "spot-kinect36", "homer-kinect36", "fandisk-kinect36"]
RECORDINGS = ["icl", "d435"]
HEADS = ["", "CPU [s]", "memory [MB]", "triangles", "parts", "holes", "RMS [mm]", "median [mm]"]
HEADS += ["complete", "made up", "colour"]
MARKS = "<!-- made by benchmarks/meshing.py -->", "<!-- end -->"


def parts_and_holes(triangles: npt.NDArray[np.int32]) -> tuple[int, int]:
    """Count what edges join, and rings of edges with one triangle."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    def components(a: npt.NDArray[Any], b: npt.NDArray[Any]) -> int:
        used, ends = np.unique(np.stack([a, b]), return_inverse=True)
        a, b = ends.reshape(2, -1)
        graph = coo_matrix((np.ones(len(a)), (a, b)), shape=(len(used), len(used)))
        return int(connected_components(graph, directed=False)[0])

    edges = np.sort(np.concatenate([triangles[:, [i, (i + 1) % 3]] for i in range(3)]), axis=1)
    unique, counts = np.unique(edges, axis=0, return_counts=True)
    border = unique[counts == 1]
    return components(*unique.T), components(*border.T) if len(border) else 0


def timed(scene: Scene, method: Callable[[Scene], Laid]) -> tuple[float, float, Laid]:
    """Return the processor time of a method [s], how much memory it took [MB], and its mesh."""
    give_back_memory()
    before = memory("VmRSS") if reset_peak() else np.nan
    begin = time.process_time()
    laid = method(scene)
    return time.process_time() - begin, (memory("VmHWM") - before) / 1e6, laid


def row(name: str, scene: Painted | Recorded, method: Callable[[Scene], Laid]) -> str:
    """Measure a method; one line of a table."""
    seconds, megabytes, laid = timed(scene, method)
    laid.vertices = np.asarray(laid.vertices, np.float64)
    parts, holes = parts_and_holes(laid.triangles)
    figures = scene.measure(laid)
    color = "-" if figures.color is None else f"{figures.color:.1f}"
    return (
        f"| {name} | {seconds:.2f} | {megabytes:.0f} | {len(laid.triangles)} | {parts} | {holes} "
        f"| {figures.rms:.3f} | {figures.median:.3f} "
        f"| {figures.complete:.1%} | {figures.made_up:.1%} | {color} |"
    )


def table(name: str) -> Iterator[str]:
    """Run a case; the lines of its table."""
    scene: Painted | Recorded = Recorded(name) if name in cases.REAL else Painted(name)
    yield f"{name}: {len(scene.cloud)} points, {1000 * scene.spacing:.1f} mm apart\n"
    yield f"| {' | '.join(HEADS)} |"
    yield f"|{' --- |' * len(HEADS)}"
    for title, method in METHODS.items():
        try:
            yield row(title, scene, method)
        except (ImportError, OverBudgetError) as error:
            yield f"| {title} | {error} |{' - |' * (len(HEADS) - 2)}"
    yield ""


def write_page(page: Path, lines: list[str]) -> None:
    """Put the tables between their marks on a page."""
    before, _, rest = page.read_text().partition(MARKS[0])
    after = rest.partition(MARKS[1])[2]
    page.write_text(before + MARKS[0] + "\n\n" + "\n".join(lines) + "\n" + MARKS[1] + after)


def main() -> None:
    """Print a table for each case."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[1])
    parser.add_argument("cases", nargs="*", default=OBJECTS + RECORDINGS)
    parser.add_argument("--page", type=Path, help="also put the tables on this page")
    parser.add_argument("--data", type=Path, default=cases.DATA, help="where the recordings are")
    options = parser.parse_args()
    cases.DATA = options.data
    for peer in ("open3d", "skimage.measure", "CGAL"):
        with contextlib.suppress(ImportError):
            importlib.import_module(peer)  # before its memory is measured
    lines = []
    for name in options.cases:
        for line in table(name):
            print(line, flush=True)
            lines.append(line)
    if options.page:
        write_page(options.page, lines)


if __name__ == "__main__":
    main()
