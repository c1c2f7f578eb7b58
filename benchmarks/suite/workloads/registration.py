"""ICP: how long it takes, from NumPy arrays, to a pose that is right."""

from __future__ import annotations

from functools import cache, partial
from typing import Any

import numpy as np

from suite.clouds import degrees_between, rotation, scan
from suite.native import POINTER, function
from suite.workload import Arrays, Contender, Lap, Run, Workload

SIZE = 100_000
AXES = ((1, 2, 3), (-2, 1, 1), (2, -2, 1), (0, 0, -1))
GATE = 0.03


@cache
def pairs() -> dict[str, Any]:
    """Return pairs of scans of one surface, 10 degrees and 7.5 mm apart, each pair with other noise."""
    truth = np.tile(np.eye(4), (len(AXES), 1, 1))
    sources, targets = [], []
    for i, axis in enumerate(AXES):
        truth[i, :3, :3] = rotation(axis, 10)
        truth[i, :3, 3] = 0.0025 * np.array([2, -1, 2]) * (-1) ** i
        targets.append(scan(SIZE, 10 + 2 * i)[0].astype(np.float32))
        source = (scan(SIZE, 11 + 2 * i)[0] - truth[i, :3, 3]) @ truth[i, :3, :3]
        sources.append(source.astype(np.float32))
    arrays: dict[str, Any] = {"sources": np.array(sources), "targets": np.array(targets), "truth": truth}
    return {**arrays, **{f"{name}64": arrays[name].astype(np.float64) for name in ("sources", "targets")}}


def of_each(align: Any, sources: Any, targets: Any) -> Run:
    """Return a run that aligns every pair."""
    return lambda lap: {"poses": np.array([align(s, t) for s, t in zip(sources, targets, strict=True)])}


def nacre(arrays: Arrays, threads: int, **settings: Any) -> Run:
    """Float32, no normals given."""
    from nacre import align

    def pose(source: Any, target: Any) -> Any:
        return align(source, target, num_threads=threads, **settings).target_from_source

    return of_each(pose, arrays["sources"], arrays["targets"])


def small_gicp(arrays: Arrays, threads: int, kind: str, voxel: float) -> Run:
    """Float64; its convenience function, which samples down, estimates covariances and aligns."""
    from small_gicp import align

    settings: dict[str, Any] = {
        "registration_type": kind,
        "downsampling_resolution": voxel,
        "voxel_resolution": 1.5 * voxel,
        "max_correspondence_distance": GATE,
        "max_iterations": 30,
        "num_threads": threads,
    }

    def pose(source: Any, target: Any) -> Any:
        return align(target, source, **settings).T_target_source

    return of_each(pose, arrays["sources64"], arrays["targets64"])


def open3d_legacy(arrays: Arrays, threads: int, voxel: float) -> Run:
    """Float64; point-to-plane after a voxel grid."""
    from open3d import geometry, pipelines, utility

    registration = pipelines.registration
    criteria = registration.ICPConvergenceCriteria(1e-6, 1e-6, 30)
    metric = registration.TransformationEstimationPointToPlane()

    def pose(source: Any, target: Any) -> Any:
        clouds = [geometry.PointCloud(utility.Vector3dVector(points)) for points in (source, target)]
        clouds = [cloud.voxel_down_sample(voxel) for cloud in clouds]
        clouds[1].estimate_normals(geometry.KDTreeSearchParamKNN(16))
        return registration.registration_icp(*clouds, GATE, np.eye(4), metric, criteria).transformation

    return of_each(pose, arrays["sources64"], arrays["targets64"])


def open3d_tensor(arrays: Arrays, threads: int, voxel: float) -> Run:
    """Float32; point-to-plane after a voxel grid."""
    from open3d import core, t

    registration = t.pipelines.registration
    criteria = registration.ICPConvergenceCriteria(1e-6, 1e-6, 30)
    metric = registration.TransformationEstimationPointToPlane()

    def pose(source: Any, target: Any) -> Any:
        tensors = [core.Tensor.from_numpy(points) for points in (source, target)]
        clouds = [t.geometry.PointCloud(points).voxel_down_sample(voxel) for points in tensors]
        clouds[1].estimate_normals(max_nn=16)
        result = registration.icp(*clouds, GATE, estimation_method=metric, criteria=criteria)
        return result.transformation.numpy()

    return of_each(pose, arrays["sources"], arrays["targets"])


def pcl(arrays: Arrays, threads: int, voxel: float) -> Run:
    """C++, from clouds of its own; point-to-plane after a voxel grid."""
    load, align, release = (
        function("pcl", "load", POINTER),
        function("pcl", "align"),
        function("pcl", "release"),
    )
    sources = [load(points, SIZE) for points in arrays["sources"]]
    targets = [load(points, SIZE) for points in arrays["targets"]]

    def run(lap: Lap) -> Arrays:
        poses = np.empty((len(AXES), 4, 4), np.float32)
        for source, target, pose in zip(sources, targets, poses, strict=True):
            align(source, target, voxel, GATE, 30, threads, pose)
        lap("align")
        for cloud in sources + targets:
            release(cloud)
        return {"poses": poses.astype(np.float64)}

    return run


def check(arrays: Arrays, answer: Arrays) -> dict[str, float]:
    """Compare the poses with the truth; the worst of the pairs."""
    both = list(zip(answer["poses"], arrays["truth"], strict=True))
    return {
        "rotation [deg]": max(degrees_between(pose, truth) for pose, truth in both),
        "translation [mm]": max(1e3 * float(np.linalg.norm((p - t)[:3, 3])) for p, t in both),
    }


WORKLOADS = [
    Workload(
        name="icp-100k",
        title="ICP of two scans of 100,000 points, 10 degrees and 7.5 mm apart, from NumPy",
        items=2 * SIZE,
        data=pairs,
        contenders=[
            Contender("nacre", nacre),
            Contender("nacre", partial(nacre, max_points=4000, max_samples=2000), "4000 points"),
            Contender("small_gicp", partial(small_gicp, kind="GICP", voxel=0.004), "GICP, 4 mm grid"),
            Contender("small_gicp", partial(small_gicp, kind="GICP", voxel=0.008), "GICP, 8 mm grid"),
            Contender("small_gicp", partial(small_gicp, kind="VGICP", voxel=0.008), "VGICP, 8 mm grid"),
            Contender("Open3D", partial(open3d_legacy, voxel=0.004), "legacy, 4 mm grid"),
            Contender("Open3D", partial(open3d_legacy, voxel=0.010), "legacy, 10 mm grid"),
            Contender("Open3D", partial(open3d_tensor, voxel=0.010), "tensor, 10 mm grid"),
            Contender("PCL", partial(pcl, voxel=0.010), "10 mm grid"),
        ],
        check=check,
        limits={"rotation [deg]": 0.5},
        goal=5,
        steps=len(AXES),
        note="Bumpy closed surface of 0.15 m, sigma 0.5 mm. Preprocessing is included. Four pairs a run; "
        "times are of one, errors of the worst. "
        "The peers' grids are those that were fastest in trials with the truth in hand.",
    )
]
