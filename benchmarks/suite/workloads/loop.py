"""The loop: depth frames in, a growing model and a camera trajectory out."""

from __future__ import annotations

from functools import cache, partial
from typing import Any

import numpy as np

from suite.clouds import degrees_between
from suite.workload import Arrays, Contender, Lap, Run, Workload

FRAMES, FAR = 12, 4.0
STAGES = ("preprocess", "back_project", "registration", "fuse", "normals")
IMAGES = ((160, 120), (320, 240), (640, 480), (1280, 720), (1920, 1080))
"""Sizes of images [pixels]."""


@cache
def simulated(
    scene: str, num_given: int, spacing: float, voxel: float, size: tuple[int, int] = (640, 480)
) -> dict[str, Any]:
    """Return a simulated recording; spacing 0 is nacre's own choice."""
    from suite import scenes

    camera = scenes.camera(*size)
    recording = scenes.recording(scene, num_given, FRAMES, camera)
    return {
        "given": recording.given,
        "given poses": recording.given_poses,
        "frames": recording.frames,
        "poses": recording.poses,
        "intrinsics": scenes.matrix(camera),
        "spacing": np.array(spacing),
        "voxel": np.array(voxel),
        "vertices": recording.mesh.vertices,
        "triangles": recording.mesh.triangles,
    }


def nacre(arrays: Arrays, threads: int) -> Run:
    """Take the default preset; grow the model first, with the true poses of the given views."""
    from nacre import Camera, Model

    matrix, frames = arrays["intrinsics"], arrays["frames"]
    height, width = frames.shape[1:]
    camera = Camera(width, height, matrix[0, 0], matrix[1, 1], matrix[0, 2], matrix[1, 2])
    model = Model(camera, num_threads=threads, spacing=float(arrays["spacing"]))
    given = arrays["given"]
    for depth, color, pose in zip(
        given, arrays.get("given colors", [None] * len(given)), arrays["given poses"], strict=True
    ):
        model.add_frame(depth, color, guess=pose, keep_guess=True)
    colors = arrays.get("colors", [None] * len(frames))

    def run(lap: Lap) -> Arrays:
        reports = [model.add_frame(*images) for images in zip(frames, colors, strict=True)]
        for stage in STAGES:
            lap(stage, 1e-3 * sum(report.milliseconds[stage] for report in reports))
        lap("rest")
        tracked = [report.tracked for report in reports]
        poses = np.array([report.world_from_camera for report in reports])
        return {"poses": poses, "tracked": np.array(tracked), "points": model.points}

    return run


def open3d(arrays: Arrays, threads: int, image_normals: bool) -> Run:
    """
    Compose normals, point-to-plane ICP against the model, and a voxel grid, of Open3D's parts.

    The frame is thinned to the model's grid, and to a grid four times as wide for ICP. Normals are those of
    16 neighbours, or those that come with the points where a tensor cloud is made from an image.
    """
    from open3d import camera, core, geometry, pipelines, t

    registration = pipelines.registration
    metric = registration.TransformationEstimationPointToPlane()
    criteria = registration.ICPConvergenceCriteria(1e-6, 1e-6, 30)
    matrix, voxel = arrays["intrinsics"], float(arrays["voxel"])
    height, width = arrays["frames"].shape[1:]
    intrinsic, tensor = camera.PinholeCameraIntrinsic(width, height, matrix), core.Tensor(matrix)
    scale: dict[str, Any] = {"depth_scale": 1.0}

    def cloud_of(depth: Any) -> Any:
        depth = np.nan_to_num(depth)
        if image_normals:
            image = t.geometry.Image(core.Tensor.from_numpy(depth[..., None]))
            make = t.geometry.PointCloud.create_from_depth_image
            cloud = make(image, tensor, depth_max=FAR, with_normals=True, **scale)
            return cloud.to_legacy().voxel_down_sample(voxel)
        make = geometry.PointCloud.create_from_depth_image
        cloud = make(geometry.Image(depth), intrinsic, depth_trunc=FAR, **scale).voxel_down_sample(voxel)
        cloud.estimate_normals(geometry.KDTreeSearchParamKNN(16))
        cloud.orient_normals_towards_camera_location(np.zeros(3))
        return cloud

    model = geometry.PointCloud()
    for depth, pose in zip(arrays["given"], arrays["given poses"], strict=True):
        model += cloud_of(depth).transform(pose)
        model = model.voxel_down_sample(voxel)

    def run(lap: Lap) -> Arrays:
        nonlocal model
        pose, poses = arrays["given poses"][-1], []
        for depth in arrays["frames"]:
            cloud = cloud_of(depth)
            lap("points and normals")
            source = cloud.voxel_down_sample(4 * voxel)
            found = registration.registration_icp(source, model, 4 * voxel, pose, metric, criteria)
            pose = np.array(found.transformation)
            poses.append(pose)
            lap("registration")
            model += cloud.transform(pose)
            model = model.voxel_down_sample(voxel)
            lap("fuse")
        tracked = np.ones(len(poses), bool)
        return {"poses": np.array(poses), "tracked": tracked, "points": np.asarray(model.points)}

    return run


def check(arrays: Arrays, answer: Arrays) -> dict[str, float]:
    """Compare poses and model with the truth."""
    both = list(zip(answer["poses"], arrays["poses"], strict=True))
    turned = [degrees_between(pose, truth) for pose, truth in both]
    moved = [float(np.linalg.norm((pose - truth)[:3, 3])) for pose, truth in both]
    errors = {
        "model [1000 points]": len(answer["points"]) / 1000,
        "lost frames": float((~answer["tracked"]).sum()),
        "rotation, RMS [deg]": float(np.sqrt(np.mean(np.square(turned)))),
        "translation, RMS [mm]": 1e3 * float(np.sqrt(np.mean(np.square(moved)))),
    }
    if "vertices" in arrays:
        from nacre import Mesh

        apart = Mesh(arrays["vertices"], arrays["triangles"]).distance(answer["points"][::10])
        errors["model, RMS [mm]"] = 1e3 * float(np.sqrt((apart**2).mean()))
    return errors


COMPOSED = [
    Contender("nacre", nacre),
    Contender("Open3D", partial(open3d, image_normals=False), "normals of neighbours"),
    Contender("Open3D", partial(open3d, image_normals=True), "normals of the image"),
]


def workload(name: str, title: str, data: Any, items: int, **rest: Any) -> Workload:
    """Return the workload of a simulated recording."""
    return Workload(
        name=name,
        title=f"The loop at {title}: a frame",
        items=items,
        data=data,
        check=check,
        limits={},
        steps=FRAMES,
        **{"contenders": COMPOSED, "goal": 10, **rest},
    )


SWAY = "A camera sways by 5 degrees, up to 1.5 degrees a frame; the model is grown first, with true poses."
WORKLOADS = [
    workload(
        "loop-object-50k",
        "640 x 480, an object that fills the frame, model of about 50,000 points",
        partial(simulated, "object", 1, 0.0014, 0.0019),
        50_000,
        milliseconds=1000 / 60,
        note=f"{SWAY} sigma 0.5 mm, mixed pixels at edges.",
    ),
    workload(
        "loop-object-500k",
        "640 x 480, an object that fills the frame, model of about 500,000 points",
        partial(simulated, "object", 21, 0.0, 0.0016),
        500_000,
        milliseconds=1000 / 30,
        quick=False,
        most_threads_only=True,
        note=f"{SWAY} sigma 0.5 mm, mixed pixels at edges.",
    ),
    workload(
        "loop-room-50k",
        "640 x 480, a room, model of about 50,000 points",
        partial(simulated, "room", 1, 0.006, 0.010),
        50_000,
        milliseconds=1000 / 60,
        quick=False,
        note=f"{SWAY} The noise of structured light, mixed pixels at edges.",
    ),
    workload(
        "loop-room-500k",
        "640 x 480, a room, model of about 500,000 points",
        partial(simulated, "room", 25, 0.0, 0.006),
        500_000,
        milliseconds=1000 / 30,
        quick=False,
        most_threads_only=True,
        note=f"{SWAY} The noise of structured light, mixed pixels at edges.",
    ),
]
WORKLOADS += [
    workload(
        f"loop-room-{width}x{height}",
        f"{width} x {height}, a room, model of the first image",
        partial(simulated, "room", 1, 0.0, 0.006 * 640 / width, (width, height)),
        width * height,
        contenders=COMPOSED[:1],
        goal=None,
        quick=False,
        most_threads_only=True,
        note=f"{SWAY} The noise of structured light, mixed pixels at edges.",
    )
    for width, height in IMAGES
]
