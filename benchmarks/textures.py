"""
How far seams of textures show: how colours change across the edges at which patches meet.

For each edge, two places of its triangles, so many pixels of the atlas beside its middle on either side: the
mean absolute difference of their colours, at seams and, for comparison, at the edges within patches::

    python benchmarks/textures.py OUT [OUT ...] [--simplify N]

``OUT`` is what ``nacre reconstruct`` wrote of a recording with colour images.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

import nacre
from nacre.cli.source import reopen
from nacre.meshing import Texture, simplify, texture_mesh, texture_views, triangulate
from nacre.meshing.texture_exposure import colors_at
from nacre.meshing.texture_labels import neighbors_of
from nacre.run_data.saved_run import SavedRun

Array = npt.NDArray[Any]

BESIDE = 1.0
"""How far from the edge the places are [pixels]."""


def changes_across_edges(texture: Texture, triangles: npt.NDArray[np.int32]) -> tuple[Array, Array]:
    """Return how much colours change across (E,) edges, a mean over channels, and whether they are seams."""
    neighbors = neighbors_of(triangles)
    size = texture.image.shape[1::-1]
    corners = texture.uv[texture.triangles].astype(np.float64) * size - 0.5
    is_cell = np.abs(corners[:, 1:] - corners[:, :1] - np.eye(2)).max(axis=(1, 2)) < 0.01
    first, side = np.nonzero(neighbors > np.arange(len(triangles))[:, None])
    second = neighbors[first, side]
    photographed = ~is_cell[first] & ~is_cell[second]
    first, side, second = first[photographed], side[photographed], second[photographed]
    ends = np.stack([triangles[first, side], triangles[first, (side + 1) % 3]], axis=1)

    def beside(rows: Array) -> tuple[Array, Array]:
        matches = triangles[rows][:, :, None] == ends[:, None, :]  # corner, end
        a, b = (corners[rows, matches[:, :, i].argmax(axis=1)] for i in (0, 1))
        opposite = corners[rows, (~matches.any(axis=2)).argmax(axis=1)]
        along = (b - a) / np.maximum(np.linalg.norm(b - a, axis=1), 1e-9)[:, None]
        inward = opposite - a
        inward -= (inward * along).sum(axis=1)[:, None] * along
        inward /= np.maximum(np.linalg.norm(inward, axis=1), 1e-9)[:, None]
        used = texture.triangles[rows]
        nodes = np.stack(
            [used[np.arange(len(rows)), matches[:, :, i].argmax(axis=1)] for i in (0, 1)], axis=1
        )
        return colors_at(texture.image.astype(np.float64), (a + b) / 2 + BESIDE * inward), nodes

    (left, left_nodes), (right, right_nodes) = beside(first), beside(second)
    return np.abs(left - right).mean(axis=1), (left_nodes != right_nodes).any(axis=1)


def main() -> None:
    """Texture each run's mesh and print how its seams differ from other edges."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("outs", nargs="+", type=Path, metavar="OUT")
    parser.add_argument("--simplify", type=int, metavar="N")
    arguments = parser.parse_args()
    print("| recording | triangles | seam edges | across seams | across other edges | time |")
    print("| --- | --- | --- | --- | --- | --- |")
    for out in arguments.outs:
        sequence, poses = reopen(SavedRun(out))
        cloud = nacre.read_points(out / "model.ply")
        assert cloud.normals is not None
        vertices, triangles = cloud.points, triangulate(cloud.points, cloud.normals)
        if arguments.simplify:
            vertices, triangles = simplify(vertices, triangles, arguments.simplify)
        views = texture_views(sequence, poses)
        begin = time.process_time()
        texture = texture_mesh(vertices, triangles, views)
        seconds = time.process_time() - begin
        changes, is_seam = changes_across_edges(texture, triangles)
        print(
            f"| {out.name} | {len(triangles)} | {is_seam.sum()} | {changes[is_seam].mean():.2f} "
            f"| {changes[~is_seam].mean():.2f} | {seconds:.1f} s |",
            flush=True,
        )


if __name__ == "__main__":
    main()
