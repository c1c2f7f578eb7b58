"""What newcomers from Open3D, SciPy, PCL, small_gicp and OpenCV type first: it works, or says what to do."""

from __future__ import annotations

import inspect
import math
from pathlib import Path
from typing import Any

import numpy as np
import public_names
import pytest

import nacre

pytest.importorskip("PIL.Image")

WIDTH, HEIGHT = 80, 60


@pytest.fixture(scope="module")
def world(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """Return what a newcomer has: arrays, files, a camera, and what nacre made of them."""
    from PIL import Image

    folder = tmp_path_factory.mktemp("newcomer")
    mesh = nacre.built_in_object()
    camera = nacre.Camera(WIDTH, HEIGHT, 65.0, 65.0, 39.5, 29.5)
    poses = nacre.turntable_poses(mesh, 3, math.radians(5), camera=camera, distance=0.3)
    depths = [mesh.simulate_depth(camera, pose) for pose in poses]
    colors = [np.full((HEIGHT, WIDTH, 3), (200, 100, 0), np.uint8) for _ in poses]
    nacre.write_recording(folder / "recording", camera, depths, depth_scale=5000, colors=colors)
    points = np.random.default_rng(3).normal(size=(400, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    rgb = np.tile(np.array([255, 128, 0], np.uint8), (400, 1))
    nacre.write_points(folder / "cloud.ply", points, normals=points, colors=rgb)
    nacre.write_camera(folder / "camera.json", camera, 5000)
    model = nacre.Model(camera)
    model.add_frame(depths[0], colors[0])
    return {
        "np": np, "math": math, "nacre": nacre, "Image": Image, "Path": Path, "folder": folder,
        "points": points, "rgb": rgb, "cloud": nacre.read_points(folder / "cloud.ply"),
        "tree": nacre.KdTree(points),
        "mesh": mesh, "camera": camera, "depths": depths, "colors": colors, "model": model,
        "millimetres": [np.nan_to_num(1000 * depth).astype(np.uint16) for depth in depths],
        "files": sorted((folder / "recording" / "depth").glob("*.png")),
        "done": nacre.reconstruct(folder / "recording"), "result": nacre.align(points, points),
        "K": np.array([[65.0, 0, 39.5], [0, 65.0, 29.5], [0, 0, 1]]),
        "cube": np.random.default_rng(0).uniform(size=(2000, 3)),
        "corners": np.eye(3), "faces": [[0, 1, 2]], "out": str(folder / "out.ply"),
    }  # fmt: skip


# What is typed, and what is then true of its value, which is called `it`.
WORKS = {
    # Whatever has points is taken for its points.
    "np.asarray(nacre.read_points(folder / 'cloud.ply'))": "np.array_equal(it, points)",
    "np.asarray(cloud, dtype=np.float32)": "it.shape == (400, 3) and it.dtype == np.float32",
    "np.asarray(nacre.consolidate(points, num_points=50))": "it.shape == (50, 3)",
    "np.mean(cloud, axis=0)": "it.shape == (3,)",
    "cloud[cloud.points[:, 2] > 0]": "0 < len(it) < 400 and len(it.colors) == len(it.normals) == len(it)",
    "nacre.KdTree(cloud)": "len(it) == 400",
    "nacre.estimate_normals(cloud)": "it.shape == (400, 3)",
    "nacre.align(cloud, cloud)": "it.converged",
    "nacre.align_global(cloud, cloud)": "it.status",
    "nacre.evaluation.surface_accuracy(cloud, mesh)": "it",
    "nacre.write_points(out, cloud)": "nacre.read_points(out) == nacre.read_points(out) "
    "and np.array_equal(nacre.read_points(out).colors, rgb) and nacre.read_points(out).normals is not None",
    "nacre.write_points(out, model)": "nacre.read_points(out).colors.shape == model.cloud().points.shape",
    "nacre.write_points(out, nacre.consolidate(points, attributes={'normals': points}))": "nacre.read_points"
    "(out).normals is not None",
    "nacre.write_points(out, done)": "len(nacre.read_points(out)) == len(done.cloud)",
    "nacre.write_mesh(out, mesh)": "len(nacre.read_mesh(out).triangles) == len(mesh.triangles)",
    "nacre.write_trajectory(out, done.trajectory)": "len(nacre.read_trajectory(out)) == 3",
    "model.to_mesh()": "len(it.triangles) > 100",
    # Colours as Open3D and matplotlib have them.
    "nacre.write_points(out, points, colors=rgb / 255.0)": "(nacre.read_points(out).colors == rgb).all()",
    "nacre.write_mesh(out, corners, faces, colors=corners)": "nacre.read_points(out).colors.max() == 255",
    "nacre.Model(camera).add_frame(depths[0], colors[0] / 255.0)": "it.status == 'TRACKED'",
    "nacre.write_recording(folder / 'f', camera, depths, depth_scale=5000, colors=np.stack(colors) / 255)":
    "np.array_equal(nacre.open_sequence(folder / 'f')[0].color, colors[0])",
    "nacre.align(points, points, source_colors=rgb / 255.0, target_colors=rgb)": "it.converged",
    # Cameras.
    "nacre.Camera.from_fov(640, 480, 90)": "np.isclose(it.fx, 320) and (it.cx, it.cy) == (319.5, 239.5)",
    "nacre.Camera.from_matrix(80, 60, K)": "it == camera",
    "nacre.Camera.from_matrix(80, 60, K, distortion=np.zeros((1, 5)))": "it == camera",
    "camera.matrix": "np.array_equal(it, K)",
    "nacre.Model(camera).camera.matrix": "np.array_equal(it, K)",
    "nacre.back_project(Image.fromarray(millimetres[0]), camera, depth_scale=1000)": "it.shape[1] == 3",
    # Lengths that follow the cloud.
    "nacre.consolidate(cube)": "not np.array_equal(it.points, cube[it.sources])",
    "nacre.project_samples(cube[:200], cube)": "not np.array_equal(it, cube[:200])",
    # Neighbours as SciPy has them.
    "tree.query(points, 5, distance_upper_bound=1e-9)": "(it[1][:, 1:] == 400).all()",
    "tree.query(points, k=2, workers=-1)": "it[0].shape == (400, 2)",
    "tree.query_ball_point(points[0], 0.5)": "0 in it",
    "tree.query_ball_point(points, r=0.5, workers=-1)": "it.shape == (400,) and 7 in it[7]",
    "tree.query_ball_point(points, 0.5, return_length=True)": "it.shape == (400,) and it.min() >= 1",
    # Grids as Open3D and small_gicp have them.
    "nacre.voxel_downsample(points, 0.5)": "1 < len(it) < 400",
    "nacre.voxel_downsample(cloud, voxel_size=0.5).normals": "np.allclose(np.linalg.norm(it, axis=1), 1)",
    "nacre.voxel_downsample(points, 9.0, colors=rgb).colors[0].tolist()": "it == [255, 128, 0]",
    # Points and colours in lists, and of what has points.
    "nacre.Cloud([[0, 0, 1]], colors=[[1.0, 0.5, 0.0]])": "it.colors.tolist() == [[255, 128, 0]]",
    "nacre.Cloud(model)": "np.array_equal(it.points, model.points)",
    "nacre.datasets.write_nerfstudio(folder / 'n', done.sequence, done.poses, cloud=done)": "it == 3",
    # A model of whatever holds depth images.
    "nacre.reconstruct(depths, camera=camera)": "it.num_tracked == 3",
    "nacre.reconstruct(np.stack(depths), camera=camera)": "it.num_tracked == 3",
    "nacre.reconstruct((depth for depth in depths), camera=camera)": "it.num_tracked == 3",
    "nacre.reconstruct(zip(depths, colors), camera=camera)": "it.model.colors is not None",
    "nacre.reconstruct(millimetres, camera=camera, depth_scale=1000)": "it.num_tracked == 3",
    "nacre.reconstruct(depths, camera=folder / 'camera.json')": "it.num_tracked == 3",
    "nacre.reconstruct(files, camera=camera, depth_scale=5000)": "it.num_tracked == 3",
    "nacre.reconstruct([str(file) for file in files], camera=folder / 'camera.json')": "it.num_tracked == 3",
    "nacre.reconstruct(iter(files), camera=camera, depth_scale=5000)": "it.num_tracked == 3",
    "nacre.reconstruct(nacre.open_sequence(folder / 'recording')[::2])": "it.num_tracked == 2",
    "nacre.reconstruct(frame for frame in nacre.open_sequence(folder / 'recording'))": "it.num_tracked == 3",
    "nacre.reconstruct(str(folder / 'recording'))": "it.num_tracked == 3",
}  # fmt: skip

# What is typed, and words of the error that answers it.
TOLD = {
    # Cameras.
    "nacre.Camera(640, 480)": ["fx, fy, cx and cy", "Camera.from_fov(width, height,", "Camera.from_matrix("],
    "nacre.Camera(640, 480, 525)": ["fy, cx and cy", "from_fov"],
    "nacre.Camera()": ["width, height, fx, fy, cx and cy"],
    "nacre.Camera(640, 480, K)": ["fy, cx and cy", "from_matrix"],
    "nacre.Camera(640, 480, fov=60)": ["fov", "from_fov"],
    "nacre.Camera.from_fov(640, 480, 60, 190)": ["vertical_degrees", "190"],
    "nacre.Camera.from_fov(640, 480, math.radians(60))": ["horizontal_degrees must be degrees", "1.0472"],
    "nacre.Camera.from_fov(640, 480, 60, math.radians(45))": ["vertical_degrees must be degrees"],
    "nacre.Camera.from_fov(fov=60)": ["no argument 'fov'", "it is horizontal_degrees"],
    "nacre.Camera.from_fov(640, 480)": ["horizontal_degrees", "Camera.from_fov(width, height,"],
    "nacre.Model()": ["camera", "nacre.Camera(width, height,"],
    "nacre.Model(K)": ["camera must be a nacre.Camera", "Camera.from_matrix(width, height, K)"],
    "nacre.Model(nacre.read_camera(folder / 'camera.json'))": ["give its .camera"],
    "nacre.Model('camera.json')": ["read_camera"],
    "camera.K": ["matrix"],
    "camera.intrinsic_matrix": ["matrix"],
    # Names of other libraries.
    "nacre.read_point_cloud('a.ply')": ["nacre.read_points"],
    "nacre.io.read_triangle_mesh('a.ply')": ["nacre.read_mesh"],
    "nacre.geometry.PointCloud()": ["(N, 3) array", "nacre.Cloud"],
    "nacre.pipelines.registration.registration_icp": ["nacre.align"],
    "nacre.registration_icp": ["nacre.align"],
    "nacre.cKDTree(points)": ["nacre.KdTree"],
    "nacre.voxel_down_sample(points, 0.1)": ["nacre.voxel_downsample"],
    "nacre.estimate_normal(points)": ["estimate_normals"],
    "nacre.ScalableTSDFVolume": ["nacre.Model"],
    "nacre.PinholeCameraIntrinsic": ["nacre.Camera"],
    "nacre.Camera.pinhole(80, 60, 65, 65, 39.5, 29.5)": ["Camera(width, height, fx, fy, cx, cy)"],
    "nacre.Camera.from_K(K)": ["Camera.from_matrix(width, height, K)"],
    "nacre.save_mesh(out, mesh)": ["nacre.write_mesh(path, mesh)"],
    "nacre.write_gltf(out, mesh)": ["nacre.write_mesh(path, mesh)", ".glb"],
    "nacre.write_ply(out, mesh)": ["nacre.write_points(path, points)", "nacre.write_mesh(path, mesh)"],
    "nacre.record": ["nacre record", "nacre.write_recording"],
    "cloud.estimate_normals()": ["nacre.estimate_normals(cloud)"],
    "cloud.voxel_down_sample(0.1)": ["nacre.voxel_downsample(cloud,"],
    "cloud.transform(np.eye(4))": ["points @ pose[:3, :3].T + pose[:3, 3]"],
    "cloud.xyz": ["points"],
    "cloud[0]": ["cloud.points[0]"],
    "tree.data": ["points"],
    "tree.query_pairs(0.1)": ["query_radius"],
    "tree.search_knn_vector_3d(points[0], 5)": ["query"],
    "result.transformation": ["target_from_source"],
    "result.T_target_source": ["target_from_source"],
    "result.fitness": ["overlap"],
    "result.inlier_rmse": ["rmse"],
    "model.integrate(depths[0])": ["add_frame"],
    "model.extract_triangle_mesh()": ["to_mesh"],
    "model.mesh": ["to_mesh"],
    "mesh.faces": ["triangles"],
    "np.asarray(mesh)": ["vertices", "triangles"],
    "done.points": ["cloud.points"],
    "np.asarray(done)": ["cloud.points", "poses"],
    "nacre.KdTree(done)": ["points must be an array, got Reconstruction", "cloud.points"],
    "mesh.on_surface(points)": ["mesh.distance(points)", "nacre.meshing.on_surface"],
    "cloud.on_surface(mesh)": ["nacre.meshing.on_surface", "model.cloud()"],
    "done.write(out)": ["nacre.write_points(path, done)"],
    # What is no array says what of it is one.
    "np.asarray(camera)": ["a Camera is no array", "matrix"],
    "np.asarray(done.trajectory)": ["a Trajectory is no array", "poses", "timestamps"],
    "np.asarray(done.sequence)": ["a SequenceFrame is no array", "depth", "color"],
    "np.asarray(result)": ["an AlignResult is no array", "target_from_source"],
    "nacre.KdTree(tree)": ["points must be an array, got KdTree", "its points"],
    "nacre.KdTree(None)": ["points must be an array of real numbers, got dtype object (NoneType)"],
    "nacre.Model(camera).add_frame(done.sequence[0])": ["depth must be an array, got SequenceFrame", "depth"],
    "nacre.Model(camera).add_frame('a.png')": ["depth must be an array", "got 'a.png'", "read_depth(path)"],
    "nacre.evaluation.absolute_trajectory_error(done.trajectory, done.poses)": ["got Trajectory", "poses"],
    "nacre.associate(done.trajectory, done.trajectory)": ["timestamps_a must be", "timestamps"],
    # Arguments that are missing.
    "nacre.Mesh(cloud)": ["Mesh needs triangles", "model.to_mesh()", "mesh_points(points, normals)"],
    "nacre.Mesh(points, faces=faces)": ["it is triangles"],
    "nacre.meshing.texture_mesh(mesh)": ["needs triangles and views", "texture_views(sequence, poses)"],
    "nacre.meshing.texture_views(done)": ["needs poses", "sequence and poses"],
    "nacre.meshing.on_surface(cloud)": ["needs normals and confidence", "model.cloud()"],
    "nacre.write_animation(out, model)": ["needs triangles", "(F, N, 3)"],
    "nacre.write_animation('a.glb', [mesh, mesh], faces)": ["vertices must be an array", "vertices"],
    "nacre.write_recording(out, done)": ["needs depth_images and depth_scale", "camera", "frames with depth"],
    "nacre.write_mesh(out)": ["needs vertices", "a Mesh"],
    "nacre.evaluation.sample_surface(mesh)": ["needs triangles", "mesh.vertices, mesh.triangles"],
    "nacre.viewer.export_html(done)": ["needs path", "read_timeline(folder)"],
    # Arguments that changed places.
    "nacre.write_camera(camera, out)": ["path must be a path, as in write_camera(path, camera), got Camera"],
    "nacre.read_camera(camera)": ["path must be a path, as in read_camera(path), got Camera"],
    "nacre.read_trajectory(done.trajectory)": ["path must be", "got Trajectory"],
    "nacre.write_recording(camera, depths, out, depth_scale=1000)": ["path must be", "got Camera"],
    "nacre.write_animation(mesh.vertices, mesh.triangles, out)": ["path must be a path", "got ndarray"],
    "nacre.Model.load(model)": ["path must be a path, as in load(path), got Model"],
    "model.save(model)": ["path must be a path, as in save(path), got Model"],
    "nacre.viewer.export_html(out, done)": ["path must be", "got Reconstruction"],
    "nacre.io.images.read_depth(depths[0])": ["path must be", "got ndarray"],
    # Arguments of other libraries.
    "model.add_frame(depths[0], pose=np.eye(4))": ["it is guess"],
    "model.add_frame(depths[0], extrinsic=np.eye(4))": ["guess takes its inverse"],
    "nacre.back_project(depths[0], camera, 1000)": ["by name", "depth_scale"],
    "nacre.reconstruct(depths, camera)": ["by name", "camera"],
    "nacre.write_points(out, points, color=rgb)": ["did you mean 'colors'?"],
    "nacre.align(points, points, 0.02)": ["by name", "max_distance"],
    "nacre.align(points, points, max_correspondence_distance=0.02)": ["max_distance"],
    "nacre.align(points, points, init=np.eye(4))": ["initial"],
    "nacre.estimate_normals(points, radius=0.1)": ["max_radius"],
    "nacre.estimate_normals(points, max_nn=30)": ["k"],
    "nacre.KdTree(points, leafsize=16)": ["leafsize", "leave it out"],
    "tree.query(points, p=1)": ["Euclidean"],
    "nacre.reconstruct(depths, camera=camera, voxel_size=0.01)": ["spacing"],
    "nacre.reconstruct(depths, camera=camera, max_depth=2.0)": ["depth.max_depth"],
    "nacre.write_animation(out, [corners], faces, fps=30)": ["times", "numpy.arange(F) / fps"],
    # Values that cannot be right.
    "nacre.turntable_poses(mesh, 12, 30)": ["step must be radians", "math.radians(30)"],
    "nacre.Camera(-640, 480, 525, 525, 319.5, 239.5)": ["width must be 1 to 65536 pixels, got -640"],
    "nacre.NoiseModel('kinect')": ["constant must be of type float, got 'kinect'"],
    "nacre.DepthParameters(max_depth='far')": ["max_depth must be of type float, got 'far'"],
    "nacre.RegionParameters(object='yes')": ["object must be of type bool, got 'yes'"],
    "nacre.ModelParameters(max_points=1e6)": ["max_points must be of type int, got 1000000.0"],
    "nacre.ModelParameters(depth='fine')": ["depth must be of type DepthParameters, got 'fine'"],
    "nacre.Cloud([])": ["points must have shape (N, 3), got (0,)"],
    "nacre.Cloud(points, normals=points[:9])": ["normals must have one row per point", "400", "9"],
    "nacre.Cloud(points, colors=rgb[:9])": ["colors must have shape (400, 3)", "(9, 3)"],
    "nacre.calibrate_depth(depths, camera)": ["views must be pairs of depth and world_from_camera"],
    "nacre.calibrate_noise(folder / 'recording', camera)": ["images must be a sequence of items"],
    "nacre.write_recording(folder / 'g', camera, 5, depth_scale=1000)": ["depth_images must be a sequence"],
    "nacre.write_points(out, points, attributes=[1])": ["attributes must be a mapping", "got list"],
    "nacre.write_points(out, points, comments=3)": ["comments must be a sequence of items, got 3"],
    "nacre.evaluation.seen_samples(mesh, points, camera, done.poses)": ["samples must be", "got ndarray"],
    "nacre.meshing.texture_views(done, done.poses)": ["must be a nacre.Sequence", "give its .sequence"],
    "nacre.datasets.write_colmap(folder / 'c', done, done.poses)": ["nacre.Sequence", "give its .sequence"],
    "nacre.report.write_report(out, done)": ["data must be", "report_data(title=...)", "got Reconstruction"],
    "nacre.viewer.Viewer(done)": ["timeline must be a nacre.viewer.Timeline, got Reconstruction"],
    "nacre.viewer.export_html(done, folder / 'a.html')": ["must be a nacre.viewer.Timeline"],
    "nacre.reconstruction.Reconstruction(depths, camera)": ["model must be a nacre.Model, got Camera"],
    "nacre.reconstruct(depths)": ["camera", "Camera.from_fov"],
    "nacre.reconstruct(millimetres, camera=camera)": ["depth_scale", "1000 for millimetres"],
    "nacre.reconstruct(files, camera=camera)": ["depth_scale", "1000 for millimetres"],
    "nacre.reconstruct([], camera=camera)": ["at least one frame"],
    "nacre.reconstruct(iter([]), camera=camera)": ["at least one frame"],
    "nacre.reconstruct([1, 2], camera=camera)": ["source[0] must be"],
    "nacre.reconstruct({'depth': depths}, camera=camera)": ["source must be", "got dict"],
    "nacre.KdTree('cloud.ply')": ["points must be an array", "nacre.read_points"],
    "nacre.simulate_depth(mesh, camera, np.eye(4))": ["mesh.simulate_depth(camera, world_from_camera)"],
    "nacre.meshing.mesh_points(cloud)": ["needs normals", "cloud.normals"],
    "nacre.Sequence(folder)": ["nacre.open_sequence(path)"],
    "mesh.vertex_normals": ["it is normals", "mesh.closest(points).normals"],
    "nacre.reconstruct(42)": ["source must be"],
    "nacre.reconstruct(depths[0], camera=camera)": ["a list of depth images", "[depth]"],
    "nacre.back_project(millimetres[0], camera)": ["depth_scale", "1000 for millimetres"],
    "nacre.write_points(points, out)": ["path must be", "write_points(path, points)"],
    "nacre.write_mesh(mesh, out)": ["path must be", "write_mesh(path, mesh)", "got Mesh"],
    "nacre.read_mesh(mesh)": ["path must be", "read_mesh(path)", "got Mesh"],
    "nacre.read_mesh(folder / 'cloud.ply')": ["not a mesh", "nacre.read_points(path)"],
    "nacre.write_trajectory(done.trajectory, out)": ["path must be", "got Trajectory"],
    "nacre.meshing.simplify(mesh, 500)": ["num_triangles", "simplify(mesh.vertices, mesh.triangles,"],
    "nacre.meshing.close_surface(cloud)": ["needs normals", "cloud.normals"],
    "nacre.meshing.triangulate(cloud)": ["needs normals", "cloud.normals"],
    "nacre.datasets.write_colmap(out, done)": ["needs poses", "done.sequence, done.poses"],
    "nacre.datasets.write_nerfstudio(out, done)": ["needs poses", "done.sequence, done.poses"],
    "nacre.write_points(out, points, colors=rgb.astype(float))": ["from 0 to 1", "astype(np.uint8)"],
    "nacre.Model(camera).add_frame(depths[0], np.zeros((60, 80, 4), np.uint8))": ["(60, 80, 3)", "[..., :3]"],
    "model.save(folder / 'model.ply')": ["write_points"],
    "nacre.voxel_downsample(points, '1cm')": ["voxel_size must be a number"],
    "nacre.voxel_downsample(points, 0)": ["voxel_size must be positive"],
}


@pytest.mark.parametrize("guess", WORKS)
def test_a_guess_works(guess: str, world: dict[str, Any]) -> None:
    it = eval(guess, dict(world))
    assert eval(WORKS[guess], {**world, "it": it}), it


@pytest.mark.parametrize("guess", TOLD)
def test_a_guess_is_answered_by_what_to_do(guess: str, world: dict[str, Any]) -> None:
    with pytest.raises((TypeError, ValueError, AttributeError)) as told:
        eval(guess, dict(world))
    for word in TOLD[guess]:
        assert word in str(told.value)


TAKES_ARGUMENTS = [
    name
    for name, value in public_names.members().items()
    if inspect.isroutine(value) and inspect.signature(value).parameters
]


@pytest.mark.parametrize("function", TAKES_ARGUMENTS)
def test_an_unknown_argument_is_named_or_what_is_missing(function: str) -> None:
    with pytest.raises(TypeError, match=r"has no argument 'nonesuch'|needs \w+"):
        public_names.members()[function](nonesuch=1)
