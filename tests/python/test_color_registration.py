"""Colour in registration: it decides the directions that shape leaves open, and nothing else."""

import functools
from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import nacre

Array = npt.NDArray[Any]


@functools.cache
def waves() -> tuple[Array, Array, Array]:
    """Return directions, frequencies [1/m] and phases of a texture with details of 1 to 4 cm."""
    rng = np.random.default_rng(0)
    directions = rng.normal(size=(24, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    return directions, 2 * np.pi / 0.04 * rng.uniform(0.3, 1.2, 24), rng.uniform(0, 2 * np.pi, 24)


def brightness(points: Array) -> Array:
    """Return a texture that fills space, about 128 with a spread of 35."""
    directions, frequencies, phases = waves()
    total = sum(np.sin(f * (points @ d) + p) for d, f, p in zip(directions, frequencies, phases, strict=True))
    return np.asarray(np.clip(128 + 35 * total / np.sqrt(12), 0, 255))


def turned(degrees: float, axis: int, about: Any = (0.0, 0.0, 0.0), shift: Any = (0.0, 0.0, 0.0)) -> Array:
    """Return a turn about an axis of the coordinates through a point, and then a shift."""
    a = np.radians(degrees)
    i, j = [k for k in range(3) if k != axis]
    pose = np.eye(4)
    pose[i, i] = pose[j, j] = np.cos(a)
    pose[i, j], pose[j, i] = -np.sin(a), np.sin(a)
    pose[:3, 3] = np.asarray(about) - pose[:3, :3] @ np.asarray(about) + np.asarray(shift)
    return pose


def off_by(pose: Array, true: Array, at: Any) -> tuple[float, float]:
    """Return the error of a pose at a point [m] and of its turn [degrees]."""
    off = np.linalg.inv(true) @ pose
    point = np.append(at, 1.0)
    angle = np.degrees(np.arccos(np.clip((np.trace(off[:3, :3]) - 1) / 2, -1, 1)))
    return float(np.linalg.norm((off @ point - point)[:3])), float(angle)


# Two clouds

PAIR = turned(1.5, 2, shift=(0.006, -0.004, 0.0))
UP = np.tile([0.0, 0.0, 1.0], (9000, 1))


def plane(pose: Array, seed: int, noise: float = 0.0005, grain: float = 3.0) -> tuple[Array, Array]:
    """Return points of a plane in the frame of a pose, and their brightness; 2.6 mm apart."""
    rng = np.random.default_rng(seed)
    points = np.column_stack([rng.uniform(-0.15, 0.15, 9000), rng.uniform(-0.1, 0.1, 9000), np.zeros(9000)])
    colors = brightness(points) + rng.normal(0, grain, 9000)
    points[:, 2] += rng.normal(0, noise, 9000)
    return points @ pose[:3, :3].T + pose[:3, 3], colors


def align_planes(
    change: Callable[[Array], Array] = lambda colors: colors, **options: Any
) -> nacre.AlignResult:
    source, source_colors = plane(np.linalg.inv(PAIR), 1)
    target, target_colors = plane(np.eye(4), 2)
    return nacre.align(
        source,
        target,
        source_normals=UP,
        target_normals=UP,
        source_colors=change(source_colors),
        target_colors=target_colors,
        **options,
    )


def test_a_textured_plane_is_aligned_to_a_fraction_of_its_spacing() -> None:
    """Measured: 0.02 mm and 0.005 degrees, with points 2.6 mm apart."""
    result = align_planes()
    assert result.converged
    assert result.weak_directions.shape == (0, 6)
    distance, angle = off_by(result.target_from_source, PAIR, (0, 0, 0))
    assert distance < 0.0002
    assert angle < 0.05
    assert np.linalg.eigvalsh(result.information).min() > 0


@pytest.mark.parametrize(
    "change",
    [lambda c: 0.7 * c + 20, lambda c: np.where(np.arange(9000) % 5 == 0, 255.0, c)],
    ids=["exposure", "highlights"],
)
def test_other_light_does_not_matter(change: Callable[[Array], Array]) -> None:
    result = align_planes(change)
    assert len(result.weak_directions) == 0
    assert off_by(result.target_from_source, PAIR, (0, 0, 0))[0] < 0.0005


def test_floats_from_0_to_1_are_the_same_colours() -> None:
    scaled = align_planes(lambda colors: colors / 255)
    assert np.allclose(scaled.target_from_source, align_planes().target_from_source, atol=1e-6)
    assert len(scaled.weak_directions) == 0


def test_red_green_and_blue_are_one_brightness() -> None:
    source, gray = plane(np.linalg.inv(PAIR), 1)
    target, target_gray = plane(np.eye(4), 2)
    result = nacre.align(
        source,
        target,
        source_normals=UP,
        target_normals=UP,
        source_colors=np.repeat(gray[:, None], 3, 1),
        target_colors=np.repeat(target_gray[:, None], 3, 1),
    )
    assert off_by(result.target_from_source, PAIR, (0, 0, 0))[0] < 0.0002


@pytest.mark.parametrize(
    "change",
    [
        lambda c: np.full_like(c, 100),
        lambda c: np.random.default_rng(3).normal(128, 30, c.shape),
        lambda c: np.full_like(c, np.nan),
    ],
    ids=["flat", "noise", "unknown"],
)
def test_colours_that_say_nothing_change_nothing(change: Callable[[Array], Array]) -> None:
    """The pose keeps its initial value along what neither shape nor colour determines."""
    result = align_planes(change)
    assert len(result.weak_directions) == 3
    np.testing.assert_allclose(result.target_from_source[:2, 3], 0, atol=1e-4)


def test_stripes_leave_their_own_direction_open() -> None:
    """Stripes along y tell x and the turn; y stays as it was."""

    def striped(pose: Array, seed: int) -> tuple[Array, Array]:
        points, _ = plane(np.eye(4), seed)
        colors = 128 + 60 * np.sin(2 * np.pi * points[:, 0] / 0.03)
        colors += np.random.default_rng(seed).normal(0, 3, 9000)
        return points @ pose[:3, :3].T + pose[:3, 3], colors

    true = turned(0, 2, shift=(0.004, 0.003, 0))
    source, source_colors = striped(np.linalg.inv(true), 1)
    target, target_colors = striped(np.eye(4), 2)
    result = nacre.align(
        source,
        target,
        source_normals=UP,
        target_normals=UP,
        source_colors=source_colors,
        target_colors=target_colors,
    )
    assert result.target_from_source[0, 3] == pytest.approx(0.004, abs=3e-4)
    assert result.target_from_source[1, 3] == pytest.approx(0.0, abs=3e-4)
    (weak,) = result.weak_directions
    assert abs(weak[4]) > 0.95


def test_colour_is_not_asked_where_shape_is_enough() -> None:
    """The same bits with and without colours, even wrong ones."""
    mesh = nacre.built_in_object()
    camera, poses = nacre.default_camera(mesh), nacre.turntable_poses(mesh)
    target, source = (nacre.back_project(mesh.simulate_depth(camera, poses[i]), camera) for i in (0, 1))
    initial = np.linalg.inv(poses[0]) @ poses[1] @ turned(3, 1)
    rng = np.random.default_rng(0)
    without = nacre.align(source, target, initial=initial)
    colored = nacre.align(
        source,
        target,
        initial=initial,
        source_colors=rng.uniform(0, 255, (len(source), 3)),
        target_colors=rng.uniform(0, 255, len(target)),
    )
    assert len(without.weak_directions) == 0
    np.testing.assert_array_equal(without.target_from_source, colored.target_from_source)


def test_the_number_of_threads_changes_nothing() -> None:
    one, many = (align_planes(num_threads=n) for n in (1, 4))
    np.testing.assert_array_equal(one.target_from_source, many.target_from_source)


@pytest.mark.parametrize(
    ("colors", "error", "message"),
    [
        (np.zeros(5), ValueError, r"source_colors must have shape \(9000,\) or \(9000, 3\), got \(5,\)"),
        (np.zeros((9000, 2)), ValueError, r"source_colors must have shape"),
        (np.full(9000, "red"), TypeError, "source_colors must be an array of real numbers"),
    ],
)
def test_illegal_colors(colors: Array, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        align_planes(lambda _: colors)


# The loop: a camera before shapes that slide along themselves

WIDTH, HEIGHT, FOCAL = 240, 180, 225.0
CAMERA = nacre.Camera(width=WIDTH, height=HEIGHT, fx=FOCAL, fy=FOCAL, cx=WIDTH / 2 - 0.5, cy=HEIGHT / 2 - 0.5)
CENTER = np.array([0.0, 0.0, 0.6])


def picture(shape: str, pose: Array, seed: int, light: tuple[float, float] = (1, 0)) -> tuple[Array, Array]:
    """Return depth and colours of a textured plane, cylinder or ball; pixels are 2.7 mm on the plane."""
    v, u = np.indices((HEIGHT, WIDTH))
    rays = np.stack([(u - CAMERA.cx) / FOCAL, (v - CAMERA.cy) / FOCAL, np.ones((HEIGHT, WIDTH))], -1)
    rays, start = rays @ pose[:3, :3].T, pose[:3, 3]
    if shape == "plane":
        depth = (CENTER[2] - start[2]) / rays[..., 2]
    else:
        axes = [0, 2] if shape == "cylinder" else [0, 1, 2]
        d, o = rays[..., axes], (start - CENTER)[axes]
        a, b, c = (d * d).sum(-1), d @ o, o @ o - 0.15**2
        root = b * b - a * c
        depth = np.where(root > 0, (-b - np.sqrt(np.maximum(root, 0))) / a, np.nan)
    rng = np.random.default_rng(seed)
    gray = brightness(np.nan_to_num(start + rays * depth[..., None]))
    gray = np.clip(light[0] * gray + light[1] + rng.normal(0, 2, gray.shape), 0, 255).astype(np.uint8)
    return depth + rng.normal(0, 0.001, depth.shape), np.repeat(gray[..., None], 3, 2)


def path(shape: str, index: int) -> Array:
    """Return camera poses that the shape alone does not tell."""
    if shape == "plane":
        return turned(0.8 * index, 2, shift=(0.006 * index, -0.003 * index, 0.001 * index))
    return turned(1.6 * index, 1, about=CENTER, shift=(0, 0.003 * index, 0))


@pytest.mark.parametrize("shape", ["plane", "cylinder", "ball"])
@pytest.mark.parametrize("light", ["steady", "flickering"])
def test_texture_tracks_what_shape_does_not(shape: str, light: str) -> None:
    """Measured: 0.06 mm and 0.05 degrees over ten frames."""
    model = nacre.Model(CAMERA)
    for i in range(6):
        depth, color = picture(
            shape, path(shape, i), i, (0.7, 25) if light == "flickering" and i % 2 else (1, 0)
        )
        report = model.add_frame(depth, color)
        assert report.status == "TRACKED", report
        assert report.weak_directions.shape == (0, 6)
        distance, angle = off_by(report.world_from_camera, path(shape, i), CENTER)
        assert distance < 0.0005
        assert angle < 0.2


@pytest.mark.parametrize(("shape", "num_weak"), [("plane", 3), ("cylinder", 2), ("ball", 3)])
def test_without_colour_the_same_frames_are_weak(shape: str, num_weak: int) -> None:
    model = nacre.Model(CAMERA)
    model.add_frame(picture(shape, path(shape, 0), 0)[0])
    report = model.add_frame(picture(shape, path(shape, 1), 1)[0])
    assert report.status == "WEAK"
    assert len(report.weak_directions) == num_weak
    assert f"{num_weak} direction(s)" in report.reason


def test_a_blank_wall_stays_weak_with_colour() -> None:
    model = nacre.Model(CAMERA)
    rng = np.random.default_rng(0)
    for i in range(2):
        depth, _ = picture("plane", path("plane", i), i)
        gray = np.clip(140 + rng.normal(0, 3, (HEIGHT, WIDTH, 1)), 0, 255).astype(np.uint8)
        report = model.add_frame(depth, np.repeat(gray, 3, 2))
    assert report.status == "WEAK"
