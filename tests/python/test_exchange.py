"""What other libraries and notebooks get of a model."""

from __future__ import annotations

import io
import math
import pickle
import sys
from pathlib import Path

import numpy as np
import pytest

import nacre


@pytest.fixture(scope="module")
def model() -> nacre.Model:
    mesh = nacre.built_in_object()
    camera = nacre.Camera(160, 120, 131, 131, 79.5, 59.5)
    model = nacre.Model(camera)
    red = np.full((120, 160, 3), (200, 10, 10), np.uint8)
    for pose in nacre.turntable_poses(mesh, 2, math.radians(5), camera=camera, distance=0.3):
        model.add_frame(mesh.simulate_depth(camera, pose, noise=0.0005), color=red)
    return model


def test_numpy_takes_the_model_for_its_points(model: nacre.Model) -> None:
    assert np.array_equal(np.asarray(model), model.points)
    assert np.asarray(model, dtype=np.float64).dtype == np.float64
    assert np.mean(model, axis=0).shape == (3,)


def test_its_memory_is_not_shared(model: nacre.Model) -> None:
    with pytest.raises(ValueError, match="copy must be True or None"):
        model.__array__(copy=False)


def test_triangles_join_the_points(model: nacre.Model, tmp_path: Path) -> None:
    mesh = model.to_mesh(num_threads=1)
    assert 1.5 * len(model) < len(mesh.triangles) < 2 * len(model)
    cloud = model.cloud()
    rows = nacre.KdTree(cloud.points).query(mesh.vertices, 1)[1]
    assert np.array_equal(mesh.vertices, cloud.points[rows])
    assert np.array_equal(mesh.normals, cloud.normals[rows])
    assert np.array_equal(mesh.colors, cloud.colors[rows])
    nacre.write_mesh(tmp_path / "mesh.ply", mesh)
    again = nacre.read_mesh(tmp_path / "mesh.ply")
    for name in ("vertices", "triangles", "normals", "colors"):
        assert np.array_equal(getattr(again, name), getattr(mesh, name))
    with pytest.raises(ValueError, match="triangles must not be given with a Mesh"):
        nacre.write_mesh(tmp_path / "mesh.ply", mesh, mesh.triangles)
    with pytest.raises(TypeError, match="triangles must be an array of indices, got None"):
        nacre.write_mesh(tmp_path / "mesh.ply", mesh.vertices)


def test_a_cloud_has_what_a_surface_has(model: nacre.Model) -> None:
    rows = nacre.meshing.on_surface(model.points, model.normals, model.confidence)
    cloud, everything = model.cloud(), model.cloud(all_points=True)
    assert 0.9 < rows.mean() < 1
    assert np.array_equal(everything.points, model.points)
    assert np.array_equal(cloud.points, model.points[rows])
    assert cloud.normals is not None
    assert cloud.colors is not None
    assert np.array_equal(cloud.normals, model.normals[rows])
    assert np.array_equal(cloud.colors, model.colors[rows])
    assert np.array_equal(cloud.attributes["confidence"], model.confidence[rows])
    assert np.array_equal(cloud.attributes["last_seen"], model.last_seen[rows])


def test_open3d_gets_points_normals_and_colours(model: nacre.Model, monkeypatch: pytest.MonkeyPatch) -> None:
    open3d = pytest.importorskip("open3d")
    cloud = model.to_open3d()
    assert isinstance(cloud, open3d.geometry.PointCloud)
    assert np.allclose(np.asarray(cloud.points), model.points)
    assert np.allclose(np.asarray(cloud.normals), model.normals)
    assert np.allclose(np.asarray(cloud.colors)[0], np.array([200, 10, 10]) / 255)


def test_trimesh_gets_points_normals_and_colours(model: nacre.Model) -> None:
    pytest.importorskip("trimesh")
    cloud = model.to_trimesh()
    assert np.allclose(cloud.vertices, model.points)
    assert np.allclose(cloud.metadata["normals"], model.normals)
    assert cloud.colors[0, :3].tolist() == [200, 10, 10]


@pytest.mark.parametrize("name", ["open3d", "trimesh"])
def test_a_missing_library_comes_with_the_command_that_installs_it(
    name: str, model: nacre.Model, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises(ImportError, match=f"pip install {name}"):
        getattr(model, f"to_{name}")()


def test_notebooks_get_a_picture(model: nacre.Model) -> None:
    image = pytest.importorskip("PIL.Image").open(io.BytesIO(model._repr_png_()))
    assert image.size == (480, 400)
    shown = np.asarray(image.convert("RGBA"))[..., 3] > 0
    assert 0.05 < shown.mean() < 0.95
    assert nacre.Model(model.camera)._repr_png_() is None


def test_numpy_takes_a_cloud_for_its_points() -> None:
    cloud = nacre.Cloud(np.arange(12.0).reshape(4, 3))
    assert np.shares_memory(np.asarray(cloud), cloud.points)
    assert not np.shares_memory(np.array(cloud), cloud.points)
    assert np.asarray(cloud, np.float32).dtype == np.float32
    with pytest.raises(ValueError, match="copy must be True or None for points as float32, got False"):
        cloud.__array__(np.float32, copy=False)


def test_some_rows_of_a_cloud_keep_what_belongs_to_them() -> None:
    points = np.arange(12.0).reshape(4, 3)
    cloud = nacre.Cloud(points, points, np.eye(4, 3, dtype=np.uint8), {"i": np.arange(4)}, ("hello",))
    mask = np.array([False, True, False, True])
    for some in (cloud[mask], cloud[[1, 3]], cloud[1::2], cloud[mask.tolist()]):
        assert some.points.tolist() == some.normals.tolist() == points[[1, 3]].tolist()
        assert some.colors.tolist() == [[0, 1, 0], [0, 0, 0]]
        assert some.attributes["i"].tolist() == [1, 3]
        assert some.comments == ("hello",)
    assert len(cloud[[]]) == len(nacre.Cloud(points)[:0]) == 0


@pytest.mark.parametrize("rows", [0, 1.0, "points", [0.5], [[0, 1]], None])
def test_rows_are_a_slice_a_mask_or_indices(rows: object) -> None:
    with pytest.raises(TypeError, match=r"rows must be a slice, a mask or indices, got .*cloud\.points\[0\]"):
        nacre.Cloud(np.zeros((4, 3)))[rows]  # type: ignore[index]


@pytest.mark.parametrize("rows", [[4], [True, False]])
def test_rows_that_are_not_there(rows: list[int]) -> None:
    with pytest.raises(IndexError):
        nacre.Cloud(np.zeros((4, 3)))[rows]


def test_a_cloud_a_model_and_a_result_are_written_with_all_they_have(
    model: nacre.Model, tmp_path: Path
) -> None:
    path = tmp_path / "a.ply"
    nacre.write_points(path, model)
    cloud, expected = nacre.read_points(path), model.cloud()
    assert np.array_equal(cloud.points, expected.points)
    assert np.array_equal(cloud.normals, expected.normals)
    assert np.array_equal(cloud.colors, expected.colors)
    assert np.array_equal(cloud.attributes["confidence"], expected.attributes["confidence"])
    nacre.write_points(path, cloud, normals=-cloud.normals, attributes={})
    again = nacre.read_points(path)
    assert np.array_equal(again.normals, -cloud.normals)
    assert np.array_equal(again.colors, cloud.colors)
    assert again.attributes == {}


def test_a_mesh_is_not_an_array() -> None:
    mesh = nacre.Mesh(np.eye(3), [[0, 1, 2]])
    with pytest.raises(TypeError, match="a Mesh is no array: give its vertices or its triangles"):
        np.asarray(mesh)
    with pytest.raises(TypeError, match=r"points must be an array, got Mesh: a Mesh is no array: give"):
        nacre.KdTree(mesh)


def test_notebooks_get_pictures_of_clouds_and_frames(model: nacre.Model) -> None:
    opened = pytest.importorskip("PIL.Image").open
    thin = nacre.consolidate(model.points, num_points=200, attributes={"normals": model.normals})
    for cloud in (nacre.Cloud(model.points), nacre.Cloud(model.points[:2]), thin):
        image = opened(io.BytesIO(cloud._repr_png_() or b""))
        assert image.size == (480, 400)
        assert np.asarray(image.convert("RGBA"))[..., 3].any()
    assert nacre.Cloud(np.full((3, 3), np.nan))._repr_png_() is None

    depth = np.full((600, 1000), np.nan, np.float32)
    depth[:, 500:] = np.linspace(0.5, 1, 500)
    frame = nacre.SequenceFrame(0, depth, model.camera, None, None, None)
    shown = np.asarray(opened(io.BytesIO(frame._repr_png_() or b"")).convert("RGBA"))
    assert shown.shape == (200, 334, 4)
    assert (shown[:, :160, 3] == 0).all()
    assert (shown[:, 170:, 3] == 255).all()
    assert shown[0, 170, 0] > 200 > shown[0, -1, 0]  # near is yellow, far is violet


def test_without_pillow_notebooks_say_what_to_install(
    model: nacre.Model, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "PIL.Image", None)
    with pytest.warns(UserWarning, match=r'no picture is shown: .* pip install "nacre\[images\]"'):
        assert model._repr_png_() is None


def test_parameters_and_results_can_be_pickled(model: nacre.Model) -> None:
    report = pickle.loads(pickle.dumps(model.frames[1]))
    assert np.array_equal(report.world_from_camera, model.frames[1].world_from_camera)
    for thing in (model.parameters, model.noise, model.camera):
        assert pickle.loads(pickle.dumps(thing)) == thing
    found = nacre.align(model.points, model.points)
    assert np.array_equal(pickle.loads(pickle.dumps(found)).target_from_source, found.target_from_source)


def test_reports_are_a_sequence(model: nacre.Model) -> None:
    reports = model.frames
    assert reports[-2:] == reports[:2] == (reports[0], reports[1])
    assert reports == model.frames
    assert reports != reports[:1]
    assert reports != [reports[0], reports[1]]
    assert repr(reports) == "FrameReports(2 frames)"
    assert pickle.loads(pickle.dumps(reports)) == tuple(reports)
    with pytest.raises(TypeError, match="no hash"):
        hash(reports)
    with pytest.raises(IndexError):
        reports[2]
