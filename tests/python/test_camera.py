"""Cameras from Python: attributes, errors, equality, pickling, projection."""

import copy
import pickle

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import nacre
from nacre import Camera

BARREL = (-0.28, 0.07, 0.0002, 1.8e-05, 0.0)
PINHOLE = {"width": 64, "height": 48, "fx": 52.5, "fy": 50.0, "cx": 31.0, "cy": 24.5}

lengths = st.floats(1e-3, 1e5)
sizes = st.integers(1, 40)
small = st.floats(-0.05, 0.05)
cameras = st.one_of(
    st.builds(
        Camera,
        width=sizes,
        height=sizes,
        fx=lengths,
        fy=lengths,
        cx=st.floats(-100, 100),
        cy=st.floats(-100, 100),
        distortion=st.tuples(small, small, small, small, small),
        depth=st.sampled_from(["z", "radial"]),
    ),
    st.builds(Camera.orthographic, width=sizes, height=sizes, pixel_size=lengths),
)


def test_attributes():
    camera = Camera(**PINHOLE, distortion=BARREL, depth="radial")
    assert camera.model == "pinhole"
    assert (camera.width, camera.height) == (64, 48)
    assert (camera.fx, camera.fy, camera.cx, camera.cy) == (52.5, 50.0, 31.0, 24.5)
    assert camera.distortion == BARREL
    assert camera.depth == "radial"
    with pytest.raises(AttributeError, match="orthographic"):
        _ = camera.pixel_size
    flat = Camera.orthographic(width=5, height=4, pixel_size=0.3)
    assert flat.model == "orthographic"
    assert flat.pixel_size == 0.3
    assert flat.depth == "z"


def test_distortion_of_four_numbers_or_an_array():
    five = Camera(**PINHOLE, distortion=(0.1, 0.2, 0.3, 0.4, 0.0))
    assert Camera(**PINHOLE, distortion=[0.1, 0.2, 0.3, 0.4]) == five
    assert Camera(**PINHOLE, distortion=np.array([0.1, 0.2, 0.3, 0.4, 0.0])) == five
    assert Camera(**PINHOLE, distortion=()) == Camera(**PINHOLE)


@given(cameras)
def test_copies_and_repr_give_an_equal_camera(camera):
    for other in (pickle.loads(pickle.dumps(camera)), copy.deepcopy(camera), eval(repr(camera))):
        assert other == camera
        assert hash(other) == hash(camera)


def test_equality():
    camera = Camera(**PINHOLE)
    assert camera != Camera(**{**PINHOLE, "fx": 52.6})
    assert camera != Camera(**PINHOLE, depth="radial")
    assert camera != "camera"


@pytest.mark.parametrize("distortion", [(), BARREL, (0.2624, -0.9531, -0.0054, 0.0026, 1.1633)])
@pytest.mark.parametrize("depth", ["z", "radial"])
def test_project_undoes_back_project(distortion, depth):
    camera = Camera(**PINHOLE, distortion=distortion, depth=depth)
    points = nacre.back_project(np.full((48, 64), 1.3), camera)
    v, u = np.mgrid[:48, :64]
    np.testing.assert_allclose(camera.project(points), np.stack([u, v], axis=-1).reshape(-1, 2), atol=1e-3)
    distance = np.linalg.norm(points, axis=1) if depth == "radial" else points[:, 2]
    np.testing.assert_allclose(distance, 1.3, rtol=1e-6)


def test_project_takes_any_layout():
    camera = Camera(**PINHOLE)
    points = np.array([[0.1, 0.2, 1.0], [0.0, 0.0, 2.0], [0.3, -0.1, -1.0]])
    expected = np.array([[36.25, 34.5], [31.0, 24.5], [np.nan, np.nan]])
    for given_points in (points, points.astype(np.float32), np.asfortranarray(points), points.tolist()):
        np.testing.assert_allclose(camera.project(given_points), expected, rtol=1e-6)
    assert camera.project(np.zeros((0, 3))).shape == (0, 2)
    for wrong in (np.zeros(3), np.zeros((4, 2)), np.zeros((2, 2, 3))):
        with pytest.raises(ValueError, match=r"points must have shape \(N, 3\), got"):
            camera.project(wrong)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"width": 0}, "width must be 1 to 65536 pixels, got 0"),
        ({"height": -4}, "height must be"),
        ({"width": 65536, "height": 65536}, "height must be of an image of at most 2"),
        ({"fx": 0}, "fx must be a finite focal length in pixels, not 0, got 0"),
        ({"fy": float("nan")}, "fy must be"),
        ({"fx": 1e-300}, "fx must be a focal length that leaves the rays of all pixels finite, got 1e-300"),
        ({"cy": -1e300}, "fy must be a focal length that leaves the rays"),
        ({"cx": float("inf")}, "cx must be finite"),
        ({"cy": float("nan")}, "cy must be finite"),
        ({"distortion": (1.0, 2.0)}, "distortion must be the 4 or 5 coefficients k1 k2 p1 p2"),
        ({"distortion": (0, 0, 0, 0, float("nan"))}, "distortion must be finite"),
        ({"depth": "euclidean"}, "depth must be 'z' or 'radial', got 'euclidean'"),
    ],
)
def test_wrong_values_are_named(change, message):
    with pytest.raises(ValueError, match=message):
        Camera(**{**PINHOLE, **change})


def test_wrong_orthographic_camera():
    with pytest.raises(ValueError, match="pixel_size must be a positive size in metres, got 0"):
        Camera.orthographic(width=3, height=3, pixel_size=0)
    for size in (1e-310, 1e-40, 5e29, 2e38):
        with pytest.raises(
            ValueError, match="pixel_size must be a size in metres that single precision tells from 0"
        ):
            Camera.orthographic(width=3, height=3, pixel_size=size)
    with pytest.raises(ValueError, match="width must be"):
        Camera.orthographic(width=0, height=3, pixel_size=1)


def test_wrong_types():
    with pytest.raises(TypeError):
        Camera(**{**PINHOLE, "fx": "wide"})
    with pytest.raises(TypeError):
        Camera(64, 48)


def test_a_field_of_view_reaches_to_the_edges_of_the_outer_pixels():
    camera = Camera.from_fov(64, 48, 60.0)
    edge = np.tan(np.radians(30.0))
    np.testing.assert_allclose(camera.project([[-edge, 0.0, 1.0], [edge, 0.0, 1.0]])[:, 0], [-0.5, 63.5])
    assert camera.fx == camera.fy
    wide = Camera.from_fov(64, 48, 60.0, 60.0, depth="radial")
    assert wide.fy == pytest.approx(camera.fx * 48 / 64)
    assert wide.depth == "radial"


def test_a_matrix_goes_in_and_out():
    camera = Camera(**PINHOLE, distortion=BARREL)
    matrix = [[camera.fx, 0, camera.cx], [0, camera.fy, camera.cy], [0, 0, 1]]
    np.testing.assert_array_equal(camera.matrix, matrix)
    assert Camera.from_matrix(camera.width, camera.height, matrix, distortion=BARREL) == camera


def test_a_camera_of_the_model_is_the_one_given():
    camera = Camera(**PINHOLE)
    assert nacre.Model(camera).camera is camera


@pytest.mark.parametrize(
    ("call", "error", "message"),
    [
        (lambda: Camera.from_fov(64, 48, 0), ValueError, "horizontal_degrees must be more than 0 .* got 0"),
        (lambda: Camera.from_fov(64, 48, 60, 180), ValueError, "vertical_degrees must be .* got 180"),
        (lambda: Camera.from_fov(64, 48, np.nan), ValueError, "horizontal_degrees must be .* got nan"),
        (lambda: Camera.from_fov(64, 48, "60"), TypeError, "horizontal_degrees must be a number, got '60'"),
        (lambda: Camera.from_fov(64.5, 48, 60), TypeError, "width must be an integer, got 64.5"),
        (lambda: Camera.from_fov(64, 0, 60), ValueError, "height must be 1 to 65536 pixels, got 0"),
        (lambda: Camera.from_matrix(64, 48, np.eye(4)), ValueError, r"matrix must have shape \(3, 3\), got"),
        (lambda: Camera.from_matrix(64, 48, np.ones((3, 3))), ValueError, r"matrix must be \[\[fx, 0, cx\]"),
        (lambda: Camera.from_matrix(64, 48, np.full((3, 3), np.nan)), ValueError, "matrix must be finite"),
        (lambda: Camera.from_matrix(64, 48, np.diag([0, 5, 1])), ValueError, "fx must be"),
        (lambda: Camera.from_matrix(64, 48, [["a"] * 3] * 3), TypeError, "matrix must be an array of real"),
    ],
)
def test_wrong_fields_of_view_and_matrices(call, error, message):
    with pytest.raises(error, match=message):
        call()
