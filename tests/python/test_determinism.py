"""The same bits for any number of threads, and every time."""

import functools
import hashlib
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import nacre

THREADS = [1, 2, 3, 4, 7, 8]


def digest(*arrays: Any) -> str:
    """Return the SHA-256 of arrays: their types, shapes and bytes."""
    total = hashlib.sha256()
    for value in arrays:
        array = np.ascontiguousarray(value)
        total.update(f"{array.dtype}{array.shape}".encode())
        total.update(array.tobytes())
    return total.hexdigest()


@functools.cache
def camera() -> nacre.Camera:
    return nacre.default_camera(thing())


@functools.cache
def thing() -> nacre.Mesh:
    return nacre.built_in_object()


@functools.cache
def depth(index: int) -> Any:
    pose = nacre.turntable_poses(thing(), 24, np.radians(15))[index]
    return thing().simulate_depth(camera(), pose, noise=0.0005, edge_mixing=1.0, seed=index, num_threads=1)


@functools.cache
def points(index: int) -> Any:
    clean = nacre.preprocess_depth(depth(index), camera(), num_threads=1)
    return nacre.back_project(clean, camera())[::3]


def of_align(method: Any, num_threads: int) -> str:
    result = nacre.align(points(1), points(0), method=method, num_threads=num_threads)
    return digest(
        result.target_from_source,
        result.information,
        result.weak_directions,
        result.center,
        [result.rmse, result.overlap, result.iterations, result.num_inliers],
    )


def of_consolidate(method: Any, num_threads: int) -> str:
    thin = nacre.consolidate(
        points(0), num_points=400, method=method, iterations=5, attributes=points(0), num_threads=num_threads
    )
    return digest(thin.points, thin.attributes["attributes"], thin.sources)


def of_tree(num_threads: int) -> str:
    found = []
    for dtype in (np.float32, np.float64):
        tree = nacre.KdTree(points(0).astype(dtype), num_threads=num_threads)
        found += tree.query(points(1).astype(dtype), k=7, num_threads=num_threads)
        near = tree.query_radius(points(1).astype(dtype), 0.004, num_threads=num_threads)
        found += [near.offsets, near.indices, near.distances]
    return digest(*found)


def of_model(preset: Any, num_threads: int) -> str:
    model = nacre.Model(camera(), preset, num_threads=num_threads)
    for index in range(3):
        model.add_frame(depth(index), np.full((*depth(0).shape, 3), 40 * index, np.uint8))
    colors = model.colors
    return digest(
        model.points,
        model.normals,
        model.confidence,
        model.poses,
        np.zeros(0) if colors is None else colors,
        [report.num_points for report in model.frames],
        [report.information for report in model.frames],
        [report.rmse for report in model.frames],
    )


@functools.cache
def relief(index: int) -> Any:
    """A wavy wall that fills an image, so that the model is larger than what a frame is registered to."""
    v, u = np.mgrid[:480, :640]
    noise = np.random.default_rng(index).normal(scale=0.0005, size=u.shape)
    return (0.8 + 0.02 * np.sin(u / 23 + 0.02 * index) * np.cos(v / 31) + noise).astype(np.float32)


def of_large_model(num_threads: int) -> str:
    wide = nacre.Camera(width=640, height=480, fx=525, fy=525, cx=319.5, cy=239.5)
    model = nacre.Model(wide, num_threads=num_threads)
    for index in range(3):
        model.add_frame(relief(index))
    assert len(model) > 30000
    return digest(model.points, model.normals, model.poses)


def of_simulation(num_threads: int) -> str:
    pose = nacre.turntable_poses(thing())[1]
    return digest(
        thing().simulate_depth(
            camera(),
            pose,
            noise="kinect",
            edge_mixing=1.5,
            quantization=0.0001,
            dropout=0.1,
            seed=5,
            num_threads=num_threads,
        )
    )


def of_preprocessing(edge_test: Any, num_threads: int) -> str:
    clean, report = nacre.preprocess_depth(
        depth(0), camera(), edge_test=edge_test, return_report=True, num_threads=num_threads
    )
    noise = nacre.estimate_noise(clean, camera(), num_threads=num_threads)
    normals = nacre.depth_normals(clean, camera(), num_threads=num_threads)
    return digest(clean, normals, [noise.constant, noise.quadratic, noise.offset], [report.num_edge])


def of_normals(num_threads: int) -> str:
    return digest(
        *(
            nacre.estimate_normals(points(0).astype(t), k=12, num_threads=num_threads)
            for t in (np.float32, np.float64)
        )
    )


WORK: dict[str, Callable[[int], str]] = {
    "align symmetric": functools.partial(of_align, "symmetric"),
    "align point_to_plane": functools.partial(of_align, "point_to_plane"),
    "align paper": functools.partial(of_align, "paper"),
    "align point_to_point": functools.partial(of_align, "point_to_point"),
    "consolidate wlop": functools.partial(of_consolidate, "wlop"),
    "consolidate wlop+": functools.partial(of_consolidate, "wlop+"),
    "consolidate cgal": functools.partial(of_consolidate, "cgal"),
    "KdTree": of_tree,
    "estimate_normals": of_normals,
    "preprocess inverse_depth": functools.partial(of_preprocessing, "inverse_depth"),
    "preprocess gradient": functools.partial(of_preprocessing, "gradient"),
    "simulate_depth": of_simulation,
    "Model default": functools.partial(of_model, "default"),
    "Model default, large": of_large_model,
    "Model paper": functools.partial(of_model, "paper"),
}


@pytest.mark.parametrize("work", WORK)
def test_same_bits_for_any_number_of_threads(work: str) -> None:
    expected = WORK[work](1)
    assert {threads: WORK[work](threads) for threads in THREADS} == dict.fromkeys(THREADS, expected)


@pytest.mark.parametrize("work", WORK)
def test_same_bits_with_all_threads(work: str) -> None:
    assert WORK[work](0) == WORK[work](1)


def in_another_process(works: list[str], **environment: str) -> list[str]:
    """Return the digests of some works, or what went wrong."""
    folder = str(Path(__file__).parent)
    program = f"import sys; sys.path.insert(0, {folder!r}); import test_determinism as t; "
    program += f"[print(t.WORK[work](2)) for work in {works!r}]"
    done = subprocess.run(
        [sys.executable, "-c", program],
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        check=False,
    )
    return done.stdout.split() if done.returncode == 0 else [done.stderr]


def test_same_bits_every_time() -> None:
    """Whatever was in the memory before."""
    works = ["align symmetric", "Model default, large"]
    digests = [in_another_process(works, MALLOC_PERTURB_=perturb) for perturb in ("0", "85", "170")]
    assert digests == [digests[0]] * 3
    assert len(digests[0]) == 2


@pytest.mark.parametrize("instruction_set", ["baseline", "avx2", "avx512"])
def test_same_bits_on_every_instruction_set(instruction_set: str) -> None:
    """Except for consolidation, and the paper's preset with it, which fuse multiplications where they can."""
    works = [work for work in WORK if "consolidate" not in work and "paper" not in work]
    digests = in_another_process(works, NACRE_SIMD=instruction_set)
    if "which this processor does not have" in digests[0]:
        pytest.skip(f"this processor has no {instruction_set}")
    assert dict(zip(works, digests, strict=True)) == {work: WORK[work](1) for work in works}


def test_digest_tells_a_single_bit() -> None:
    """Or the tests above could not fail."""
    array = np.ones((3, 3), np.float32)
    other = array.copy()
    other[1, 1] = np.nextafter(other[1, 1], np.float32(2))
    assert digest(array) != digest(other)
    assert digest(array) != digest(array.reshape(9))
    assert digest(array) == digest(np.asfortranarray(array))
