"""Validation of arrays: what is taken, what is copied, and what the errors say."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nacre._internal import arrays

REAL = ["?", "i1", "u1", "i2", "u2", "i4", "u4", "i8", "u8", "f2", "f4", "f8", "g", ">f4", ">f8", ">i4"]


@pytest.mark.parametrize("dtype", REAL)
@pytest.mark.parametrize(
    "form", [np.asarray, np.asfortranarray, lambda a: a[::-1][::-1], lambda a: np.repeat(a, 2, 0)[::2]]
)
def test_points_of_any_dtype_and_layout(dtype: str, form: Callable[[Any], Any]) -> None:
    values = np.arange(12).reshape(4, 3) % 2
    points = arrays.as_points("points", form(values.astype(dtype)))
    assert points.dtype == (np.float32 if np.dtype(dtype) == np.float32 else np.float64)
    assert points.dtype.isnative
    assert points.flags.c_contiguous
    assert (points == values).all()


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_good_points_are_not_copied(dtype: Any) -> None:
    points = np.zeros((5, 3), dtype)
    assert np.shares_memory(arrays.as_points("points", points), points)


def test_lists_and_empty_arrays_are_points() -> None:
    assert arrays.as_points("points", [[1, 2, 3]]).shape == (1, 3)
    assert arrays.as_points("points", np.zeros((0, 3))).shape == (0, 3)


@pytest.mark.parametrize("shape", [(), (3,), (0,), (4, 2), (4, 4), (2, 2, 3)])
def test_points_of_wrong_shape(shape: tuple[int, ...]) -> None:
    with pytest.raises(ValueError, match=r"cloud must have shape \(N, 3\), got \(") as caught:
        arrays.as_points("cloud", np.zeros(shape))
    assert str(shape) in str(caught.value)


@pytest.mark.parametrize(
    "value", [np.zeros((2, 3), complex), [["a", "b", "c"]], None, np.zeros((2, 3), "M8[s]"), object()]
)
@pytest.mark.parametrize(
    "convert",
    [
        lambda v: arrays.as_points("thing", v),
        lambda v: arrays.as_vector("thing", v, 3),
        lambda v: arrays.as_pose("thing", v),
        lambda v: arrays.as_poses("thing", v),
        lambda v: arrays.as_depth("thing", v),
    ],
    ids=["points", "vector", "pose", "poses", "depth"],
)
def test_only_real_numbers(convert: Callable[[Any], Any], value: Any) -> None:
    with pytest.raises(TypeError, match="thing must be an array of real numbers, got dtype"):
        convert(value)


def test_matching_points() -> None:
    assert arrays.as_matching_points("normals", np.zeros((4, 3)), "points", 4).shape == (4, 3)
    with pytest.raises(ValueError, match=r"normals must have one row per point of points \(4\), got 3"):
        arrays.as_matching_points("normals", np.zeros((3, 3)), "points", 4)


def test_vector() -> None:
    assert (arrays.as_vector("axis", (1, 2, 3), 3) == [1, 2, 3]).all()
    for bad in ((1, 2), [[1, 2, 3]], (1, 2, np.nan), (1, 2, np.inf), 5):
        with pytest.raises(ValueError, match="axis must be 3 finite numbers, got"):
            arrays.as_vector("axis", bad, 3)


def turn(angle: float) -> Any:
    pose = np.eye(4)
    pose[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    return pose


NOT_RIGID = {
    "scaled": np.diag([2.0, 2, 2, 1]),
    "mirrored": np.diag([1.0, 1, -1, 1]),
    "sheared": turn(0.3) + np.outer([1, 0, 0, 0], [0, 0.1, 0, 0]),
    "projective": turn(0.3) + np.outer([0, 0, 0, 1], [0, 0.1, 0, 0]),
    "zero": np.zeros((4, 4)),
}


@given(angle=st.floats(-10, 10), shift=st.floats(-1e6, 1e6))
def test_rigid_poses_are_taken_as_they_are(angle: float, shift: float) -> None:
    pose = turn(angle)
    pose[:3, 3] = shift
    assert (arrays.as_pose("pose", pose) == pose).all()
    assert (arrays.as_poses("poses", pose[None]) == pose).all()


@pytest.mark.parametrize("case", NOT_RIGID)
def test_motions_that_are_not_rigid(case: str) -> None:
    with pytest.raises(ValueError, match="guess must be a rigid transform"):
        arrays.as_pose("guess", NOT_RIGID[case])
    with pytest.raises(ValueError, match=r"guesses\[1\] must be a rigid transform"):
        arrays.as_poses("guesses", np.stack([np.eye(4), NOT_RIGID[case]]))


def test_pose_of_wrong_shape_or_not_finite() -> None:
    with pytest.raises(ValueError, match=r"guess must be a 4x4 matrix, got shape \(3, 4\)"):
        arrays.as_pose("guess", np.eye(4)[:3])
    with pytest.raises(ValueError, match="guess must be a rigid transform"):
        arrays.as_pose("guess", np.full((4, 4), np.nan))
    far = np.eye(4)
    far[1, 3] = -2e30
    with pytest.raises(ValueError, match=r"guess must lead at most 1e\+30 m away"):
        arrays.as_pose("guess", far)
    with pytest.raises(ValueError, match=r"guesses\[2\] must lead at most 1e\+30 m away"):
        arrays.as_poses("guesses", np.stack([np.eye(4), np.full((4, 4), np.nan), far]))
    with pytest.raises(ValueError, match=r"guesses must have shape \(N, 4, 4\), got \(4, 4\)"):
        arrays.as_poses("guesses", np.eye(4))


def test_missing_poses_stay_missing() -> None:
    poses = np.stack([np.eye(4), np.full((4, 4), np.nan), turn(1.0)])
    assert np.array_equal(arrays.as_poses("poses", poses), poses, equal_nan=True)
    assert arrays.as_poses("poses", np.zeros((0, 4, 4))).shape == (0, 4, 4)


def test_depth_in_metres_is_not_copied() -> None:
    depth = np.ones((3, 4), np.float32)
    assert np.shares_memory(arrays.as_depth("depth", depth), depth)


@pytest.mark.parametrize("dtype", ["u2", ">u2", "i4", "i8"])
def test_integer_depth(dtype: str) -> None:
    depth = np.array([[0, 65535, 1000, 2500]], dtype)
    before = depth.copy()
    metres = arrays.as_depth("depth", depth, 1000)
    assert metres.dtype == np.float32
    assert metres.flags.c_contiguous
    assert np.allclose(metres, [[np.nan, np.nan, 1.0, 2.5]], equal_nan=True)
    assert (depth == before).all()


@pytest.mark.parametrize("dtype", ["f2", "f4", "f8", ">f8"])
def test_real_depth_is_scaled(dtype: str) -> None:
    depth = np.array([[0, 0.5, np.nan, 2]], dtype)
    assert np.allclose(arrays.as_depth("depth", np.asfortranarray(depth), 2.0), depth / 2, equal_nan=True)


@pytest.mark.parametrize("shape", [(4,), (4, 4, 1), ()])
def test_depth_of_wrong_shape(shape: tuple[int, ...]) -> None:
    with pytest.raises(ValueError, match=r"image must have shape \(H, W\), got \("):
        arrays.as_depth("image", np.zeros(shape))


@pytest.mark.parametrize("scale", [0, -1, np.nan, np.inf])
def test_depth_scale_out_of_range(scale: float) -> None:
    with pytest.raises(ValueError, match="depth_scale must be a positive number"):
        arrays.as_depth("depth", np.zeros((2, 2)), scale)


def test_whole_numbers_are_not_taken_for_metres() -> None:
    millimetres = np.full((3, 4), 600, np.uint16)
    with pytest.raises(ValueError, match=r"depth_scale must be .*of depth \(1000 for mill.*got 1, .* 600 m"):
        arrays.as_depth("depth", millimetres)
    assert arrays.as_depth("depth", np.full((3, 4), 2, np.uint8))[0, 0] == 2.0
    assert np.isnan(arrays.as_depth("depth", np.array([[0, 65535]], np.uint16))).all()


@pytest.mark.parametrize(
    "colors",
    [
        np.array([[0, 128, 255]], np.uint8),
        np.array([[0, 128, 255]], np.int64),
        np.array([[0, 128 / 255, 1]]),
        np.array([[0, 128 / 255, 1]], np.float32),
        [[0, 128, 255]],
    ],
)
def test_colours_are_whole_or_parts_of_one(colors: Any) -> None:
    found = arrays.as_colors("colors", colors, (1, 3))
    assert found.dtype == np.uint8
    assert found.tolist() == [[0, 128, 255]]


@pytest.mark.parametrize(
    ("colors", "error", "words"),
    [
        (np.full((1, 3), 1.5), ValueError, r"got float64 from 1.5 to 1.5; give colors\.astype\(np\.uint8\)"),
        (np.full((1, 3), -0.5), ValueError, "got float64 from -0.5 to -0.5$"),
        (np.full((1, 3), np.nan), ValueError, "floats from 0 to 1, got float64 from nan to nan"),
        (np.full((1, 3), 256), ValueError, "integers from 0 to 255 .*got int64 from 256 to 256$"),
        (np.ones((1, 3), bool), TypeError, "integers from 0 to 255 or floats from 0 to 1, got bool"),
        (np.zeros((1, 4)), ValueError, r"shape \(1, 3\), got \(1, 4\): leave alpha out with colors"),
        (np.zeros((2, 3)), ValueError, r"colors must have shape \(1, 3\), got \(2, 3\)$"),
        (np.full((1, 3), "red"), TypeError, "colors must be an array of real numbers"),
    ],
)
def test_colours_that_are_none(colors: Any, error: type[Exception], words: str) -> None:
    with pytest.raises(error, match=words):
        arrays.as_colors("colors", colors, (1, 3))


def test_mask() -> None:
    assert arrays.as_mask("mask", None, (2, 3)).shape == (0, 0)
    values = np.array([[0, 1, 2], [0.5, -1, 0]])
    for mask in (values, values != 0, np.asfortranarray(values), values.tolist()):
        result = arrays.as_mask("mask", mask, (2, 3))
        assert result.dtype == np.uint8
        assert result.flags.c_contiguous
        assert (result == (values != 0)).all()
    with pytest.raises(ValueError, match=r"mask must have the depth image's shape \(2, 3\), got \(3, 2\)"):
        arrays.as_mask("mask", values.T, (2, 3))


def test_localize_keeps_the_digits_of_far_points() -> None:
    points = np.random.default_rng(0).uniform(-1, 1, (100, 3)) + np.array([1e6, -2e6, 3e6])
    local, origin = arrays.localize(points)
    assert local.dtype == np.float32
    assert np.abs(local + origin - points).max() < 1e-6
    assert (origin == np.round(origin)).all()


def test_localize_leaves_float32_alone() -> None:
    points = np.ones((4, 3), np.float32)
    local, origin = arrays.localize(points)
    assert local is points
    assert (origin == 0).all()


def test_localize_without_finite_points() -> None:
    for points in (np.zeros((0, 3)), np.full((2, 3), np.nan)):
        local, origin = arrays.localize(points)
        assert local.shape == points.shape
        assert (origin == 0).all()


def test_localize_ignores_rows_that_are_not_finite() -> None:
    points = np.array([[1e6, 0, 0], [np.nan, 0, 0], [0, np.inf, 0]])
    local, origin = arrays.localize(points)
    assert (origin == [1e6, 0, 0]).all()
    assert np.isnan(local[1, 0])
    assert np.isinf(local[2, 1])


def test_triangles() -> None:
    good = arrays.as_triangles("triangles", np.asfortranarray([[0, 1, 2], [2, 1, 3]]), 4)
    assert good.dtype == np.int32
    assert good.flags.c_contiguous
    with pytest.raises(TypeError, match="triangles must be an array of integers, got dtype float64"):
        arrays.as_triangles("triangles", [[0.0, 1.0, 2.0]], 4)
    for shape in [(0, 3), (2, 4), (3,)]:
        with pytest.raises(ValueError, match=r"triangles must have shape \(N, 3\)"):
            arrays.as_triangles("triangles", np.zeros(shape, int), 4)
    for index in (-1, 4, 2**40):
        with pytest.raises(ValueError, match=f"triangles must hold indices of the 4 vertices, got {index}"):
            arrays.as_triangles("triangles", [[0, 1, index]], 4)


def test_count() -> None:
    assert arrays.as_count("k", np.int64(7)) == 7
    assert type(arrays.as_count("k", np.int64(7))) is int
    for bad in (1.0, "1", None):
        with pytest.raises(TypeError, match="k must be an integer, got"):
            arrays.as_count("k", bad)
    for bad in (0, -1):
        with pytest.raises(ValueError, match="k must be an integer of at least 1, got"):
            arrays.as_count("k", bad, minimum=1)
    with pytest.raises(ValueError, match=r"k must be an integer below 2\^31, got 2147483648"):
        arrays.as_count("k", 2**31)


def test_length() -> None:
    assert arrays.as_length("radius", np.float32(0.5)) == 0.5
    assert arrays.as_length("radius", np.inf) == np.inf
    for bad in (None, "far", [1, 2]):
        with pytest.raises(TypeError, match="radius must be a number, got"):
            arrays.as_length("radius", bad)
    for bad in (-1, np.nan):
        with pytest.raises(ValueError, match="radius must be at least 0, got"):
            arrays.as_length("radius", bad)
