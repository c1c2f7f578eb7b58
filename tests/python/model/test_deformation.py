"""A model that bends: its canonical shape, and how it was at each frame."""

import numpy as np
import pytest
from bending_sheet import CAMERA, CURVATURES, sheet

import nacre


@pytest.fixture(scope="module")
def depths() -> list:
    """Return what a camera that stands still sees of the sheet."""
    return [
        sheet(curvature).simulate_depth(CAMERA, np.eye(4), noise="kinect", seed=index)
        for index, curvature in enumerate(CURVATURES)
    ]


def grown(depths, **changes) -> nacre.Model:
    model = nacre.Model(CAMERA, deform=True, **changes)
    for depth in depths:
        model.add_frame(depth)
    return model


def in_camera(model: nacre.Model, frame: int) -> np.ndarray:
    pose = np.linalg.inv(model.frames[frame].world_from_camera)
    return model.points_at(frame) @ pose[:3, :3].T + pose[:3, 3]


def error(points, mesh) -> float:
    return float(np.sqrt((mesh.closest(points.astype(np.float32)).distances ** 2).mean()))


@pytest.fixture(scope="module")
def model(depths) -> nacre.Model:
    return grown(depths)


def test_the_model_is_where_the_surface_was_at_each_frame(model) -> None:
    assert [frame.status for frame in model.frames] == ["TRACKED"] * len(CURVATURES)
    for frame, curvature in enumerate(CURVATURES):
        assert error(in_camera(model, frame), sheet(curvature)) < 0.0015
    rigid_error = error(in_camera(model, 0), sheet(CURVATURES[-1]))
    assert error(in_camera(model, len(CURVATURES) - 1), sheet(CURVATURES[-1])) < 0.25 * rigid_error


def test_points_are_the_canonical_shape(model) -> None:
    assert error(model.points, sheet(CURVATURES[0])) < 0.002  # of the first frame
    assert model.points_at(0).shape == model.points.shape
    np.testing.assert_allclose(np.linalg.norm(model.normals_at(3), axis=1), 1, atol=1e-5)
    assert model.nodes_at(0).shape == (model.frames[-1].deformation.num_nodes, 3)


def test_reports_tell_how_it_is_bent(model) -> None:
    first, last = model.frames[0].deformation, model.frames[-1].deformation
    assert 10 < first.num_nodes <= last.num_nodes
    assert last.explained > 0.8
    assert 0 < last.strain < 0.05


def before_wall(mesh: nacre.Mesh) -> nacre.Mesh:
    x, y = np.meshgrid(np.linspace(-0.8, 0.8, 61), np.linspace(-0.6, 0.6, 46))
    wall = np.stack([x, y, 0.9 + 0.015 * np.sin(20 * x) * np.cos(22 * y)], axis=-1).reshape(-1, 3)
    rows = len(mesh.vertices) + np.arange(46 * 61).reshape(46, 61)
    a, b, c, d = (part.ravel() for part in (rows[:-1, :-1], rows[:-1, 1:], rows[1:, :-1], rows[1:, 1:]))
    triangles = np.concatenate([np.stack([a, b, c], axis=-1), np.stack([b, d, c], axis=-1)])
    return nacre.Mesh(
        np.concatenate([mesh.vertices, wall]).astype(np.float32),
        np.concatenate([mesh.triangles, triangles]).astype(np.int32),
    )


def test_what_bends_before_a_wall_bends_alone() -> None:
    curvatures = np.linspace(0, 0.5, 11)

    def small(curvature: float) -> nacre.Mesh:
        mesh = sheet(curvature)
        return nacre.Mesh((mesh.vertices * (0.5, 0.5, 1)).astype(np.float32), mesh.triangles)

    model = grown(
        before_wall(small(curvature)).simulate_depth(CAMERA, np.eye(4), noise="kinect", seed=index)
        for index, curvature in enumerate(curvatures)
    )
    nodes = model.nodes_at(0)
    is_wall = nodes[:, 2] > 0.8
    assert is_wall.any()
    assert not is_wall.all()
    np.testing.assert_array_equal(model.nodes_at(10)[is_wall], nodes[is_wall])
    for frame in (5, 10):
        points = in_camera(model, frame)
        assert error(points[points[:, 2] < 0.8], small(curvatures[frame])) < 0.001


def test_any_number_of_threads_gives_the_same_bits(depths, model) -> None:
    for threads in (1, 3):
        other = grown(depths, num_threads=threads)
        assert other.points.tobytes() == model.points.tobytes()
        assert other.points_at(2).tobytes() == model.points_at(2).tobytes()


def test_a_saved_model_goes_on_to_the_same_bits(depths, model, tmp_path) -> None:
    half = grown(depths[:3])
    half.save(tmp_path / "half.nacre")
    loaded = nacre.Model.load(tmp_path / "half.nacre")
    for depth in depths[3:]:
        loaded.add_frame(depth)
    assert loaded.points_at(4).tobytes() == model.points_at(4).tobytes()
    assert [f.deformation for f in loaded.frames] == [f.deformation for f in model.frames]


def test_a_rigid_thing_is_the_rigid_model() -> None:
    images = [sheet(0.5).simulate_depth(CAMERA, np.eye(4), noise="kinect", seed=seed) for seed in range(4)]
    bending, rigid = grown(images), nacre.Model(CAMERA)
    for image in images:
        rigid.add_frame(image)
    assert error(bending.points, sheet(0.5)) < 1.05 * error(rigid.points, sheet(0.5))
    assert bending.frames[-1].deformation.strain < 1e-6


def test_a_lost_frame_leaves_the_shape(depths) -> None:
    model = grown(depths[:3])
    before = model.points
    report = model.add_frame(np.zeros((120, 160), np.float32))
    assert report.status == "LOST"
    assert model.points.tobytes() == before.tobytes()
    assert model.points_at(3).tobytes() == model.points_at(2).tobytes()
    assert model.add_frame(depths[3]).tracked


@pytest.mark.parametrize("frame", [-1, 6])
def test_frames_that_are_not_there_are_refused(model, frame) -> None:
    with pytest.raises(ValueError, match="frame must be"):
        model.points_at(frame)


def test_a_rigid_model_has_one_shape() -> None:
    with pytest.raises(ValueError, match="deform must be on"):
        nacre.Model(CAMERA).points_at(0)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"preset": "paper"}, "fusion_method must be fuse for a model that deforms, got wlop"),
        ({"fusion_method": "wlop+"}, r"fusion_method must be fuse for a model that deforms, got wlop\+"),
        (
            {"registration": {"method": "paper"}},
            "registration.method must be another than paper for a model that deforms, got paper",
        ),
    ],
)
def test_what_is_for_rigid_models_is_refused(options, message) -> None:
    with pytest.raises(ValueError, match=message):
        nacre.Model(CAMERA, deform=True, **options)
