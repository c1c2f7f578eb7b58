"""Ways to lay triangles over a scene, nacre's and others'."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt
from mesh_scenes import Laid, Scene
from suite.native import POINTER, function

import nacre
from nacre import meshing

Array = npt.NDArray[Any]
BLOCK = 16  # [voxels] a side
MOST_IN_BLOCKS = 2**27  # voxels: Open3D's extraction counts bytes, 16 a voxel, in 32 bits, and crashes beyond
MOST_IN_BOX = 2_000_000_000  # voxels, which take 20 GB


class OverBudgetError(Exception):
    """A method cannot take so many voxels."""

    def __init__(self, voxels: int, most: int) -> None:
        super().__init__(f"not run: {voxels / 1e6:.0f} million voxels, of {most / 1e6:.0f} that it can take")


def nacre_open(scene: Scene) -> Laid:
    """Join the points."""
    cloud = scene.cloud
    assert cloud.normals is not None
    rows, triangles = meshing.used_rows(meshing.triangulate(cloud.points, cloud.normals))
    return Laid(cloud.points[rows], triangles, None if cloud.colors is None else cloud.colors[rows])


def nacre_closed(scene: Scene) -> Laid:
    """Close the surface."""
    assert scene.cloud.normals is not None
    surface = meshing.close_surface(scene.cloud.points, scene.cloud.normals)
    return _colored(scene, surface.vertices, surface.triangles)


def open3d_poisson(scene: Scene) -> Laid:
    """Screened Poisson, cells of about half the spacing, as `close_surface` has them."""
    from open3d.geometry import TriangleMesh

    extent = float(np.ptp(scene.cloud.points, axis=0).max())
    depth = round(np.log2(1.1 * extent / scene.spacing)) + 1
    return _of_open3d(scene, TriangleMesh.create_from_point_cloud_poisson(_cloud(scene), depth=depth)[0])


def open3d_pivoting(scene: Scene) -> Laid:
    """Balls of one, two and four spacings."""
    from open3d.geometry import TriangleMesh
    from open3d.utility import DoubleVector

    radii = DoubleVector([scene.spacing, 2 * scene.spacing, 4 * scene.spacing])
    return _of_open3d(scene, TriangleMesh.create_from_point_cloud_ball_pivoting(_cloud(scene), radii))


def open3d_tsdf(scene: Scene) -> Laid:
    """Fuse the images in a sparse grid of voxels of one spacing."""
    mesh = _grid(scene, len, MOST_IN_BLOCKS).extract_triangle_mesh(weight_threshold=scene.more_than)
    colors = 255 * mesh.vertex.colors.numpy() if scene.has_color else None
    return Laid(mesh.vertex.positions.numpy(), mesh.triangle.indices.numpy(), colors)


def skimage_cubes(scene: Scene) -> Laid:
    """Fuse the images in the same grid; scikit-image's marching cubes over its box."""
    from skimage import measure

    marching_cubes: Any = measure.marching_cubes
    grid = _grid(scene, lambda blocks: int(np.prod(np.ptp(blocks, axis=0) + 1)), MOST_IN_BOX)
    places, rows = grid.voxel_coordinates_and_flattened_indices()
    cells = np.round(places.numpy() / scene.spacing).astype(np.int64)
    lower, upper = cells.min(axis=0), cells.max(axis=0) + 1
    volume, is_known = np.ones(upper - lower, np.float32), np.zeros(upper - lower, bool)
    values = {name: grid.attribute(name).numpy().reshape(-1)[rows.numpy()] for name in ("tsdf", "weight")}
    there = tuple((cells - lower).T)
    volume[there], is_known[there] = values["tsdf"], values["weight"] > scene.more_than
    vertices, triangles, *_ = marching_cubes(volume, 0.0, gradient_direction="ascent")
    for axis in range(3):  # a cube counts where its eight voxels were seen
        is_known &= np.roll(is_known, -1, axis)
    cubes = np.floor(vertices[triangles].mean(axis=1)).astype(np.int64)
    rows, triangles = meshing.used_rows(triangles[is_known[tuple(cubes.T)]])
    return _colored(scene, (vertices[rows] + lower) * scene.spacing, triangles)


def cgal_front(scene: Scene) -> Laid:
    """Advance a front of triangles over the points."""
    points = np.ascontiguousarray(scene.cloud.points, np.float64)
    facets = function("advancing_front", "advance", POINTER)(points, len(points))
    corners = np.empty((function("advancing_front", "count", POINTER)(facets), 3), np.int32)
    function("advancing_front", "unload")(facets, corners)
    return Laid(points, corners, scene.cloud.colors)


METHODS: dict[str, Callable[[Scene], Laid]] = {
    "nacre": nacre_open,
    "nacre, closed": nacre_closed,
    "Open3D, Poisson": open3d_poisson,
    "Open3D, ball pivoting": open3d_pivoting,
    "Open3D, TSDF": open3d_tsdf,
    "scikit-image, TSDF": skimage_cubes,
    "CGAL, advancing front": cgal_front,
}


def _colored(scene: Scene, vertices: Array, triangles: Array) -> Laid:
    """Give vertices the colours of the nearest points."""
    colors = scene.cloud.colors
    if colors is not None:
        colors = colors[nacre.KdTree(scene.cloud.points).query(vertices, 1)[1]]
    return Laid(vertices, triangles, colors)


def _cloud(scene: Scene) -> Any:
    import open3d as o3d

    def rows(values: Array) -> Any:
        return o3d.utility.Vector3dVector(values.astype(np.float64))

    assert scene.cloud.normals is not None
    cloud = o3d.geometry.PointCloud(rows(scene.cloud.points))
    cloud.normals = rows(scene.cloud.normals)
    if scene.cloud.colors is not None:
        cloud.colors = rows(scene.cloud.colors / 255)
    return cloud


def _of_open3d(scene: Scene, mesh: Any) -> Laid:
    colors = 255 * np.asarray(mesh.vertex_colors) if scene.has_color else None
    return Laid(np.asarray(mesh.vertices), np.asarray(mesh.triangles), colors)


def _grid(scene: Scene, size: Callable[[Array], int], most: int) -> Any:
    """Fuse the images at nacre's poses; size: how many blocks a method takes for those that are touched."""
    import open3d as o3d

    core, camera = o3d.core, scene.camera
    names = ("tsdf", "weight", "color") if scene.has_color else ("tsdf", "weight")
    channels = ((1,), (1,), (3,))[: len(names)]
    types = (core.float32, core.float32, core.float32)[: len(names)]
    intrinsic = core.Tensor(
        [[camera.fx, 0.0, camera.cx], [0.0, camera.fy, camera.cy], [0.0, 0.0, 1.0]], core.float64
    )

    def grid_of(blocks: int) -> Any:
        return o3d.t.geometry.VoxelBlockGrid(names, types, channels, scene.spacing, BLOCK, blocks)

    def image(pixels: Array) -> Any:
        return o3d.t.geometry.Image(core.Tensor(np.ascontiguousarray(pixels, np.float32)))

    known = [i for i, pose in enumerate(scene.poses) if np.isfinite(pose).all()]
    depths = [image(np.nan_to_num(scene.depths[i])) for i in known]
    extrinsics = [core.Tensor(np.linalg.inv(scene.poses[i]), core.float64) for i in known]
    empty = grid_of(1)
    blocks = [
        empty.compute_unique_block_coordinates(depth, intrinsic, extrinsic, 1.0, 10.0)
        for depth, extrinsic in zip(depths, extrinsics, strict=True)
    ]
    different = np.unique(np.concatenate([rows.numpy() for rows in blocks]), axis=0)
    voxels = BLOCK**3 * size(different)
    if voxels >= most:
        raise OverBudgetError(voxels, most)
    # As much memory as they take, and room for an image's, which are counted before those there are found.
    grid = grid_of(len(different) + max(map(len, blocks)))
    for i, rows, depth, extrinsic in zip(known, blocks, depths, extrinsics, strict=True):
        color = scene.colors[i]
        images = [depth] if color is None else [depth, image(color / 255)]
        cameras = (intrinsic, intrinsic)[: len(images)]
        grid.integrate(rows, *images, *cameras, extrinsic, 1.0, 10.0)
    return grid
