"""A depth frame of 640 x 480: points, normals, cleaning, and all of it."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, partial
from typing import Any

import numpy as np

from suite.workload import Arrays, Bound, Contender, Lap, Run, Workload

PIXELS = 640 * 480
SIGMA = 0.0005


@cache
def frame() -> dict[str, Any]:
    """Return a noisy image of the bumpy object, and the true points and normals."""
    from suite import scenes

    recording = scenes.recording("object", 1, 1)
    depth = recording.frames[0]
    rays = scenes.RAYS @ recording.poses[0][:3, :3].T
    origins = np.broadcast_to(recording.poses[0][:3, 3], rays.shape)
    hits = recording.mesh.cast(origins, rays)
    triangles = recording.mesh.vertices[recording.mesh.triangles[np.maximum(hits.triangles, 0)]]
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    normals = normals / np.linalg.norm(normals, axis=1, keepdims=True) @ recording.poses[0][:3, :3]
    normals[hits.triangles < 0] = np.nan
    return {
        "depth": depth,
        "depth0": np.nan_to_num(depth),
        "true depth": hits.distances.reshape(depth.shape),
        "normals": normals,
    }


def camera() -> Any:
    """Return the camera."""
    from suite.scenes import CAMERA

    return CAMERA


def nacre(arrays: Arrays, threads: int, stage: str) -> Run:
    """Remove mixed pixels, slanted ones and speckles; fit planes to windows of the depth image."""
    from nacre import NoiseModel, back_project, depth_normals, preprocess_depth

    noise, view, depth = NoiseModel(constant=SIGMA), camera(), arrays["depth"]

    def clean(lap: Lap) -> Arrays:
        return {"depth": preprocess_depth(depth, view, noise=noise, num_threads=threads)}

    def points(lap: Lap) -> Arrays:
        return {"points": back_project(depth, view)}

    def normals(lap: Lap) -> Arrays:
        return {"normals": depth_normals(depth, view, noise=noise, num_threads=threads)}

    def everything(lap: Lap) -> Arrays:
        cleaned = preprocess_depth(depth, view, noise=noise, num_threads=threads)
        lap("clean")
        normals = depth_normals(cleaned, view, noise=noise, num_threads=threads)
        lap("normals")
        points = back_project(cleaned, view)
        lap("points")
        return {"depth": cleaned, "normals": normals, "points": points}

    runs: dict[str, Run] = {"clean": clean, "points": points, "normals": normals, "all": everything}
    return runs[stage]


def opencv(arrays: Arrays, threads: int, stage: str) -> Run:
    """Smooth with a bilateral filter of 5 x 5; take normals by FALS from points."""
    import cv2

    from suite.scenes import INTRINSICS

    cv2.setNumThreads(threads)
    depth, matrix = arrays["depth0"], INTRINSICS.astype(np.float32)
    method = cv2.RgbdNormals_RGBD_NORMALS_METHOD_FALS
    fals = cv2.RgbdNormals_create(480, 640, cv2.CV_32F, matrix, 5, 50.0, method)
    given = cv2.depthTo3d(depth, matrix)
    fals.apply(given)  # builds its tables

    def clean(image: Any) -> Any:
        return cv2.bilateralFilter(image, 5, 3 * SIGMA, 2)

    def everything(lap: Lap) -> Arrays:
        cleaned = clean(depth)
        lap("clean")
        points = cv2.depthTo3d(cleaned, matrix)
        lap("points")
        normals = fals.apply(points)
        lap("normals")
        return {"depth": cleaned, "normals": normals[..., :3], "points": points[..., :3]}

    runs: dict[str, Run] = {
        "clean": lambda lap: {"depth": clean(depth)},
        "points": lambda lap: {"points": cv2.depthTo3d(depth, matrix)[..., :3]},
        "normals": lambda lap: {"normals": fals.apply(given)[..., :3]},
        "all": everything,
    }
    return runs[stage]


def open3d(arrays: Arrays, threads: int, stage: str) -> Run:
    """Smooth with a bilateral filter of 5 x 5; take normals from two differences of points."""
    from open3d import core, t

    from suite.scenes import INTRINSICS

    matrix, nan = core.Tensor(INTRINSICS), float("nan")
    image = t.geometry.Image(core.Tensor.from_numpy(arrays["depth0"][..., None]))
    given = image.create_vertex_map(matrix, nan)

    def array(result: Any) -> Any:
        return result.as_tensor().numpy()

    def everything(lap: Lap) -> Arrays:
        cleaned = image.filter_bilateral(5, 3 * SIGMA, 2)
        lap("clean")
        points = cleaned.create_vertex_map(matrix, nan)
        lap("points")
        normals = points.create_normal_map(nan)
        lap("normals")
        return {"depth": array(cleaned)[..., 0], "normals": array(normals), "points": array(points)}

    runs: dict[str, Run] = {
        "clean": lambda lap: {"depth": array(image.filter_bilateral(5, 3 * SIGMA, 2))[..., 0]},
        "points": lambda lap: {"points": array(image.create_vertex_map(matrix, nan))},
        "normals": lambda lap: {"normals": array(given.create_normal_map(nan))},
        "all": everything,
    }
    return runs[stage]


def numpy(arrays: Arrays, threads: int, stage: str) -> Run:
    """Write it as one does without a library."""
    u, v = np.meshgrid(np.arange(640, dtype=np.float32), np.arange(480, dtype=np.float32))
    depth = arrays["depth"]

    def points(lap: Lap) -> Arrays:
        return {"points": np.stack([(u - 319.5) * depth / 525, (v - 239.5) * depth / 525, depth], axis=-1)}

    return points


def check(arrays: Arrays, answer: Arrays) -> dict[str, float]:
    """Compare with the truth: angles of normals, depths; and count what is left."""
    errors = {}
    if "depth" in answer:
        depth = np.where(answer["depth"] > 0, answer["depth"], np.nan)
        apart = depth - arrays["true depth"]
        errors["depth, RMS [mm]"] = 1e3 * float(np.sqrt(np.nanmean(apart**2)))
    if "points" in answer:
        z = answer["points"].reshape(-1, 3)[:, 2]
        errors["points [%]"] = 100 * float((z > 0).sum()) / PIXELS
    if "normals" in answer:
        normals = np.asarray(answer["normals"], np.float64).reshape(-1, 3)
        lengths = np.linalg.norm(normals, axis=1)
        with np.errstate(invalid="ignore", divide="ignore"):
            cosines = np.abs((normals * arrays["normals"]).sum(axis=1)) / lengths
        angles = np.degrees(np.arccos(np.clip(cosines, 0, 1)))
        errors["median angle [deg]"] = float(np.nanmedian(angles))
        errors["normals [%]"] = 100 * float(np.isfinite(angles).mean())
    return errors


def workload(stage: str, title: str, **rest: Any) -> Workload:
    """Return the workload of a stage."""
    makers: dict[str, Callable[..., Run]] = {"nacre": nacre, "OpenCV": opencv, "Open3D": open3d}
    if stage == "points":
        makers["NumPy"] = numpy
    return Workload(
        name=f"depth-{stage}",
        title=f"Depth frame of 640 x 480: {title}",
        items=PIXELS,
        data=frame,
        contenders=[Contender(peer, partial(make, stage=stage)) for peer, make in makers.items()],
        check=check,
        limits={},
        goal=1,
        **rest,
    )


WORKLOADS = [
    workload(
        "points",
        "to points",
        bound=Bound("4 B read and 12 B written", PIXELS * 16),
    ),
    workload(
        "normals",
        "normals",
        bound=Bound(
            "4 B read and 12 B written; a window of 25 pixels with 3 moments each",
            PIXELS * 16,
            PIXELS * 150,
        ),
        note="nacre fits a plane to a window of at least 5 x 5 pixels of the depth image, and makes points "
        "on the way. OpenCV's FALS (5 x 5) and Open3D's cross product of differences are given the points.",
    ),
    workload(
        "clean",
        "cleaning",
        bound=Bound("4 B read and 4 B written", PIXELS * 8),
        note="nacre removes mixed pixels at edges, slanted surfaces and speckles, and smooths nothing; the "
        "others smooth (bilateral, 5 x 5), and remove nothing.",
    ),
    workload(
        "all",
        "cleaned, to points with normals",
        milliseconds=3,
        bound=Bound("4 B read, 4 + 12 + 12 B written", PIXELS * 32, PIXELS * 150),
    ),
]
