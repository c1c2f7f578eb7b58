#!/usr/bin/env python
"""
Triangles over models of known objects, beside Open3D's, from the same poses.

Each method lays triangles over what nacre tracked: `triangulate` and `close_surface` over the model's points,
Open3D's Poisson and ball pivoting over the same points, and its TSDF over the depth images at nacre's poses,
in voxels of the model's spacing. RMS is the distance from the true surface of points spread over the
triangles, within two spacings of a point of the model; beyond it is "made up", a part of the area. Complete
is what part of the true surface that the cameras saw has a triangle within a spacing. Parts and holes are
what edges join, and what rings of open edges there are.

    python benchmarks/meshing.py [CASE ...]           # needs Open3D: pip install open3d
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from typing import Any

import cases
import numpy as np
import numpy.typing as npt

import nacre
from nacre import evaluation, meshing

Array = npt.NDArray[Any]
NAMES = ["bunny-kinect36", "spot-kinect36", "homer-kinect36", "fandisk-kinect36"]
SAMPLES = 50_000


class Scene:
    """What a method may use: points with normals, and depth images with poses."""

    def __init__(self, case: cases.Case) -> None:
        _, model = cases.run(case, num_threads=0)
        assert case.mesh is not None
        cloud = model.cloud()
        assert cloud.normals is not None
        self.case, self.points, self.normals = case, cloud.points, cloud.normals
        self.spacing, self.poses = model.spacing, model.poses
        known = [i for i, pose in enumerate(model.poses) if np.isfinite(pose).all()]
        truths = np.array([case.truths[i] for i in known])
        self.truth_from_model = cases.best_fit(model.poses[known], truths, 1.0, 180.0)[0]
        samples = evaluation.sample_surface(case.mesh.vertices, case.mesh.triangles, SAMPLES)
        self.seen = samples.points[evaluation.seen_samples(case.mesh, samples, case.camera, truths)]

    def to_truth(self, points: Array) -> Array:
        """Move points of the model to the true mesh."""
        moved: Array = points @ self.truth_from_model[:3, :3].T + self.truth_from_model[:3, 3]
        return moved


def nacre_open(scene: Scene) -> tuple[Array, Array]:
    """Join the points."""
    mesh = meshing.mesh_points(scene.points, scene.normals)
    return mesh.vertices, mesh.triangles


def nacre_closed(scene: Scene) -> tuple[Array, Array]:
    """Close the surface."""
    surface = meshing.close_surface(scene.points, scene.normals)
    return surface.vertices, surface.triangles


def _cloud(scene: Scene) -> Any:
    import open3d as o3d

    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(scene.points.astype(np.float64)))
    cloud.normals = o3d.utility.Vector3dVector(scene.normals.astype(np.float64))
    return cloud


def _arrays(mesh: Any) -> tuple[Array, Array]:
    return np.asarray(mesh.vertices), np.asarray(mesh.triangles)


def open3d_poisson(scene: Scene) -> tuple[Array, Array]:
    """Screened Poisson, cells of half the spacing, as `close_surface` has them."""
    from open3d.geometry import TriangleMesh

    extent = float(np.ptp(scene.points, axis=0).max())
    depth = int(np.ceil(np.log2(1.1 * extent / scene.spacing))) + 1
    return _arrays(TriangleMesh.create_from_point_cloud_poisson(_cloud(scene), depth=depth)[0])


def open3d_pivoting(scene: Scene) -> tuple[Array, Array]:
    """Balls of one, two and four spacings."""
    from open3d.geometry import TriangleMesh
    from open3d.utility import DoubleVector

    radii = DoubleVector([scene.spacing, 2 * scene.spacing, 4 * scene.spacing])
    return _arrays(TriangleMesh.create_from_point_cloud_ball_pivoting(_cloud(scene), radii))


def open3d_tsdf(scene: Scene) -> tuple[Array, Array]:
    """Fuse the depth images in a sparse grid of voxels."""
    import open3d as o3d

    core, camera = o3d.core, scene.case.camera
    grid = o3d.t.geometry.VoxelBlockGrid(
        ("tsdf", "weight"), (core.float32, core.float32), ((1,), (1,)), scene.spacing, 16, 20_000
    )
    intrinsic = core.Tensor(
        [[camera.fx, 0.0, camera.cx], [0.0, camera.fy, camera.cy], [0.0, 0.0, 1.0]], core.float64
    )
    for depth, pose in zip(scene.case.depths, scene.poses, strict=True):
        if np.isfinite(pose).all():
            image = o3d.t.geometry.Image(core.Tensor(np.nan_to_num(depth).astype(np.float32)))
            extrinsic = core.Tensor(np.linalg.inv(pose), core.float64)
            blocks = grid.compute_unique_block_coordinates(image, intrinsic, extrinsic, 1.0, 10.0)
            grid.integrate(blocks, image, intrinsic, extrinsic, 1.0, 10.0)
    mesh = grid.extract_triangle_mesh(weight_threshold=1.0)
    return mesh.vertex.positions.numpy(), mesh.triangle.indices.numpy()


METHODS: dict[str, Callable[[Scene], tuple[Array, Array]]] = {
    "nacre": nacre_open,
    "nacre, closed": nacre_closed,
    "Open3D, Poisson": open3d_poisson,
    "Open3D, ball pivoting": open3d_pivoting,
    "Open3D, TSDF": open3d_tsdf,
}


def parts_and_holes(triangles: Array) -> tuple[int, int]:
    """Count what edges join, and rings of edges with one triangle."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    def components(a: Array, b: Array) -> int:
        used, ends = np.unique(np.stack([a, b]), return_inverse=True)
        a, b = ends.reshape(2, -1)
        graph = coo_matrix((np.ones(len(a)), (a, b)), shape=(len(used), len(used)))
        return int(connected_components(graph, directed=False)[0])

    edges = np.sort(np.concatenate([triangles[:, [i, (i + 1) % 3]] for i in range(3)]), axis=1)
    unique, counts = np.unique(edges, axis=0, return_counts=True)
    border = unique[counts == 1]
    return components(*unique.T), components(*border.T) if len(border) else 0


def row(name: str, scene: Scene, method: Callable[[Scene], tuple[Array, Array]]) -> str:
    """Measure a method; one line of a table."""
    times = []
    for _ in range(3):
        begin = time.perf_counter()
        vertices, triangles = method(scene)
        times.append(time.perf_counter() - begin)
    vertices = np.asarray(vertices, np.float64)
    spread = evaluation.sample_surface(vertices, triangles, SAMPLES)
    near = nacre.KdTree(scene.points).query(spread.points, 1)[0] <= 2 * scene.spacing
    truth = scene.case.mesh
    assert truth is not None
    errors = truth.distance(scene.to_truth(spread.points[near]))
    laid = nacre.Mesh(scene.to_truth(vertices), triangles)
    complete = np.mean(np.abs(laid.distance(scene.seen)) <= scene.spacing)
    parts, holes = parts_and_holes(triangles)
    return (
        f"| {name} | {np.median(times):.2f} | {len(triangles)} | {parts} | {holes} "
        f"| {1000 * np.sqrt(np.mean(errors**2)):.3f} | {complete:.1%} | {1 - np.mean(near):.1%} |"
    )


def main(names: list[str]) -> None:
    """Print a table for each case."""
    for name in names or NAMES:
        scene = Scene(cases.make(name))
        print(f"\n{name}: {len(scene.points)} points, {1000 * scene.spacing:.1f} mm apart\n")
        print("| | time [s] | triangles | parts | holes | RMS [mm] | complete | made up |")
        print("|---|---|---|---|---|---|---|---|")
        for method in METHODS.items():
            try:
                print(row(method[0], scene, method[1]), flush=True)
            except ImportError as error:
                print(f"| {method[0]} | {error} |")


if __name__ == "__main__":
    main(sys.argv[1:])
