"""Normals of unorganised points, from NumPy to NumPy."""

from __future__ import annotations

from functools import partial

import numpy as np

from suite.clouds import cloud
from suite.native import POINTER, function
from suite.workload import Arrays, Bound, Contender, Lap, Run, Workload

K = 16


def nacre(arrays: Arrays, threads: int) -> Run:
    """Float32."""
    from nacre import estimate_normals

    return lambda lap: {"normals": estimate_normals(arrays["points"], k=K, num_threads=threads)}


def small_gicp(arrays: Arrays, threads: int) -> Run:
    """Float64, the only type that it takes."""
    from small_gicp import PointCloud, estimate_normals

    def run(lap: Lap) -> Arrays:
        points = PointCloud(arrays["points64"])
        estimate_normals(points, num_neighbors=K, num_threads=threads)
        return {"normals": points.normals()[:, :3]}

    return run


def open3d_legacy(arrays: Arrays, threads: int) -> Run:
    """Float64."""
    from open3d import geometry, utility

    def run(lap: Lap) -> Arrays:
        points = geometry.PointCloud(utility.Vector3dVector(arrays["points64"]))
        points.estimate_normals(geometry.KDTreeSearchParamKNN(K))
        return {"normals": np.asarray(points.normals)}

    return run


def open3d_tensor(arrays: Arrays, threads: int) -> Run:
    """Float32."""
    from open3d import core, t

    def run(lap: Lap) -> Arrays:
        points = t.geometry.PointCloud(core.Tensor.from_numpy(arrays["points"]))
        points.estimate_normals(max_nn=K)
        return {"normals": points.point.normals.numpy()}

    return run


def pcl(arrays: Arrays, threads: int) -> Run:
    """C++, from a cloud of its own."""
    load, compute = function("pcl", "load", POINTER), function("pcl", "normals", POINTER)
    unload, release = function("pcl", "unload"), function("pcl", "release")
    points = load(arrays["points"], len(arrays["points"]))

    def run(lap: Lap) -> Arrays:
        computed = compute(points, K, threads)
        lap("normals")
        normals = np.empty_like(arrays["points"])
        unload(computed, normals)
        release(points)
        return {"normals": normals}

    return run


def cgal(arrays: Arrays, threads: int) -> Run:
    """C++, from a vector of its own."""
    load, compute, unload = (
        function("cgal", "load_oriented", POINTER),
        function("cgal", "normals"),
        function("cgal", "unload_oriented"),
    )
    points = load(arrays["points64"], len(arrays["points64"]))

    def run(lap: Lap) -> Arrays:
        compute(points, K)
        lap("normals")
        normals = np.empty_like(arrays["points64"])
        unload(points, normals)
        return {"normals": normals}

    return run


def check(arrays: Arrays, answer: Arrays) -> dict[str, float]:
    """Measure the angle between normals and the truth, whatever their side."""
    cosines = np.abs((arrays["normals"] * answer["normals"]).sum(axis=1))
    angles = np.degrees(np.arccos(np.clip(cosines, 0, 1)))
    return {
        "median angle [deg]": float(np.nanmedian(angles)),
        "missing [%]": 100 * float(np.isnan(angles).mean()),
    }


def workload(size: int, goal: float | None = None) -> Workload:
    """Return the workload of one size."""
    return Workload(
        name=f"normals-{size // 1000}k",
        title=f"Normals from {K} neighbours, {size:,} points in random order, from NumPy to NumPy",
        items=size,
        data=partial(cloud, size),
        contenders=[
            Contender("nacre", nacre),
            Contender("small_gicp", small_gicp),
            Contender("Open3D", open3d_legacy, "legacy"),
            Contender("Open3D", open3d_tensor, "tensor"),
            Contender("PCL", pcl),
            Contender("CGAL", cgal),
        ],
        check=check,
        limits={"missing [%]": 1.0},
        goal=goal,
        quick=size <= 100_000,
        bound=Bound(
            "12 B read, 16 B of tree written and read, 12 B of normal written; 16 neighbours of "
            "8 operations for the distance and 18 for the covariance",
            size * 56,
            size * 16 * 26,
        ),
        note="The angle is against the true normal of the noisy surface.",
    )


WORKLOADS = [workload(10_000), workload(100_000, goal=4), workload(1_000_000, goal=8)]
