"""Exact nearest neighbours: build a tree, and ask it."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from suite.clouds import cloud
from suite.native import function, touched
from suite.workload import Arrays, Bound, Contender, Lap, Run, Workload


def nacre(arrays: Arrays, threads: int, k: int) -> Run:
    """Float32 in; distances and indices out."""
    from nacre import KdTree

    def run(lap: Lap) -> Arrays:
        tree = KdTree(arrays["points"], num_threads=threads)
        lap("build")
        distances, indices = tree.query(arrays["queries"], k, num_threads=threads)
        lap("query")
        return {"distances": distances, "indices": indices}

    return run


def scipy(arrays: Arrays, threads: int, k: int) -> Run:
    """Float64, which it would make from float32."""
    from scipy.spatial import cKDTree

    def run(lap: Lap) -> Arrays:
        tree = cKDTree(arrays["points64"])
        lap("build")
        distances, indices = tree.query(arrays["queries64"], k, workers=threads)
        lap("query")
        return {"distances": distances, "indices": indices}

    return run


def pykdtree(arrays: Arrays, threads: int, k: int) -> Run:
    """Float32; threads by OMP_NUM_THREADS."""
    from pykdtree.kdtree import KDTree

    def run(lap: Lap) -> Arrays:
        tree = KDTree(arrays["points"])
        lap("build")
        distances, indices = tree.query(arrays["queries"], k)
        lap("query")
        return {"distances": distances, "indices": indices}

    return run


def small_gicp(arrays: Arrays, threads: int, k: int) -> Run:
    """Float64, the only type that it takes."""
    from small_gicp import KdTree

    def run(lap: Lap) -> Arrays:
        tree = KdTree(arrays["points64"], num_threads=threads)
        lap("build")
        indices, squared = tree.batch_knn_search(arrays["queries64"], k, num_threads=threads)
        lap("query")
        return {"squared distances": squared, "indices": indices}

    return run


def open3d(arrays: Arrays, threads: int, k: int) -> Run:
    """Float32 tensors; threads by the process's affinity."""
    from open3d import core

    def run(lap: Lap) -> Arrays:
        tree = core.nns.NearestNeighborSearch(core.Tensor.from_numpy(arrays["points"]))
        tree.knn_index()
        lap("build")
        indices, squared = tree.knn_search(core.Tensor.from_numpy(arrays["queries"]), k)
        lap("query")
        return {"squared distances": squared.numpy(), "indices": indices.numpy()}

    return run


def native(arrays: Arrays, threads: int, k: int, peer: str, index: Any) -> Run:
    """C++: one call from arrays to arrays that exist already."""
    knn = function(peer, "knn", ctypes.c_double)
    points, queries = arrays["points"], arrays["queries"]
    squared, indices = touched((len(queries), k), np.float32), touched((len(queries), k), index)

    def run(lap: Lap) -> Arrays:
        lap("build", knn(points, len(points), queries, len(queries), k, threads, squared, indices))
        lap("query")
        return {"squared distances": squared, "indices": indices}

    return run


def contenders(k: int) -> list[Contender]:
    """Return all that find exact neighbours."""
    makers: dict[str, Callable[..., Run]] = {
        "nacre": nacre,
        "nanoflann": partial(native, peer="nanoflann", index=np.uint32),
        "FLANN": partial(native, peer="flann", index=np.int32),
        "small_gicp": small_gicp,
        "pykdtree": pykdtree,
        "SciPy": scipy,
        "Open3D": open3d,
    }
    return [Contender(peer, partial(make, k=k)) for peer, make in makers.items()]


def data(size: int, ordered: bool, k: int, other: bool = False) -> Arrays:
    """Return points and queries, and what SciPy finds for some of the queries."""
    from scipy.spatial import cKDTree

    points = cloud(size, ordered=ordered)
    queries = cloud(size, seed=2, ordered=ordered) if other else points
    rows = np.random.default_rng(3).choice(size, min(size, 5000), replace=False)
    expected, _ = cKDTree(points["points64"]).query(queries["points64"][rows], k, workers=-1)
    return {
        "points": points["points"],
        "points64": points["points64"],
        "queries": queries["points"],
        "queries64": queries["points64"],
        "rows": rows,
        "expected": expected.reshape(len(rows), k),
    }


def check(arrays: Arrays, answer: Arrays) -> dict[str, float]:
    """Compare the distances that were returned, and those of the indices, with SciPy's."""
    rows, expected = arrays["rows"], arrays["expected"]
    indices = answer["indices"].reshape(len(arrays["queries"]), -1)[rows].astype(np.int64)
    offsets = arrays["points64"][indices] - arrays["queries64"][rows][:, None]
    real = np.sort(np.linalg.norm(offsets, axis=2), axis=1)
    told = answer.get("distances")
    told = np.sqrt(np.asarray(answer["squared distances"], np.float64)) if told is None else told
    told = told.reshape(len(arrays["queries"]), -1)[rows].astype(np.float64)
    scale = expected.max(axis=1, keepdims=True)
    return {
        "distance error": float((np.abs(told - expected) / scale).max()),
        "index error": float((np.abs(real - expected) / scale).max()),
    }


def self_query(size: int, ordered: bool, goal: float | None = None) -> Workload:
    """Return the workload of all points' own neighbours."""
    k = 16
    alone = size > 1_000_000
    order = "spatial" if ordered else "random"
    return Workload(
        name=f"knn-{size // 1000}k-{'ordered' if ordered else 'random'}",
        title=f"k-d tree and k = {k} of every point, {size:,} points in {order} order",
        items=size,
        data=partial(data, size, ordered, k),
        contenders=contenders(k)[: 1 if alone else None],
        check=check,
        limits={"distance error": 1e-5, "index error": 1e-6},
        goal=goal,
        quick=size <= 100_000,
        most_threads_only=alone or (ordered and size > 100_000),
        bound=Bound(
            "12 B read, 16 B of tree written and read, 16 (4 + 8) B of answer written; "
            "16 distances of 8 operations",
            size * (12 + 32 + 192),
            size * 16 * 8,
        ),
        note="Noisy bumpy surface. Errors are relative to the distance of the last neighbour.",
    )


WORKLOADS = [
    self_query(10_000, ordered=False),
    self_query(100_000, ordered=False, goal=2.5),
    self_query(1_000_000, ordered=False, goal=4),
    self_query(10_000_000, ordered=False),
    self_query(10_000, ordered=True),
    self_query(100_000, ordered=True),
    self_query(1_000_000, ordered=True),
    Workload(
        name="nearest-100k-random",
        title="k-d tree of 100,000 points and the nearest of each point of another cloud, random order",
        items=100_000,
        data=partial(data, 100_000, False, 1, True),
        contenders=contenders(1),
        check=check,
        limits={"distance error": 1e-5, "index error": 1e-6},
        goal=1.5,
        bound=Bound(
            "24 B read, 32 B of tree written and read, 12 B of answer written; 1 distance of 8 operations",
            100_000 * 68,
            100_000 * 8,
        ),
    ),
]
