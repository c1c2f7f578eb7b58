import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

import nacre

SQUARE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], dtype=np.float32)
SQUARE_TRIANGLES = np.array([[0, 1, 2], [0, 2, 3]])


@pytest.fixture(scope="module")
def snail():
    return nacre.built_in_object()


def soup(rng, count):
    centers = rng.uniform(-1, 1, (count, 1, 3))
    return (centers + rng.normal(0, 0.2, (count, 3, 3))).reshape(-1, 3), np.arange(3 * count).reshape(-1, 3)


def first_hits(vertices, triangles, origins, directions):
    """Moeller and Trumbore's test of every ray with every triangle."""
    a, b, c = (vertices[triangles[:, i]] for i in range(3))
    across = np.cross(directions[:, None], (c - a)[None])
    determinant = np.einsum("tk,rtk->rt", b - a, across)
    offset = origins[:, None] - a[None]
    u = np.einsum("rtk,rtk->rt", offset, across) / determinant
    q = np.cross(offset, (b - a)[None])
    v = np.einsum("rk,rtk->rt", directions, q) / determinant
    distances = np.einsum("tk,rtk->rt", c - a, q) / determinant
    distances[(u < 0) | (v < 0) | (u + v > 1) | (distances <= 0)] = np.inf
    best = distances.argmin(axis=1)
    nearest = distances[np.arange(len(best)), best]
    return np.where(np.isinf(nearest), np.nan, nearest), np.where(np.isinf(nearest), -1, best)


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), count=st.integers(1, 60))
def test_cast_agrees_with_brute_force(seed, count):
    rng = np.random.default_rng(seed)
    vertices, triangles = soup(rng, count)
    vertices = vertices.astype(np.float32)
    origins, directions = rng.uniform(-2, 2, (200, 3)), rng.normal(0, 1, (200, 3))
    hits = nacre.Mesh(vertices, triangles).cast(origins, directions)
    distances, indices = first_hits(vertices.astype(np.float64), triangles, origins, directions)
    np.testing.assert_array_equal(hits.triangles, indices)
    np.testing.assert_allclose(hits.distances, distances, rtol=1e-7)


def test_closest_agrees_with_a_dense_sampling(snail):
    rng = np.random.default_rng(0)
    queries = rng.uniform(*snail.bounds, (2000, 3))
    found = snail.closest(queries)
    corners = snail.vertices[snail.triangles].astype(np.float64)
    samples = (
        (rng.dirichlet((1, 1, 1), (len(corners), 4))[..., None] * corners[:, None]).sum(axis=2).reshape(-1, 3)
    )
    sampled = cKDTree(np.concatenate([samples, snail.vertices])).query(queries)[0]
    assert (found.distances <= sampled + 1e-12).all()
    assert (found.distances > sampled - 0.001).all()
    np.testing.assert_allclose(np.linalg.norm(found.points - queries, axis=1), found.distances, atol=1e-15)
    np.testing.assert_array_equal(snail.distance(queries), found.distances)


def test_closest_gives_normals_of_the_side(snail):
    centers = snail.vertices[snail.triangles].astype(np.float64).mean(axis=1)
    found = snail.closest(centers)
    assert found.distances.max() < 1e-9
    outside = snail.closest(centers + 1e-4 * found.normals)
    np.testing.assert_allclose(np.linalg.norm(found.normals, axis=1), 1, atol=1e-12)
    above = ((centers + 1e-4 * found.normals - outside.points) * outside.normals).sum(axis=1)
    assert (above > 0).mean() > 0.999


@pytest.mark.parametrize("dtype", [np.float32, np.float64, np.int32, np.uint8])
def test_dtypes_and_layouts(dtype):
    vertices = np.asfortranarray((4 * SQUARE).astype(dtype))
    mesh = nacre.Mesh(vertices[:, ::1], SQUARE_TRIANGLES.astype(np.uint16)[::-1])
    assert mesh.vertices.dtype == (np.float32 if dtype == np.float32 else np.float64)
    assert mesh.triangles.dtype == np.int32
    np.testing.assert_array_equal(mesh.distance([[1, 1, 2], [5, 0, 0]]), [2, 1])
    np.testing.assert_array_equal(mesh.bounds, [[0, 0, 0], [4, 4, 0]])


def test_far_away_coordinates_keep_their_digits():
    offset = np.array([4.5e6, -1.25e6, 3e5])
    mesh = nacre.Mesh(0.1 * SQUARE + offset, SQUARE_TRIANGLES)
    queries = np.array([[0.05, 0.025, 0.001], [0.2, 0.05, 0]]) + offset
    found = mesh.closest(queries)
    np.testing.assert_allclose(found.distances, [0.001, 0.1], atol=2e-9)
    np.testing.assert_allclose(found.points - offset, [[0.05, 0.025, 0], [0.1, 0.05, 0]], atol=2e-9)
    hits = mesh.cast(queries, [[0, 0, -1], [-1, 0, 0]])
    np.testing.assert_allclose(hits.distances, [0.001, np.nan], atol=2e-9)


def test_points_that_are_not_finite_and_no_points():
    mesh = nacre.Mesh(SQUARE, SQUARE_TRIANGLES)
    found = mesh.closest([[np.nan, 0, 0], [0, np.inf, 0], [0, 0, 1]])
    np.testing.assert_array_equal(found.distances, [np.nan, np.nan, 1])
    np.testing.assert_array_equal(found.triangles[:2], -1)
    assert np.isnan(found.points[:2]).all()
    assert np.isnan(found.normals[:2]).all()
    assert mesh.distance(np.zeros((0, 3))).shape == (0,)
    assert mesh.cast(np.zeros((0, 3)), np.zeros((0, 3))).triangles.shape == (0,)
    hits = mesh.cast([[0.5, 0.2, 1], [0.5, 0.2, 1]], [[0, 0, 0], [0, 0, np.nan]])
    np.testing.assert_array_equal(hits.triangles, -1)
    assert np.isnan(hits.distances).all()


def test_a_mesh_is_a_copy_that_cannot_change():
    vertices = SQUARE.copy()
    mesh = nacre.Mesh(vertices, SQUARE_TRIANGLES)
    vertices[:] = 7
    assert mesh.bounds.max() == 1
    with pytest.raises(ValueError, match="read-only"):
        mesh.vertices[0] = 1
    with pytest.raises(ValueError, match="read-only"):
        mesh.triangles[0] = 1
    with pytest.raises(AttributeError):
        mesh.vertices = vertices
    assert repr(mesh) == "Mesh(4 vertices, 2 triangles, 1 x 1 x 0 m)"
    again = pickle.loads(pickle.dumps(mesh))
    np.testing.assert_array_equal(again.vertices, mesh.vertices)
    np.testing.assert_array_equal(again.triangles, mesh.triangles)
    assert (again.normals, again.colors) == (None, None)


def test_normals_and_colours_go_with_the_vertices():
    colors = np.arange(12, dtype=np.uint8).reshape(4, 3)
    mesh = nacre.Mesh(SQUARE, SQUARE_TRIANGLES, normals=[[0, 0, 1.0]] * 4, colors=colors)
    assert repr(mesh) == "Mesh(4 vertices, 2 triangles, 1 x 1 x 0 m, normals, colors)"
    again = pickle.loads(pickle.dumps(mesh))
    for found in (mesh, again):
        np.testing.assert_array_equal(found.normals, [[0, 0, 1]] * 4)
        np.testing.assert_array_equal(found.colors, colors)
    with pytest.raises(ValueError, match="read-only"):
        mesh.colors[0] = 1
    with pytest.raises(ValueError, match=r"normals must have one row per point of vertices \(4\), got 2"):
        nacre.Mesh(SQUARE, SQUARE_TRIANGLES, normals=np.eye(3)[:2])
    with pytest.raises(ValueError, match=r"colors must have shape \(4, 3\)"):
        nacre.Mesh(SQUARE, SQUARE_TRIANGLES, colors=colors[:2])


@pytest.mark.parametrize(
    ("vertices", "triangles", "error", "message"),
    [
        (SQUARE[:, :2], SQUARE_TRIANGLES, ValueError, r"vertices must have shape \(N, 3\)"),
        (SQUARE.astype(str), SQUARE_TRIANGLES, TypeError, "vertices must be an array of real numbers"),
        (SQUARE * np.nan, SQUARE_TRIANGLES, ValueError, "vertices must be finite"),
        (np.zeros((0, 3)), SQUARE_TRIANGLES, ValueError, "triangles must hold indices of the 0 vertices"),
        (SQUARE, SQUARE_TRIANGLES + 1, ValueError, "triangles must hold indices of the 4 vertices, got 4"),
        (SQUARE, SQUARE_TRIANGLES - 1, ValueError, "triangles must hold indices of the 4 vertices, got -1"),
        (SQUARE, SQUARE_TRIANGLES + 2**40, ValueError, "triangles must hold indices"),
        (SQUARE, SQUARE_TRIANGLES.astype(float), TypeError, "triangles must be an array of integers"),
        (SQUARE, SQUARE_TRIANGLES[:, :2], ValueError, "triangles must have shape"),
        (SQUARE, np.zeros((0, 3), int), ValueError, "triangles must have shape"),
    ],
)
def test_meshes_that_are_none(vertices, triangles, error, message):
    with pytest.raises(error, match=message):
        nacre.Mesh(vertices, triangles)


def test_misuse_of_queries():
    mesh = nacre.Mesh(SQUARE, SQUARE_TRIANGLES)
    with pytest.raises(ValueError, match="points must have shape"):
        mesh.distance([0, 0, 0])
    with pytest.raises(ValueError, match="directions must have one row per point of origins"):
        mesh.cast(np.zeros((2, 3)), np.ones((3, 3)))


def test_the_built_in_object(snail):
    """What it promises to its users; the shape is examined in the C++ tests."""
    edges = np.sort(snail.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    unique, counts = np.unique(edges, axis=0, return_counts=True)
    assert (counts == 2).all()
    assert len(snail.vertices) - len(unique) + len(snail.triangles) == 2
    size = snail.bounds[1] - snail.bounds[0]
    assert 0.14 < size.max() < 0.16
    assert abs(snail.bounds[0, 1]) < 0.001
    np.testing.assert_array_equal(nacre.built_in_object().vertices, snail.vertices)


def test_no_turn_maps_the_built_in_object_onto_itself(snail):
    center = snail.bounds.mean(axis=0)
    for axis in range(3):
        for angle in np.radians([90, 180, 270]):
            c, s = np.cos(angle), np.sin(angle)
            turned = (snail.vertices[::50] - center)[:, [axis, (axis + 1) % 3, (axis + 2) % 3]]
            turned = turned @ np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
            back = np.empty_like(turned)
            back[:, [axis, (axis + 1) % 3, (axis + 2) % 3]] = turned
            assert np.sqrt((snail.distance(back + center) ** 2).mean()) > 0.005
