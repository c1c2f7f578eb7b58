"""Pictures of point models: what they show, and that their files can be read."""

from __future__ import annotations

import io
import sys
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nacre.pictures.image_files import encode_small
from nacre.report import View, encode_png, render_points

Image = pytest.importorskip("PIL.Image")


def sphere(count: int = 6000, radius: float = 0.1) -> np.ndarray:
    """A Fibonacci lattice: evenly spread, the same everywhere."""
    i = np.arange(count) + 0.5
    z = 1 - 2 * i / count
    angle = np.pi * (1 + 5**0.5) * i
    rim = np.sqrt(1 - z**2)
    return radius * np.column_stack([rim * np.cos(angle), rim * np.sin(angle), z])


def square(center: Any, half: float, spacing: float = 0.02) -> np.ndarray:
    """A square across the z axis."""
    side = np.arange(-half, half + spacing / 2, spacing)
    grid = np.stack(np.meshgrid(side, side, [0.0]), -1).reshape(-1, 3)
    return np.asarray(grid + np.asarray(center))


def decoded(data: bytes) -> np.ndarray:
    return np.asarray(Image.open(io.BytesIO(data)))


class TestPng:
    @settings(max_examples=40, deadline=None)
    @given(st.integers(1, 9), st.integers(1, 9), st.sampled_from([(), (3,), (4,)]), st.integers(0, 99))
    def test_round_trip(self, height: int, width: int, channels: tuple[int, ...], seed: int) -> None:
        image = np.random.default_rng(seed).integers(0, 256, (height, width, *channels), dtype=np.uint8)
        data = encode_png(image)
        assert data.startswith(b"\x89PNG\r\n\x1a\n")
        np.testing.assert_array_equal(decoded(data), image)

    def test_smooth_pictures_become_small(self) -> None:
        ramp = np.tile(np.arange(256, dtype=np.uint8), (256, 1))
        for image in (ramp, ramp.T):
            assert len(encode_png(image)) < 1500
            np.testing.assert_array_equal(decoded(encode_png(image)), image)

    def test_illegal_input_is_named(self) -> None:
        with pytest.raises(TypeError, match="image must be uint8"):
            encode_png(np.zeros((2, 2)))  # type: ignore[arg-type]
        for shape in ((2,), (2, 2, 2), (0, 3, 3)):
            with pytest.raises(ValueError, match="image must have shape"):
                encode_png(np.zeros(shape, np.uint8))

    def test_without_pillow_the_error_says_what_to_install(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setitem(sys.modules, "PIL.Image", None)
        with pytest.raises(ImportError, match=r'pip install "nacre\[images\]"'):
            encode_png(np.zeros((2, 2), np.uint8))


class TestSmallPictures:
    def test_few_colours_are_kept_as_they_are(self) -> None:
        image = np.random.default_rng(0).integers(0, 4, (20, 30, 3), dtype=np.uint8) * 80
        np.testing.assert_array_equal(decoded(encode_small(image, 50_000, lossless=True)), image)

    def test_many_colours_become_close_ones(self) -> None:
        u, v = np.meshgrid(np.arange(200), np.arange(150))
        image = np.stack([u, v, (u + v) // 2], axis=2).astype(np.uint8)
        assert np.abs(decoded(encode_small(image, 50_000)).astype(int) - image).mean() < 4

    def test_a_picture_is_no_larger_than_it_may_be(self) -> None:
        noise = np.random.default_rng(0).integers(0, 256, (240, 320, 4), dtype=np.uint8)
        for lossless in (False, True):
            assert len(encode_small(noise, 10**6, lossless=lossless)) > 40_000
            assert len(encode_small(noise, 20_000, lossless=lossless)) <= 20_000


class TestRenderPoints:
    def test_a_sphere_is_a_closed_disk_that_is_lit_from_the_viewer(self) -> None:
        points = sphere()
        image = render_points(points, points, size=(200, 160), background=None)
        assert image.shape == (160, 200, 4)
        row, column = np.mgrid[:160, :200]
        distance = np.hypot(row - 79.5, column - 99.5) / (0.46 * 160)
        assert (image[distance < 0.95, 3] == 255).all()
        assert (image[distance > 1.1, 3] == 0).all()
        brightness = image[:, :, 0].astype(float)
        assert (
            brightness[distance < 0.3].mean() > 1.5 * brightness[(distance > 0.85) & (distance < 0.95)].mean()
        )

    def test_what_is_in_front_hides_what_is_behind(self) -> None:
        front, back = square((0, 0, 0.0), 0.2), square((0, 0, 0.5), 0.4)
        points = np.concatenate([front, back])
        normals = np.tile([0, 0, -1.0], (len(points), 1))
        colors = np.zeros((len(points), 3), np.uint8)
        colors[: len(front), 0], colors[len(front) :, 1] = 255, 255
        for order in (slice(None), slice(None, None, -1)):
            image = render_points(points[order], normals[order], colors[order], size=(100, 100))
            assert image[50, 50, 0] > 100 > image[50, 50, 1]
            assert image[15, 50, 1] > 100 > image[15, 50, 0]
        image = render_points(points, -normals, colors, view_from="back", size=(100, 100))
        assert image[50, 50, 1] > 100 > image[50, 50, 0]

    def test_a_row_of_points_beside_an_even_surface_is_not_drawn_twice_as_wide(self) -> None:
        row = np.column_stack([np.arange(-0.2, 0.21, 0.02), np.full(21, 0.55), np.zeros(21)])
        points = np.concatenate([square((0, 0, 0), 0.4), row])
        view = View.fit(points, "front", size=(300, 300))
        image = render_points(points, np.tile([0, 0, -1.0], (len(points), 1)), view=view, background=None)
        middle = np.flatnonzero(image[:, 150, 3] > 127)
        _, strip = np.split(middle, np.flatnonzero(np.diff(middle) > 1) + 1)
        reach = 0.02 * np.sqrt(2)  # as at the border of the square; the fourth point of the row is at 0.04
        assert len(strip) * view.metres_per_pixel == pytest.approx(2 * reach, abs=0.01)

    @pytest.mark.parametrize(
        ("side", "right", "down"),
        [
            ("front", (1, 0, 0), (0, 1, 0)),
            ("right", (0, 0, 1), (0, 1, 0)),
            ("back", (-1, 0, 0), (0, 1, 0)),
            ("left", (0, 0, -1), (0, 1, 0)),
            ("top", (1, 0, 0), (0, 0, -1)),
            ("bottom", (1, 0, 0), (0, 0, 1)),
            ((0, 0, -3.0), (1, 0, 0), (0, 1, 0)),
        ],
    )
    def test_sides_show_what_a_person_walking_around_sees(self, side: Any, right: Any, down: Any) -> None:
        markers = np.array([right, down, np.negative(right), np.negative(down)], dtype=float)
        points = np.concatenate([marker + sphere(200, 0.1) for marker in markers])
        colors = np.repeat(np.eye(4, 3, dtype=np.uint8) * 255, 200, axis=0)
        normals = np.tile(sphere(200), (4, 1))
        image = render_points(points, normals, colors, view_from=side, size=(120, 120)).astype(int)
        assert image[60, 114, 0] > 90 > image[60, 114, 1]
        assert image[114, 60, 1] > 90 > image[114, 60, 0]
        assert image[60, 5, 2] > 90 > image[60, 5, 1]

    def test_reverse_sides_are_brown_or_left_out(self) -> None:
        points = square((0, 0, 0), 0.2)
        normals = np.tile([0, 0, 1.0], (len(points), 1))
        reverse = render_points(points, normals, size=(60, 60))[30, 30].astype(int)
        front = render_points(points, -normals, size=(60, 60))[30, 30].astype(int)
        assert reverse[0] - reverse[2] > 40 > front[0] - front[2]
        assert (render_points(points, normals, size=(60, 60), hide_reverse=True) == 255).all()

    def test_sparse_models_have_no_holes(self) -> None:
        points = sphere(400)
        image = render_points(points, points, size=(300, 300), background=None)
        row, column = np.mgrid[:300, :300]
        assert (image[np.hypot(row - 149.5, column - 149.5) < 0.9 * 0.46 * 300, 3] == 255).all()

    def test_without_normals_planes_are_fitted(self) -> None:
        points = sphere()
        given = render_points(points, points, size=(100, 100)).astype(int)
        fitted = render_points(points, size=(100, 100)).astype(int)
        assert np.abs(given - fitted).mean() < 3

    def test_points_that_are_not_finite_are_left_out(self) -> None:
        points, normals = sphere(), sphere()
        expected = render_points(points, normals, size=(80, 80))
        bad = np.concatenate([points, [[np.nan, 0, 0], [0, np.inf, 0]]])
        image = render_points(bad, np.concatenate([normals, np.ones((2, 3))]), size=(80, 80))
        np.testing.assert_array_equal(image, expected)

    def test_a_large_coordinate_is_no_more_than_left_out(self) -> None:
        points = np.concatenate([square((0, 0, 0), 0.2), [[0, 0, 1e300], [1e300, 0, 0], [0, -1e150, 1e150]]])
        view = View.fit(points[:-3], size=(60, 60))
        for each in (view, View.from_camera(points, np.eye(4), size=(60, 60))):
            assert render_points(points, np.zeros_like(points), view=each, spacing=0.02).shape == (60, 60, 3)

    def test_normals_that_are_not_finite_face_the_viewer(self) -> None:
        points = square((0, 0, 0), 0.2)
        image = render_points(points, np.full(points.shape, np.nan), size=(60, 60))
        np.testing.assert_array_equal(
            image, render_points(points, np.tile([0, 0, -1.0], (len(points), 1)), size=(60, 60))
        )

    @pytest.mark.parametrize(
        "points", [np.zeros((0, 3)), np.full((3, 3), np.nan), np.zeros((1, 3)), np.ones((4, 3))]
    )
    def test_hardly_anything_to_draw(self, points: np.ndarray) -> None:
        image = render_points(
            points, np.tile([0, 0, -1.0], (len(points), 1)), size=(20, 30), background=(1, 2, 3)
        )
        assert image.shape == (30, 20, 3)
        assert (image[0, 0] == (1, 2, 3)).all()

    def test_far_away_models_and_other_dtypes_look_the_same(self) -> None:
        points = sphere(2000)
        expected = render_points(points, points, size=(80, 80)).astype(int)
        far = render_points(points + 1e6, points, size=(80, 80)).astype(int)
        assert np.abs(far - expected).mean() < 2
        single = render_points(
            np.asfortranarray(points, np.float32), points.astype(np.float32), size=(80, 80)
        )
        assert np.abs(single - expected).mean() < 1

    def test_a_camera_sees_near_things_larger(self) -> None:
        near, far = square((-0.3, 0, 1.0), 0.1, 0.01), square((0.6, 0, 2.0), 0.1, 0.01)
        points = np.concatenate([near, far, square((0, 0, -1.0), 0.1)])
        colors = np.zeros((len(points), 3), np.uint8)
        colors[: len(near), 0], colors[len(near) : len(near) + len(far), 2] = 255, 255
        view = View.from_camera(points, np.eye(4), size=(200, 150))
        image = render_points(points, np.tile([0, 0, -1.0], (len(points), 1)), colors, view=view).astype(int)
        red, blue = (image[:, :, 0] - image[:, :, 2]) > 80, (image[:, :, 2] - image[:, :, 0]) > 80
        assert red.sum() == pytest.approx(4 * blue.sum(), rel=0.35)
        assert red[:, :100].sum() == red.sum()
        assert blue[:, 100:].sum() == blue.sum()

    @pytest.mark.parametrize(
        ("options", "message"),
        [
            ({"view_from": "above"}, "view_from must be one of front"),
            ({"view_from": (0, 0, 0)}, "view_from must be a side"),
            ({"size": (0, 10)}, "size must be"),
            ({"normals": np.zeros((2, 3))}, "normals must have one row"),
            ({"colors": np.full((6000, 3), 2.0)}, "colors must be integers from 0 to 255 or floats"),
            ({"spacing": 0.0}, "spacing must be positive"),
        ],
    )
    def test_illegal_input_is_named(self, options: Any, message: str) -> None:
        points = sphere()
        with pytest.raises(ValueError, match=message):
            render_points(points, **{"normals": points, **options})
