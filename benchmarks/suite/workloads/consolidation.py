"""WLOP: fewer, evenly spread points."""

from __future__ import annotations

from functools import cache, partial
from typing import Any

import numpy as np

from suite.clouds import cloud
from suite.native import POINTER, function
from suite.workload import Arrays, Bound, Contender, Lap, Run, Workload

ITERATIONS, CGAL_MU, NEIGHBORS = 10, 0.45, 30


def nacre(arrays: Arrays, threads: int, size: int) -> Run:
    """Float32; its own choice of the samples that it starts from."""
    from nacre import consolidate

    settings: dict[str, Any] = {"method": "cgal", "mu": CGAL_MU, "iterations": ITERATIONS}
    settings.update(num_points=size, radius=float(arrays["radius"]), num_threads=threads)
    return lambda lap: {"points": consolidate(arrays["points"], **settings).points}


def cgal(arrays: Arrays, threads: int, size: int) -> Run:
    """C++, from a vector of its own; its own choice of the samples that it starts from."""
    load, consolidate = function("cgal", "load", POINTER), function("cgal", "consolidate", POINTER)
    unload = function("cgal", "unload")
    points = load(arrays["points64"], len(arrays["points64"]))
    percentage = 100.0 * size / len(arrays["points64"])

    def run(lap: Lap) -> Arrays:
        count = consolidate(points, percentage, float(arrays["radius"]), ITERATIONS)
        lap("consolidate")
        result, starts = np.empty((count, 3)), np.empty((count, 3))
        unload(points, result, starts)
        return {"points": result, "starts": starts}

    return run


def check(arrays: Arrays, answer: Arrays, size: int) -> dict[str, float]:
    """Start nacre from the samples that CGAL started from: how far apart do they end."""
    from nacre import KdTree, project_samples

    points = answer["points"]
    errors = {"points": float(len(points))}
    if "starts" in answer:
        settings: dict[str, Any] = {"method": "cgal", "mu": CGAL_MU, "iterations": ITERATIONS}
        radius = float(arrays["radius"])
        ours = project_samples(answer["starts"], arrays["points64"], radius=radius, **settings)
        spacing = float(np.median(KdTree(points).query(points, 2)[0][:, 1]))
        apart = np.linalg.norm(ours - points, axis=1) / spacing
        errors["nacre apart, median [spacings]"] = float(np.median(apart))
        errors["nacre apart by more than 1e-4 [%]"] = 100 * float((apart > 1e-4).mean())
    return errors


@cache
def data(size: int) -> dict[str, Any]:
    """Return a cloud, and the radius within which a point has so many neighbours."""
    from scipy.spatial import cKDTree

    arrays = cloud(size)
    points = arrays["points64"]
    distances, _ = cKDTree(points).query(points[:2000], [NEIGHBORS + 1])
    return {**arrays, "radius": np.array(np.median(distances))}


def workload(of: int, percent: int, goal: float, **rest: Any) -> Workload:
    """Return the workload of CGAL's kernel for one size and percentage."""
    size = of * percent // 100
    pairs = size * ITERATIONS * NEIGHBORS * (1 + 2 * percent / 100)
    return Workload(
        name=f"wlop-cgal-{of // 1000}k-{percent}",
        title=f"WLOP with CGAL's kernel, {of:,} points to {percent} %",
        items=of,
        data=partial(data, of),
        contenders=[
            Contender("nacre", partial(nacre, size=size)),
            Contender("CGAL", partial(cgal, size=size)),
        ],
        check=partial(check, size=size),
        limits={},
        goal=goal,
        bound=Bound(
            f"for each sample and iteration {NEIGHBORS} points and, for density and repulsion, twice "
            "the samples among them; 20 operations each",
            operations=20 * pairs,
        ),
        note=f"About {NEIGHBORS} neighbours, {ITERATIONS} iterations. Each chooses its samples at random; "
        "then nacre starts from CGAL's, and the results are compared.",
        **rest,
    )


def paper(arrays: Arrays, threads: int) -> Run:
    """Take the method literally, with density weights for both sets."""
    from nacre import consolidate

    settings: dict[str, Any] = {
        "method": "wlop",
        "radius": 0.008,
        "num_points": 2000,
        "iterations": ITERATIONS,
    }
    return lambda lap: {"points": consolidate(arrays["points"], num_threads=threads, **settings).points}


@cache
def first_frame() -> dict[str, Any]:
    """Return the points of an orthographic depth image of nacre's own object."""
    import nacre

    mesh = nacre.built_in_object()
    camera = nacre.default_camera(mesh)
    pose = nacre.turntable_poses(mesh, 1)[0]
    points = nacre.back_project(mesh.simulate_depth(camera, pose, noise=0.0005), camera)
    return {"points": (points @ pose[:3, :3].T + pose[:3, 3]).astype(np.float32)}


def distance(arrays: Arrays, answer: Arrays) -> dict[str, float]:
    """Measure the distance to the true surface."""
    import nacre

    apart = nacre.built_in_object().distance(answer["points"])
    return {"points": float(len(answer["points"])), "RMS [mm]": 1e3 * float(np.sqrt((apart**2).mean()))}


WORKLOADS = [
    workload(100_000, 50, goal=15),
    workload(1_000_000, 5, goal=15, quick=False),
    workload(1_000_000, 50, goal=30, quick=False, most_threads_only=True),
    Workload(
        name="wlop-paper",
        title="WLOP of the first frame of the 2010 paper: 2000 samples, 8 mm, 10 iterations, density weights",
        items=2000,
        data=first_frame,
        contenders=[Contender("nacre", paper)],
        check=distance,
        limits={},
        milliseconds=3,
        note="The points of one orthographic view of nacre's own object, 1 mm a pixel, sigma 0.5 mm.",
    ),
]
