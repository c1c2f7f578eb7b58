"""Camera files: the plain recording's camera.json and Open3D's intrinsics."""

import json

import hypothesis.strategies as st
import pytest
from hypothesis import given

from nacre import Camera, read_camera, write_camera

PINHOLE = {
    "model": "pinhole", "width": 640, "height": 480, "fx": 525, "fy": 524.5, "cx": 319.5, "cy": 239.5,
    "distortion": [0.1, -0.2, 0.001, 0.002, 0.05], "depth": "z", "depth_scale": 1000,
}  # fmt: skip
ORTHOGRAPHIC = {
    "model": "orthographic",
    "width": 256,
    "height": 200,
    "pixel_size": 0.001,
    "depth_scale": 50000,
}
OPEN3D = {"width": 640, "height": 480, "intrinsic_matrix": [617.25, 0, 0, 0, 617.5, 0, 317.4, 246.0, 1]}


def write(path, document):
    path.write_text(document if isinstance(document, str) else json.dumps(document))
    return path


def test_pinhole(tmp_path):
    found = read_camera(write(tmp_path / "camera.json", PINHOLE))
    assert found.depth_scale == 1000
    assert found.camera == Camera(
        640, 480, 525, 524.5, 319.5, 239.5, distortion=(0.1, -0.2, 0.001, 0.002, 0.05)
    )


def test_pinhole_needs_neither_distortion_nor_depth_nor_scale(tmp_path):
    short = {k: v for k, v in PINHOLE.items() if k not in ("distortion", "depth", "depth_scale")}
    found = read_camera(write(tmp_path / "camera.json", short))
    assert found.camera == Camera(640, 480, 525, 524.5, 319.5, 239.5)
    assert found.depth_scale is None


def test_radial_depth(tmp_path):
    assert (
        read_camera(write(tmp_path / "camera.json", {**PINHOLE, "depth": "radial"})).camera.depth == "radial"
    )


def test_orthographic(tmp_path):
    found = read_camera(write(tmp_path / "camera.json", ORTHOGRAPHIC))
    assert found.camera == Camera.orthographic(256, 200, 0.001)
    assert found.depth_scale == 50000


def test_open3d_matrix_is_column_by_column(tmp_path):
    found = read_camera(write(tmp_path / "intrinsic.json", OPEN3D))
    assert found.camera == Camera(640, 480, 617.25, 617.5, 317.4, 246.0)
    assert found.depth_scale is None
    with_scale = read_camera(write(tmp_path / "intrinsic.json", {**OPEN3D, "depth_scale": 4000.0, "fps": 30}))
    assert with_scale.depth_scale == 4000


def test_unknown_keys_are_told_and_ignored(tmp_path):
    with pytest.warns(UserWarning, match="ignored keys that a pinhole camera does not have: distorsion"):
        read_camera(write(tmp_path / "camera.json", {**PINHOLE, "distorsion": [1, 1, 1, 1, 1]}))


finite = st.floats(-1e4, 1e4)
focal = st.floats(1e-2, 1e5)


@given(
    size=st.tuples(st.integers(1, 40), st.integers(1, 40)),
    focal=st.tuples(focal, focal),
    centre=st.tuples(finite, finite),
    distortion=st.lists(st.floats(-1e-3, 1e-3), min_size=5, max_size=5),
    depth=st.sampled_from(["z", "radial"]),
    scale=st.none() | st.floats(1e-3, 1e6),
)
def test_pinhole_comes_back_exactly(tmp_path_factory, size, focal, centre, distortion, depth, scale):
    path = tmp_path_factory.mktemp("camera") / "camera.json"
    camera = Camera(*size, *focal, *centre, distortion=distortion, depth=depth)
    write_camera(path, camera, scale)
    again = read_camera(path)
    assert again.camera == camera
    assert again.depth_scale == scale


@given(pixel_size=st.floats(1e-6, 1.0))
def test_orthographic_comes_back(tmp_path_factory, pixel_size):
    path = tmp_path_factory.mktemp("camera") / "camera.json"
    write_camera(path, Camera.orthographic(8, 6, pixel_size), 1000)
    again = read_camera(path).camera
    assert (again.width, again.height) == (8, 6)
    assert again.pixel_size == pytest.approx(pixel_size, rel=1e-15)


def test_written_file_has_the_fixed_spelling(tmp_path):
    write_camera(tmp_path / "camera.json", Camera(640, 480, 525, 524.5, 319.5, 239.5), 1000)
    document = json.loads((tmp_path / "camera.json").read_text())
    assert document == {**PINHOLE, "distortion": [0, 0, 0, 0, 0]}
    write_camera(tmp_path / "camera.json", Camera.orthographic(256, 200, 0.001), 50000)
    assert json.loads((tmp_path / "camera.json").read_text()) == ORTHOGRAPHIC


@pytest.mark.parametrize("scale", [0, -1, float("nan"), float("inf")])
def test_written_scale_must_be_positive(tmp_path, scale):
    with pytest.raises(ValueError, match="depth_scale"):
        write_camera(tmp_path / "camera.json", Camera(4, 3, 5, 5, 2, 1), scale)
    assert list(tmp_path.iterdir()) == []
