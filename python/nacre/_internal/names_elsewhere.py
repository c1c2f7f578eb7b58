"""What Open3D, SciPy, PCL, small_gicp, OpenCV and trimesh call what nacre has: the advice for each name."""

from __future__ import annotations

_CLOUD = "points are an (N, 3) array; nacre.Cloud holds those of a file with normals and colours"
_ALIGN = "it is nacre.align(source, target, method=...)"
_GLOBAL = "it is nacre.align_global(source, target), which needs no features"
_FUSION = "nacre.Model(camera).add_frame(depth, color) fuses images, and finds their poses"
_TREE = "it is nacre.KdTree(points)"
_VOXELS = "it is nacre.voxel_downsample(points, voxel_size)"
_TEXTURE = "nacre.meshing.texture_mesh(mesh.vertices, mesh.triangles, views) paints one"
_ON_SURFACE = "nacre.meshing.on_surface(points, normals, confidence) tells which points are a surface"
_MODULES = "functions on points and images are in nacre itself: nacre.align, nacre.KdTree, nacre.read_points"
_OUTLIERS = (
    "nacre.KdTree(points).query(points, k) has the distances to threshold; "
    "nacre.consolidate(points) denoises; nacre.out_of_core.remove_outliers(source, output) is for files"
)
_SIMPLIFY = "it is nacre.meshing.simplify(mesh.vertices, mesh.triangles, num_triangles)"
_READ_IMAGE = "nacre.open_sequence(folder) reads recordings, nacre.io.images.read_depth(path) a depth image"
_BACK_PROJECT = "it is nacre.back_project(depth, camera, depth_scale=...)"
_MOVE = "it is an array of rows: points @ pose[:3, :3].T + pose[:3, 3]"
_MESH_NORMALS = "it is normals, where there are some; mesh.closest(points).normals has those of triangles"
_VIEW = "nacre reconstruct --view and nacre view show runs in the browser; notebooks show models and clouds"
_WRITE_CLOUD = "it is nacre.write_points(path, cloud)"
_WRITE_MESH = "it is nacre.write_mesh(path, mesh)"
_WRITE_GLTF = "it is nacre.write_mesh(path, mesh), with a path that ends in .glb"
_READ_PLY = "it is nacre.read_points(path), or nacre.read_mesh(path) of a mesh"
_WRITE_PLY = "it is nacre.write_points(path, points), or nacre.write_mesh(path, mesh) of a mesh"
_DOWNSAMPLE_CLOUD = "it is nacre.voxel_downsample(cloud, voxel_size)"
_CAMERA_FILE = "it is nacre.read_camera(path).camera"
_PINHOLE = "it is nacre.Camera(width, height, fx, fy, cx, cy)"
_FROM_MATRIX = "it is Camera.from_matrix(width, height, K)"
_POSE = "it is target_from_source"

OF_PACKAGE = {
    "PointCloud": _CLOUD,
    "geometry": _CLOUD,
    "Vector3dVector": _CLOUD,
    "utility": _CLOUD,
    "TriangleMesh": "it is nacre.Mesh(vertices, triangles)",
    "pipelines": _ALIGN,
    "t": _MODULES,
    "ml": _MODULES,
    "visualization": _VIEW,
    "draw_geometries": _VIEW,
    "draw": _VIEW,
    "plot": _VIEW,
    "show": _VIEW,
    "view": _VIEW,
    "visualize": _VIEW,
    "icp": _ALIGN,
    "ICP": _ALIGN,
    "gicp": _ALIGN,
    "registration_icp": _ALIGN,
    "registration_colored_icp": "it is nacre.align(..., source_colors=..., target_colors=...)",
    "registration_generalized_icp": _ALIGN,
    "registration_ransac_based_on_feature_matching": _GLOBAL,
    "compute_fpfh_feature": _GLOBAL,
    "read_point_cloud": "it is nacre.read_points(path)",
    "write_point_cloud": "it is nacre.write_points(path, points)",
    "load_points": "it is nacre.read_points(path)",
    "save_points": "it is nacre.write_points(path, points)",
    "loadPCDFile": "it is nacre.read_points(path)",
    "savePCDFile": "it is nacre.write_points(path, points)",
    "read_triangle_mesh": "it is nacre.read_mesh(path)",
    "write_triangle_mesh": _WRITE_MESH,
    "save_mesh": _WRITE_MESH,
    "export_mesh": _WRITE_MESH,
    "write_gltf": _WRITE_GLTF,
    "write_glb": _WRITE_GLTF,
    "write_obj": _WRITE_MESH,
    "write_stl": _WRITE_MESH,
    "read_ply": _READ_PLY,
    "load_ply": _READ_PLY,
    "write_ply": _WRITE_PLY,
    "save_ply": _WRITE_PLY,
    "load_mesh": "it is nacre.read_mesh(path)",
    "load": "it is nacre.read_mesh(path), nacre.read_points(path) or nacre.Model.load(path)",
    "open": "it is nacre.open_sequence(path) of recordings, nacre.read_points(path) or nacre.read_mesh(path)",
    "save": "it is nacre.write_points(path, points), nacre.write_mesh(path, mesh) or model.save(path)",
    "convert": "nacre.write_points(path, nacre.read_points(other)) does, and the command nacre convert",
    "read_image": _READ_IMAGE,
    "read_depth": _READ_IMAGE,
    "KDTree": _TREE,
    "cKDTree": _TREE,
    "KDTreeFlann": _TREE,
    "voxel_down_sample": _VOXELS,
    "voxelgrid_sampling": _VOXELS,
    "VoxelGrid": _VOXELS,
    "downsample": _VOXELS,
    "NormalEstimation": "it is nacre.estimate_normals(points, k=...)",
    "estimate_covariances": "it is nacre.estimate_normals(points, k=...)",
    "remove_statistical_outlier": _OUTLIERS,
    "remove_outliers": _OUTLIERS,
    "statistical_outlier_removal": _OUTLIERS,
    "StatisticalOutlierRemoval": _OUTLIERS,
    "PinholeCameraIntrinsic": _PINHOLE,
    "RGBDImage": "depth and colour are arrays: nacre.Model(camera).add_frame(depth, color)",
    "ScalableTSDFVolume": _FUSION,
    "UniformTSDFVolume": _FUSION,
    "VoxelBlockGrid": _FUSION,
    "KinFu": _FUSION,
    "create_from_depth_image": _BACK_PROJECT,
    "create_from_rgbd_image": _BACK_PROJECT,
    "depthTo3d": _BACK_PROJECT,
    "depth_to_points": _BACK_PROJECT,
    "simplify": _SIMPLIFY,
    "poisson": "it is nacre.meshing.close_surface(points, normals)",
    "ball_pivoting": "it is nacre.meshing.mesh_points(points, normals)",
    "wlop_simplify_and_regularize_point_set": "it is nacre.consolidate(points, method='cgal')",
    "record": "the command nacre record CAMERA -o OUT does; "
    "nacre.write_recording(path, camera, depth_images, depth_scale=...) keeps images that you have",
    "evaluate": "nacre.evaluation.surface_accuracy(points, mesh) and nacre.evaluation.f_score(points, mesh) "
    "measure points, nacre.evaluation.absolute_trajectory_error(poses, truths) poses",
}

OF_CLASS = {
    "AlignResult": {
        "transformation": _POSE,
        "T_target_source": _POSE,
        "pose": _POSE,
        "fitness": "it is overlap",
        "inlier_rmse": "it is rmse",
        "error": "it is rmse",
        "correspondence_set": "nacre.KdTree(target).query(moved_source) pairs the points",
        "H": "it is information",
    },
    "GlobalAlignResult": {
        "transformation": _POSE,
        "T_target_source": _POSE,
        "fitness": "it is overlap",
        "inlier_rmse": "it is rmse",
        "converged": "it is found",
    },
    "Camera": {
        "K": "it is matrix",
        "intrinsic_matrix": "it is matrix",
        "intrinsics": "it is matrix",
        "pinhole": _PINHOLE,
        "from_intrinsics": _FROM_MATRIX,
        "from_K": _FROM_MATRIX,
        "from_json": _CAMERA_FILE,
        "from_file": _CAMERA_FILE,
        "load": _CAMERA_FILE,
        "read": _CAMERA_FILE,
        "save": "it is nacre.write_camera(path, camera)",
        "ppx": "it is cx",
        "ppy": "it is cy",
        "coeffs": "it is distortion",
        "fov": "it is 2 * numpy.arctan(width / (2 * fx)) in radians",
    },
    "CameraFile": {
        "width": "it is in .camera",
        "fx": "it is in .camera",
        "matrix": "it is in .camera",
    },
    "Cloud": {
        "xyz": "it is points",
        "vertices": "it is points",
        "estimate_normals": "it is nacre.estimate_normals(cloud), which returns them",
        "has_normals": "ask cloud.normals is not None",
        "has_colors": "ask cloud.colors is not None",
        "voxel_down_sample": _DOWNSAMPLE_CLOUD,
        "voxel_downsample": _DOWNSAMPLE_CLOUD,
        "remove_statistical_outlier": _OUTLIERS,
        "confidence": "it is attributes['confidence'], where the file has it",
        "intensity": "it is attributes['intensity'], where the file has it",
        "paint_uniform_color": "dataclasses.replace(cloud, colors=numpy.full(cloud.points.shape, (r, g, b), "
        "numpy.uint8)) makes one with that colour",
        "transform": _MOVE,
        "rotate": _MOVE,
        "translate": _MOVE,
        "on_surface": f"{_ON_SURFACE}; model.cloud() has those of a model",
        "crop": "it is cloud[mask], with a mask of its points",
        "select_by_index": "it is cloud[indices]",
        "save": _WRITE_CLOUD,
        "write": _WRITE_CLOUD,
        "show": _VIEW,
        "to_mesh": "it is nacre.meshing.mesh_points(cloud.points, cloud.normals)",
        "to_open3d": "open3d.geometry.PointCloud(open3d.utility.Vector3dVector(cloud.points)) makes one",
        "to_trimesh": "trimesh.PointCloud(cloud.points, colors=cloud.colors) makes one",
    },
    "KdTree": {
        "data": "it is points",
        "n": "it is len(tree)",
        "m": "points have three coordinates",
        "query_pairs": "tree.query_radius(tree.points, r) has the neighbours of each",
        "query_ball_tree": "it is tree.query_ball_point(other.points, r)",
        "count_neighbors": "it is tree.query_radius(other.points, r).counts.sum()",
        "search_knn_vector_3d": "it is query(points, k), for many at once",
        "search_radius_vector_3d": "it is query_radius(points, radius), for many at once",
        "nearestKSearch": "it is query(points, k), for many at once",
        "radiusSearch": "it is query_radius(points, radius), for many at once",
        "batch_nearest_neighbor_search": "it is query(points)",
        "batch_knn_search": "it is query(points, k)",
    },
    "Mesh": {
        "faces": "it is triangles",
        "on_surface": f"mesh.distance(points) has their distances to it; {_ON_SURFACE}",
        "area": "sum the cross products of its edges: numpy.cross",
        "simplify": _SIMPLIFY,
        "simplify_quadric_decimation": _SIMPLIFY,
        "vertex_colors": "it is colors",
        "compute_vertex_normals": _MESH_NORMALS,
        "vertex_normals": _MESH_NORMALS,
        "sample_points_uniformly": "it is nacre.evaluation.sample_surface(mesh.vertices, mesh.triangles, n)",
        "save": _WRITE_MESH,
        "export": _WRITE_MESH,
        "show": _VIEW,
        "texture": _TEXTURE,
        "to_trimesh": "trimesh.Trimesh(mesh.vertices, mesh.triangles, vertex_colors=mesh.colors) makes one",
    },
    "Model": {
        "integrate": "it is add_frame(depth, color), which finds the pose, or takes guess=world_from_camera",
        "update": "it is add_frame(depth, color)",
        "extract_point_cloud": "it is cloud()",
        "extract_triangle_mesh": "it is to_mesh()",
        "mesh": "it is to_mesh()",
        "pose": "it is poses[-1]",
        "on_surface": "cloud() has the points that are a surface",
        "trajectory": "it is poses",
        "write": "it is nacre.write_points(path, model)",
        "show": _VIEW,
    },
    "Reconstruction": {
        "points": "it is cloud.points, or model.points with those that are not confirmed",
        "normals": "it is cloud.normals",
        "colors": "it is cloud.colors",
        "mesh": "it is model.to_mesh()",
        "to_mesh": "it is model.to_mesh()",
        "write": "it is nacre.write_points(path, done), or of its trajectory nacre.write_trajectory",
    },
    "FrameReport": {
        "pose": "it is world_from_camera",
        "fitness": "it is overlap",
    },
    "Trajectory": {
        "positions": "it is poses[:, :3, 3]",
        "times": "it is timestamps",
        "save": "it is nacre.write_trajectory(path, trajectory)",
    },
}

ARRAYS_OF = {
    "AlignResult": "target_from_source",
    "Camera": "matrix",
    "CameraFile": "camera.matrix",
    "FrameReport": "world_from_camera",
    "GlobalAlignResult": "target_from_source",
    "KdTree": "points",
    "Mesh": "vertices or its triangles",
    "Reconstruction": "cloud.points, its poses or its model",
    "SequenceFrame": "depth or its color",
    "SurfaceSamples": "points",
    "Trajectory": "poses or its timestamps",
}
"""What of an object is an array."""

SOME_FRAMES = dict.fromkeys(
    ("every", "step", "stride", "first", "last", "start", "stop", "end", "max_frames"),
    "a slice has some of the frames: nacre.open_sequence(path)[::25] every 25th, [:100] the first, [-100:] "
    "the last",
)
"""Arguments of what reads recordings elsewhere."""

PARAMETERS = {
    "voxel_size": "spacing",
    "voxel_length": "spacing",
    "depth_trunc": "depth.max_depth",
    "depth_max": "depth.max_depth",
    "depth_min": "depth.min_depth",
    "max_correspondence_distance": "registration.max_distance",
}
"""Parameters of a model, by what they are called elsewhere."""
