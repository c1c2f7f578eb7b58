#!/usr/bin/env python
"""
Triangles over models of painted objects and real recordings, beside other libraries', from the same poses.

Each method lays triangles over what nacre tracked: `triangulate` and `close_surface` over the model's points,
Open3D's Poisson and ball pivoting and CGAL's advancing front over the same points, and TSDFs of the images at
nacre's poses, in voxels of the points' spacing, by Open3D and by scikit-image's marching cubes over the same
voxels. `mesh_scenes.py` says what is compared with the truth of an object, and with held-out images of a
recording. Parts are what edges join, holes rings of open edges, memory is how much the peak rises; times are
the processor's, of all threads, so that other work on the machine does not count.

    pip install open3d scikit-image                              # peers, in an environment of their own
    cmake -S benchmarks/cpp_peers -B PEERS && cmake --build PEERS
    NACRE_BENCHMARK_PEERS=PEERS python benchmarks/meshing.py [CASE ...] [--page docs/algorithms/meshing.md]
"""

from __future__ import annotations

import argparse
import contextlib
import importlib
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cases
import numpy as np
import numpy.typing as npt
from mesh_methods import METHODS, OverBudgetError
from mesh_scenes import Figures, Laid, Painted, Recorded, Scene
from suite.native import AbsentError
from suite.worker import give_back_memory, memory, reset_peak

Array = npt.NDArray[Any]

OBJECTS = ["bunny-kinect36", "spot-kinect36", "homer-kinect36", "fandisk-kinect36"]
RECORDINGS = ["icl", "d435", "teddy", "boxcan"]
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


@dataclass(frozen=True)
class Result:
    """What a method took and gave."""

    seconds: float
    megabytes: float
    triangles: npt.NDArray[np.int32]
    figures: Figures

    def row(self, reached: Array | None) -> list[str]:
        """Return what the table says of it; `reached`: what every method reaches."""
        parts, holes = parts_and_holes(self.triangles)
        figures = self.figures
        cells = [
            f"{self.seconds:.2f}",
            f"{self.megabytes:.0f}",
            str(len(self.triangles)),
            str(parts),
            str(holes),
        ]
        cells += [f"{rms(figures.errors):.3f}", f"{np.nanmedian(figures.errors):.3f}"]
        cells += [] if reached is None else [f"{rms(figures.errors[reached]):.3f}"]
        color = "-" if figures.color is None else f"{figures.color:.1f}"
        return [*cells, f"{figures.complete:.1%}", f"{figures.made_up:.1%}", color]


def rms(errors: Array) -> float:
    """Root mean square of what is known."""
    return float(np.sqrt(np.nanmean(errors**2)))


def result_of(scene: Painted | Recorded, method: Callable[[Scene], Laid]) -> Result | Exception:
    """Measure a method, or say why it was not run."""
    try:
        seconds, megabytes, laid = timed(scene, method)
    except (ImportError, AbsentError, OverBudgetError) as error:
        return error
    laid.vertices = np.asarray(laid.vertices, np.float64)
    return Result(seconds, megabytes, laid.triangles, scene.measure(laid))


def table(name: str) -> Iterator[str]:
    """Run a case; the lines of its table."""
    scene: Painted | Recorded = Recorded(name) if name in cases.REAL else Painted(name)
    results = {title: result_of(scene, method) for title, method in METHODS.items()}
    # The same pixels of the same images, for every method.
    errors = [result.figures.errors for result in results.values() if isinstance(result, Result)]
    reached: Array | None = None
    heads = HEADS
    if isinstance(scene, Recorded):
        reached = np.asarray(np.isfinite(errors).all(axis=0))
        heads = [*HEADS[:8], f"RMS of common {reached.mean():.0%} [mm]", *HEADS[8:]]
    yield f"{name}: {len(scene.cloud)} points, {1000 * scene.spacing:.1f} mm apart\n"
    yield f"| {' | '.join(heads)} |"
    yield f"|{' --- |' * len(heads)}"
    for title, result in results.items():
        missing = [str(result)] + ["-"] * (len(heads) - 2)
        yield f"| {' | '.join([title, *(result.row(reached) if isinstance(result, Result) else missing)])} |"
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
    for peer in ("open3d", "skimage.measure"):
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
