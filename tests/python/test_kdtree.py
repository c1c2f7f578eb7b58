import copy
import math
import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import nacre


def brute_force(points, query):
    """All finite points by distance and index, with distances in float64."""
    step = points.astype(np.float64) - query.astype(np.float64)
    squared = step[:, 0] ** 2 + step[:, 1] ** 2 + step[:, 2] ** 2
    order = np.lexsort((np.arange(len(points)), squared))
    order = order[np.isfinite(squared[order])]
    return np.sqrt(squared[order]), order


def check(points, queries, k, max_distance=np.inf):
    distances, indices = nacre.KdTree(points).query(queries, k, max_distance=max_distance)
    assert distances.dtype == queries.dtype
    assert indices.dtype == np.int64
    distances, indices = distances.reshape(-1, k), indices.reshape(-1, k)
    for query, found, rows in zip(queries, distances, indices, strict=True):
        expected, order = brute_force(points, query)
        count = min(k, np.count_nonzero(expected <= max_distance))
        np.testing.assert_array_equal(rows[:count], order[:count])
        np.testing.assert_array_equal(found[:count], expected[:count].astype(queries.dtype))
        assert (rows[count:] == len(points)).all()
        assert np.isposinf(found[count:]).all()


@settings(max_examples=80, deadline=None, derandomize=True)
@given(
    seed=st.integers(0, 2**32 - 1),
    num_points=st.integers(0, 400),
    k=st.integers(1, 30),
    levels=st.sampled_from([2, 5, 1000, 10**9]),
    point_type=st.sampled_from([np.float32, np.float64]),
    query_type=st.sampled_from([np.float32, np.float64]),
    offset=st.sampled_from([0.0, -3.0, 1e6]),
    max_distance=st.sampled_from([np.inf, 0.5, 0.0]),
)
def test_agrees_with_brute_force(seed, num_points, k, levels, point_type, query_type, offset, max_distance):
    rng = np.random.default_rng(seed)
    points = (rng.integers(0, levels, (num_points, 3)) / levels + offset).astype(point_type)
    queries = (rng.integers(0, levels, (12, 3)) / levels + offset).astype(query_type)
    check(points, queries, k, max_distance)


def test_agrees_with_scipy():
    spatial = pytest.importorskip("scipy.spatial")
    points = np.random.default_rng(1).normal(size=(20_000, 3))
    distances, indices = nacre.KdTree(points).query(points, k=8)
    expected, rows = spatial.cKDTree(points).query(points, k=8)
    np.testing.assert_array_equal(indices, rows)
    np.testing.assert_array_equal(distances, expected)


def test_many_identical_points_are_found_by_index():
    points = np.zeros((30_000, 3), np.float32)
    distances, indices = nacre.KdTree(points).query(points, k=4)
    np.testing.assert_array_equal(indices, np.tile(np.arange(4), (len(points), 1)))
    assert (distances == 0).all()


def test_shapes_are_those_of_scipy():
    spatial = pytest.importorskip("scipy.spatial")
    points = np.random.default_rng(2).normal(size=(50, 3))
    ours, theirs = nacre.KdTree(points), spatial.cKDTree(points)
    for shape in [(3,), (0, 3), (7, 3), (2, 5, 3)]:
        queries = np.full(shape, 0.25)
        for k in (1, 2, 60):
            for got, expected in zip(ours.query(queries, k), theirs.query(queries, k), strict=True):
                assert np.shape(got) == np.shape(expected)
                np.testing.assert_array_equal(got, expected)


@pytest.mark.parametrize("dtype", [np.float16, np.int32, np.uint8, bool, ">f8"])
def test_any_real_dtype(dtype):
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 1]], dtype=dtype)
    distances, indices = nacre.KdTree(points).query(points)
    np.testing.assert_array_equal(indices, [0, 1, 2])
    assert distances.dtype == np.float64


def test_any_memory_layout_and_the_input_is_untouched():
    points = np.random.default_rng(3).normal(size=(100, 3))
    for layout in (np.asfortranarray(points), np.repeat(points, 2, axis=0)[::2], points.tolist()):
        np.testing.assert_array_equal(
            nacre.KdTree(layout).query(layout, k=3)[1], nacre.KdTree(points).query(points, k=3)[1]
        )
    readonly = points.copy()
    readonly.flags.writeable = False
    np.testing.assert_array_equal(nacre.KdTree(readonly).query(readonly)[1], np.arange(100))


def test_points_that_are_not_finite():
    points = np.array([[np.nan, 0, 0], [1, 2, 3], [0, np.inf, 0], [0, 0, -np.inf], [1, 2, 4]])
    tree = nacre.KdTree(points)
    assert len(tree) == 5
    distances, indices = tree.query(points, k=3)
    np.testing.assert_array_equal(indices, [[5, 5, 5], [1, 4, 5], [5, 5, 5], [5, 5, 5], [4, 1, 5]])
    assert np.isposinf(distances[indices == 5]).all()
    np.testing.assert_array_equal(tree.query_radius(points, 1.0).counts, [0, 2, 0, 0, 2])


def test_far_away_coordinates_keep_their_digits():
    rng = np.random.default_rng(4)
    points = rng.uniform(size=(2000, 3)) + np.array([1e6, -1e6, 2e6])
    check(points, points[:50], 6)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_query_radius(dtype):
    rng = np.random.default_rng(5)
    points = (rng.integers(0, 12, (1500, 3)) / 12).astype(dtype)
    queries = (rng.integers(0, 24, (80, 3)) / 24).astype(dtype)
    found = nacre.KdTree(points).query_radius(queries, 0.25)
    assert len(found) == 80
    assert found.distances.dtype == dtype
    for query, (distances, indices) in zip(queries, found, strict=True):
        expected, order = brute_force(points, query)
        inside = expected <= 0.25
        np.testing.assert_array_equal(indices, order[inside])
        np.testing.assert_array_equal(distances, expected[inside].astype(dtype))
    np.testing.assert_array_equal(found.counts, [len(indices) for _, indices in found])
    np.testing.assert_array_equal(found[-1][1], found[79][1])
    assert len(found[10:20]) == 10
    with pytest.raises(IndexError):
        found[80]
    assert repr(found) == f"RadiusNeighbors(80 queries, {len(found.indices)} neighbours)"


def test_query_radius_of_one_point_and_of_nothing():
    tree = nacre.KdTree([[0.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    ((distances, indices),) = tree.query_radius([0.0, 0.0, 0.0], 1.0)
    np.testing.assert_array_equal(distances, [0, 1])
    np.testing.assert_array_equal(indices, [0, 1])
    assert len(tree.query_radius(np.zeros((0, 3)), 1.0)) == 0
    assert nacre.KdTree(np.zeros((0, 3))).query_radius(np.zeros((2, 3)), 1.0).counts.tolist() == [0, 0]


def test_the_same_bits_for_any_number_of_threads():
    points = np.random.default_rng(6).normal(size=(20_000, 3)).astype(np.float32)
    one, many = nacre.KdTree(points, num_threads=1), nacre.KdTree(points, num_threads=4)
    for a, b in zip(one.query(points, 5, num_threads=1), many.query(points, 5, num_threads=3), strict=True):
        np.testing.assert_array_equal(a, b)


def test_the_tree_keeps_its_own_points():
    points = np.random.default_rng(7).normal(size=(30, 3)).astype(np.float32)
    original = points.copy()
    tree = nacre.KdTree(points)
    points[:] = 0
    np.testing.assert_array_equal(tree.points, original)
    np.testing.assert_array_equal(tree.query(original)[1], np.arange(30))
    with pytest.raises(ValueError, match="read-only"):
        tree.points[0] = 0
    for twin in (pickle.loads(pickle.dumps(tree)), copy.deepcopy(tree)):
        np.testing.assert_array_equal(twin.query(original, 4)[0], tree.query(original, 4)[0])
    assert repr(tree) == "KdTree(30 points, float32)"


@pytest.mark.parametrize(
    ("call", "error", "message"),
    [
        (
            lambda tree: nacre.KdTree(np.zeros((3, 2))),
            ValueError,
            r"points must have shape \(N, 3\), got \(3, 2\)",
        ),
        (
            lambda tree: nacre.KdTree(np.zeros((3, 3), complex)),
            TypeError,
            "points must be an array of real numbers",
        ),
        (lambda tree: nacre.KdTree(np.zeros((3, 3)), num_threads=-1), ValueError, "num_threads must be"),
        (
            lambda tree: tree.query([0.0, 1.0]),
            ValueError,
            r"queries must have shape \(\.\.\., 3\), got \(2,\)",
        ),
        (lambda tree: tree.query(1.0), ValueError, "queries must have shape"),
        (lambda tree: tree.query(["a", "b", "c"]), TypeError, "queries must be an array of real numbers"),
        (lambda tree: tree.query([0, 0, 0], 0), ValueError, "k must be an integer of at least 1, got 0"),
        (lambda tree: tree.query([0, 0, 0], 2.5), TypeError, "k must be an integer, got 2.5"),
        (
            lambda tree: tree.query([0, 0, 0], max_distance=-1),
            ValueError,
            "max_distance must be at least 0, got -1",
        ),
        (
            lambda tree: tree.query([0, 0, 0], max_distance=np.nan),
            ValueError,
            "max_distance must be at least 0, got nan",
        ),
        (lambda tree: tree.query([0, 0, 0], max_distance="far"), TypeError, "max_distance must be a number"),
        (lambda tree: tree.query([0, 0, 0], num_threads=1.0), TypeError, "num_threads must be an integer"),
        (
            lambda tree: tree.query([0, 0, 0], distance_upper_bound=-1),
            ValueError,
            "distance_upper_bound must be at least 0, got -1",
        ),
        (
            lambda tree: tree.query([0, 0, 0], workers=0),
            ValueError,
            r"workers must be -1 \(all\) or at least 1",
        ),
        (lambda tree: tree.query([0, 0, 0], workers=-2), ValueError, "workers must be .*at least -1, got -2"),
        (lambda tree: tree.query([0, 0, 0], workers=1.0), TypeError, "workers must be an integer, got 1.0"),
        (lambda tree: tree.query_ball_point([0, 0], 1), ValueError, r"x must have shape \(\.\.\., 3\)"),
        (lambda tree: tree.query_ball_point([0, 0, 0], -1), ValueError, "r must be at least 0, got -1"),
        (lambda tree: tree.query_ball_point([0, 0, 0], np.nan), ValueError, "r must be at least 0, got nan"),
        (lambda tree: tree.query_ball_point([0, 0, 0], "1"), TypeError, "r must be an array of real numbers"),
        (
            lambda tree: tree.query_ball_point(np.zeros((2, 3)), [1, 2, 3]),
            ValueError,
            r"r must be one number, or as many as queries \(2,\), got \(3,\)",
        ),
        (
            lambda tree: tree.query_ball_point([0, 0, 0], 1, return_length=1),
            TypeError,
            "return_length must be True or False, got 1",
        ),
        (
            lambda tree: tree.query_ball_point([0, 0, 0], 1, return_sorted="no"),
            TypeError,
            "return_sorted must be True or False",
        ),
        (lambda tree: tree.query_radius([0, 0, 0], -0.1), ValueError, "radius must be at least 0"),
        (
            lambda tree: tree.query_radius(np.zeros((2, 2, 3)), 1),
            ValueError,
            r"queries must have shape \(Q, 3\) or \(3,\)",
        ),
    ],
)
def test_illegal_arguments(call, error, message):
    with pytest.raises(error, match=message):
        call(nacre.KdTree([[0.0, 0.0, 0.0]]))


def lattice(count, seed):
    """Points with whole coordinates, so that many distances are equal to a bound."""
    return np.random.default_rng(seed).integers(0, 5, (count, 3)).astype(np.float64)


@pytest.mark.parametrize("bound", [0.0, 1.0, 2.0, np.inf])
def test_an_upper_bound_is_that_of_scipy(bound):
    spatial = pytest.importorskip("scipy.spatial")
    points, queries = np.unique(lattice(60, 1), axis=0), lattice(20, 2) + np.array([0.25, 0.0, 0.0])
    expected = spatial.cKDTree(points).query(queries, 9, distance_upper_bound=bound)
    found = nacre.KdTree(points).query(queries, 9, distance_upper_bound=bound, workers=-1)
    np.testing.assert_allclose(found[0], expected[0], rtol=1e-15)
    np.testing.assert_array_equal(np.isinf(found[0]), found[1] == len(points))
    assert nacre.KdTree(points).query(points[0], distance_upper_bound=bound, max_distance=5.0)[1] == (
        0 if bound > 0 else len(points)
    )


@pytest.mark.parametrize("radius", [0.0, 1.0, "one for each"])
@pytest.mark.parametrize("shape", [(), (7,), (2, 3), (0,)])
def test_balls_are_those_of_scipy(radius, shape):
    spatial = pytest.importorskip("scipy.spatial")
    points, queries = lattice(80, 3), np.resize(lattice(9, 4), (*shape, 3))
    r = np.linspace(0, 3, math.prod(shape)).reshape(shape) if radius == "one for each" else radius
    theirs, ours = spatial.cKDTree(points), nacre.KdTree(points)
    for options in ({}, {"return_sorted": True}, {"return_length": True}):
        expected = theirs.query_ball_point(queries, r, **options)
        found = ours.query_ball_point(queries, r, **options)
        assert np.shape(found) == np.shape(expected) if shape else type(found) is not np.ndarray
        if options.get("return_length"):
            np.testing.assert_array_equal(found, expected)
        elif shape:
            assert [sorted(row) for row in np.ravel(expected)] == list(np.ravel(found))
        else:
            assert sorted(expected) == found


def test_a_ball_has_the_nearest_first_where_it_is_not_sorted():
    tree = nacre.KdTree([[3.0, 0, 0], [1.0, 0, 0], [2.0, 0, 0], [np.nan, 0, 0]])
    assert tree.query_ball_point([0, 0, 0], 9, return_sorted=False) == [1, 2, 0]
    assert tree.query_ball_point([np.nan, 0, 0], 9) == []


def test_bounds_are_compared_in_double_precision():
    tree, query = nacre.KdTree([[0.1, 0.0, 0.0]]), np.zeros(3, np.float32)
    assert tree.query(query, distance_upper_bound=0.1)[1] == 1
    distance, index = tree.query(query, distance_upper_bound=np.nextafter(0.1, 1.0))
    assert (distance.dtype, index) == (np.float32, 0)
    assert tree.query_ball_point(query, 0.1) == [0]
    assert tree.query_ball_point(query, np.nextafter(0.1, 0.0)) == []
