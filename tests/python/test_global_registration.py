"""Registration without a first guess: known motions, shapes that leave it open, data without an answer."""

import functools
import inspect
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import nacre
from nacre import _core

Array = npt.NDArray[Any]
CAMERA = nacre.Camera(width=160, height=120, fx=200, fy=200, cx=79.5, cy=59.5)
ORIGIN = (0.0, 0.0, 0.0)


def random_rotation(rng: np.random.Generator) -> Array:
    q, r = np.linalg.qr(rng.normal(size=(3, 3)))
    q = q * np.sign(np.diag(r))
    return q if np.linalg.det(q) > 0 else -q


def random_motion(seed: int) -> Array:
    rng = np.random.default_rng(seed)
    pose = np.eye(4)
    pose[:3, :3] = random_rotation(rng)
    pose[:3, 3] = rng.uniform(-1, 1, 3)
    return pose


def moved(pose: Array, points: Array) -> Array:
    return points @ pose[:3, :3].T + pose[:3, 3]


def errors(pose: Array, truth: Array, points: Array) -> tuple[float, float]:
    """Return the angle between two motions [degrees] and how far apart they take the points' middle [m]."""
    cosine = (np.trace(pose[:3, :3] @ truth[:3, :3].T) - 1) / 2
    middle = points.mean(axis=0, keepdims=True)
    shift = np.linalg.norm(moved(pose, middle) - moved(truth, middle))
    return float(np.degrees(np.arccos(np.clip(cosine, -1, 1)))), float(shift)


@functools.cache
def thing() -> nacre.Mesh:
    """Return the built-in object about the origin."""
    mesh = nacre.built_in_object()
    return nacre.Mesh(mesh.vertices - mesh.bounds.mean(axis=0), mesh.triangles)


def camera_at(direction: Array, up: Array, distance: float) -> Array:
    """Return the pose of a camera that looks at the origin."""
    z = -direction / np.linalg.norm(direction)
    x = np.cross(z, up)
    x /= np.linalg.norm(x)
    pose = np.eye(4)
    pose[:3, :3] = np.stack([x, np.cross(z, x), z], axis=1)
    pose[:3, 3] = -distance * z
    return pose


def view(azimuth: float, height: float = 0.3, sigma: float = 0.0005) -> tuple[Array, Array, Array]:
    """Return points and normals that a camera sees, in its frame, and its pose."""
    direction = np.array([np.cos(azimuth), np.sin(azimuth), height])
    size = float(np.linalg.norm(thing().bounds[1] - thing().bounds[0]))
    pose = camera_at(direction, np.array([0.2, -0.1, 1.0]), 1.8 * size)
    depth = thing().simulate_depth(CAMERA, pose, noise=sigma, seed=int(1000 * azimuth))
    normals = nacre.depth_normals(depth, CAMERA)[np.isfinite(depth)]
    points = nacre.back_project(depth, CAMERA)
    usable = np.isfinite(normals).all(axis=1)
    return points[usable], normals[usable], pose


def sphere(count: int, seed: int) -> Array:
    directions = np.random.default_rng(seed).normal(size=(count, 3))
    points: Array = 0.1 * directions / np.linalg.norm(directions, axis=1, keepdims=True)
    return points


@functools.cache
def whole(seed: int) -> tuple[Array, Array]:
    """Return points all over the built-in object, and its normals there."""
    samples = nacre.evaluation.sample_surface(thing().vertices, thing().triangles, 5000, seed=seed)
    return samples.points, samples.normals


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("with_normals", [True, False])
def test_any_motion_of_the_whole_object(seed: int, with_normals: bool) -> None:
    truth = random_motion(seed)
    target, target_normals = whole(1)
    points, normals = whole(2)
    source = moved(np.linalg.inv(truth), points)
    options: dict[str, Any] = {}
    if with_normals:
        options = {"source_normals": normals @ truth[:3, :3], "target_normals": target_normals}
    result = nacre.align_global(source, target, **options)
    angle, shift = errors(result.target_from_source, truth, source)
    assert result.found, result
    assert angle < 0.5
    assert shift < 0.0005


@pytest.mark.parametrize("azimuth", [1.1, 2.5, 4.0])
def test_views_from_sides_sixty_degrees_apart(azimuth: float) -> None:
    source, source_normals, source_pose = view(azimuth, 0.1)
    target, target_normals, target_pose = view(azimuth + np.pi / 3, 0.5)
    result = nacre.align_global(
        source,
        target,
        source_normals=source_normals,
        target_normals=target_normals,
        source_viewpoint=ORIGIN,
        target_viewpoint=ORIGIN,
    )
    truth = np.linalg.inv(target_pose) @ source_pose
    angle, shift = errors(result.target_from_source, truth, source)
    assert angle < 2
    assert shift < 0.002
    assert result.consistency > 0.6
    assert result.tolerance > result.rmse


def test_far_away_float64_coordinates_keep_their_digits() -> None:
    truth = random_motion(7)
    far = np.array([1e6, -2e6, 5e5])
    source = moved(np.linalg.inv(truth), whole(2)[0])
    result = nacre.align_global(source - 3 * far, whole(1)[0] + far)
    end = moved(result.target_from_source, source - 3 * far) - far
    assert result.found
    assert np.abs(end - whole(2)[0]).max() < 0.003
    assert np.linalg.norm(result.center - far) < 0.2


def test_a_sphere_leaves_the_rotation_open() -> None:
    result = nacre.align_global(sphere(3000, 1), sphere(3000, 2))
    assert result.status == "ambiguous"
    assert not result.found


def test_unrelated_shapes_are_not_joined() -> None:
    target, target_normals = whole(1)
    size = np.linalg.norm(np.ptp(target, axis=0))
    rng = np.random.default_rng(3)
    box = rng.uniform(-0.25, 0.25, (4000, 3))
    box[np.arange(4000), rng.integers(0, 3, 4000)] = rng.choice([-0.25, 0.25], 4000)
    others = (
        size / 0.3 * sphere(4000, 1),
        size * box * [1, 0.7, 0.4],
        size * rng.uniform(-0.3, 0.3, (4000, 3)),
    )
    for other in others:
        result = nacre.align_global(other, target, target_normals=target_normals)
        assert not result.found, result


def test_views_of_unrelated_sides_are_not_joined() -> None:
    """Two views from opposite sides share next to nothing."""
    source, source_normals, source_pose = view(0.4)
    target, target_normals, target_pose = view(0.4 + np.pi)
    result = nacre.align_global(
        source,
        target,
        source_normals=source_normals,
        target_normals=target_normals,
        source_viewpoint=ORIGIN,
        target_viewpoint=ORIGIN,
        outlines=True,
    )
    truth = np.linalg.inv(target_pose) @ source_pose
    assert not result.found or errors(result.target_from_source, truth, source)[0] < 3


def test_the_same_bits_for_any_number_of_threads() -> None:
    source, source_normals, _ = view(1.0)
    target, target_normals, _ = view(1.8)
    poses = [
        nacre.align_global(
            source,
            target,
            source_normals=source_normals,
            target_normals=target_normals,
            source_viewpoint=ORIGIN,
            num_rotations=64,
            num_threads=threads,
        ).target_from_source.tobytes()
        for threads in (1, 2, 4)
    ]
    assert poses[0] == poses[1] == poses[2]


@pytest.mark.parametrize(
    "points",
    [np.zeros((0, 3)), np.full((100, 3), np.nan), np.eye(3)],
    ids=["empty", "NaN", "three points"],
)
def test_too_few_points(points: Array) -> None:
    for source, target in ((points, whole(1)[0]), (whole(1)[0], points), (points, points)):
        result = nacre.align_global(source, target)
        assert result.status == "too_few_points"
        assert not result.found
        assert (result.target_from_source == np.eye(4)).all()
        assert np.isnan(result.rmse)


@pytest.mark.parametrize("points", [np.ones((100, 3)), np.linspace(0, 1, 300).reshape(-1, 1) * [1, 2, 3]])
def test_points_without_a_surface_are_not_joined(points: Array) -> None:
    assert not nacre.align_global(points, whole(1)[0]).found
    assert not nacre.align_global(points, points).found


@pytest.mark.parametrize(
    ("changes", "error", "words"),
    [
        ({"source": np.zeros((3, 2))}, ValueError, r"source must have shape \(N, 3\), got \(3, 2\)"),
        ({"target": ["a"]}, TypeError, "target must be an array of real numbers"),
        ({"source_normals": np.zeros((2, 3))}, ValueError, "source_normals must have one row per point"),
        ({"target_viewpoint": (0, 0)}, ValueError, "target_viewpoint must be 3 finite numbers"),
        ({"source_viewpoint": (0, 0, np.inf)}, ValueError, "source_viewpoint must be 3 finite numbers"),
        ({"num_rotations": 0}, ValueError, "num_rotations must be at least 1, got 0"),
        ({"num_candidates": 1}, ValueError, "num_candidates must be at least 2, got 1"),
        ({"tolerance": -1.0}, ValueError, "tolerance must be 0 .automatic. or a positive distance"),
        ({"max_angle": 0.0}, ValueError, "max_angle must be a positive angle"),
        ({"min_overlap": 1.5}, ValueError, r"min_overlap must be in \[0, 1\], got 1.5"),
        ({"min_consistency": -0.1}, ValueError, r"min_consistency must be in \[0, 1\]"),
        ({"max_residual": 0.0}, ValueError, "max_residual must be positive"),
        ({"max_rivalry": 2.0}, ValueError, r"max_rivalry must be in \[0, 1\]"),
        ({"max_points": -1}, ValueError, "max_points must be 0 .no limit. or more"),
        ({"max_samples": 0}, ValueError, "max_samples must be at least 1"),
        ({"coarse_samples": 0}, ValueError, "coarse_samples must be at least 1"),
        ({"num_threads": -1}, ValueError, "num_threads must be 0"),
        ({"seed": 0.5}, TypeError, "seed must be of type int"),
    ],
)
def test_misuse_names_the_argument(changes: Any, error: Any, words: str) -> None:
    arguments = {"source": np.zeros((4, 3)), "target": np.zeros((4, 3)), **changes}
    with pytest.raises(error, match=words):
        nacre.align_global(**arguments)


def test_defaults_are_those_of_the_core() -> None:
    core = _core.GlobalAlignOptions()
    for name, parameter in inspect.signature(nacre.align_global).parameters.items():
        if hasattr(core, name):
            assert parameter.default == getattr(core, name), name
