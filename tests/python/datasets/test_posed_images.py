"""COLMAP models and nerfstudio folders: where a point of the world is seen, they must say the same."""

import json

import numpy as np
import pytest

import nacre
from nacre.datasets import write_colmap, write_nerfstudio

pytest.importorskip("PIL")

WRITERS = [write_colmap, write_nerfstudio]
DISTORTIONS = {
    "PINHOLE": (0, 0, 0, 0, 0),
    "OPENCV": (0.1, -0.05, 0.002, -0.001, 0),
    "FULL_OPENCV": (0.1, -0.05, 0.002, -0.001, 0.01),
}
CLOUD = nacre.Cloud(
    np.array([[0.1, 0.05, 1], [-0.1, 0, 1.1], [np.nan, 0, 1], [0, -0.1, 0.9]]),
    colors=np.array([[255, 0, 0], [1, 2, 3], [9, 9, 9], [0, 0, 255]], np.uint8),
)
POINT = CLOUD.points[0]


def poses(count=4):
    along_x = np.stack([np.eye(4)] * count)
    along_x[:, 0, 3] = 0.1 * np.arange(count)
    return along_x


def recording(folder, distortion=DISTORTIONS["PINHOLE"], count=4, depth="z"):
    camera = nacre.Camera(32, 24, 30.0, 31.0, 14.5, 11.0, distortion=distortion, depth=depth)
    images = np.random.default_rng(1).integers(0, 256, (count, 24, 32, 3)).astype(np.uint8)
    depths = np.full((count, 24, 32), 0.8125)
    depths[:, 0] = np.nan
    nacre.write_recording(folder, camera, depths, depth_scale=5000, colors=images)
    return nacre.open_sequence(folder)


@pytest.fixture(scope="module")
def sequence(tmp_path_factory):
    """Return a recording of four views."""
    return recording(tmp_path_factory.mktemp("posed") / "recording")


def seen_at(camera, world_from_camera, point=POINT):
    """Return the pixel where a camera sees a point, whose first one's centre is (0, 0)."""
    local = np.linalg.inv(world_from_camera) @ np.append(point, 1)
    return camera.project(local[None, :3])[0, :2]


@pytest.mark.parametrize("model", DISTORTIONS)
def test_colmap_sees_a_point_at_the_same_pixel(tmp_path, model):
    pycolmap = pytest.importorskip("pycolmap")
    sequence = recording(tmp_path / "recording", DISTORTIONS[model], count=2)
    towards = np.stack([np.eye(4)] * 2)
    towards[:, 0, 3] = (-0.1, 0.2)
    towards[1:, :3, :3] = [[np.cos(0.1), 0, np.sin(0.1)], [0, 1, 0], [-np.sin(0.1), 0, np.cos(0.1)]]
    assert write_colmap(tmp_path / "out", sequence, towards, cloud=CLOUD) == 2
    found = pycolmap.Reconstruction(str(tmp_path / "out" / "sparse" / "0"))
    (camera,) = found.cameras.values()
    assert camera.model.name == model
    for image in found.images.values():
        pose = towards[int(image.name[-10:-4])]
        pixel = camera.img_from_cam(image.cam_from_world() * POINT)
        np.testing.assert_allclose(pixel, seen_at(sequence.camera, pose) + 0.5, atol=1e-9)
    assert len(found.points3D) == 3
    assert found.points3D[2].color.tolist() == [1, 2, 3]


def test_nerfstudio_sees_a_point_at_the_same_pixel(tmp_path, sequence):
    """With the formulas of its documentation: OpenGL's axes, the origin in the image's corner."""
    assert write_nerfstudio(tmp_path / "out", sequence, np.stack([np.eye(4)] * 4), cloud=CLOUD) == 4
    document = json.loads((tmp_path / "out" / "transforms.json").read_text())
    assert len(document["frames"]) == 4
    x, y, z, _ = np.linalg.inv(document["frames"][0]["transform_matrix"]) @ np.append(POINT, 1)
    pixel = (document["cx"] + document["fl_x"] * x / -z, document["cy"] - document["fl_y"] * y / -z)
    np.testing.assert_allclose(pixel, seen_at(sequence.camera, np.eye(4)) + 0.5)
    for frame in document["frames"]:
        assert (tmp_path / "out" / frame["file_path"]).is_file()
    depth = nacre.io.images.read_depth(tmp_path / "out" / document["frames"][2]["depth_file_path"])
    assert set(np.unique(depth)) == {0, 812}
    points = nacre.read_points(tmp_path / "out" / document["ply_file_path"])
    assert len(points) == 3
    np.testing.assert_array_equal(points.colors[2], [0, 0, 255])


def test_nerfstudio_finds_all_that_its_parser_asks_for(tmp_path):
    """As ``nerfstudio_dataparser.py`` does, which sorts frames, and wants depth of all or none."""
    from PIL import Image

    sequence = recording(tmp_path / "recording", DISTORTIONS["FULL_OPENCV"], count=3)
    write_nerfstudio(tmp_path / "out", sequence, poses(3), cloud=CLOUD)
    document = json.loads((tmp_path / "out" / "transforms.json").read_text())
    assert document["camera_model"] == "OPENCV"
    known = [float(document[name]) for name in ("fl_x", "fl_y", "cx", "cy", "k1", "k2", "k3", "p1", "p2")]
    assert known == [30, 31, 15, 11.5, 0.1, -0.05, 0.01, 0.002, -0.001]
    size = (int(document["w"]), int(document["h"]))
    frames = document["frames"]
    assert frames == sorted(frames, key=lambda frame: frame["file_path"])
    for i, frame in enumerate(frames):
        pose = np.array(frame["transform_matrix"], np.float32)
        np.testing.assert_allclose(pose, poses(3)[i] @ np.diag([1, -1, -1, 1]), atol=1e-7)
        for name in ("file_path", "depth_file_path"):
            with Image.open(tmp_path / "out" / frame[name]) as image:
                assert image.size == size


@pytest.mark.parametrize("write", WRITERS)
def test_views_without_a_pose_are_left_out(tmp_path, sequence, write):
    known = poses()
    known[2] = np.nan
    assert write(tmp_path / "out", sequence, known) == 3
    names = sorted(path.name for path in (tmp_path / "out" / "images").iterdir())
    assert names == ["frame_000000.png", "frame_000001.png", "frame_000003.png"]
    stored = (sequence.path / "color" / "000003.png").read_bytes()
    assert (tmp_path / "out" / "images" / names[2]).read_bytes() == stored


def test_depth_along_the_ray_is_left_out(tmp_path):
    sequence = recording(tmp_path / "recording", count=1, depth="radial")
    write_nerfstudio(tmp_path / "out", sequence, poses(1))
    frames = json.loads((tmp_path / "out" / "transforms.json").read_text())["frames"]
    assert not any("depth_file_path" in frame for frame in frames)
    assert not (tmp_path / "out" / "depth").exists()


def test_images_within_another_file_are_written_anew(tmp_path, sequence, monkeypatch):
    monkeypatch.setattr(type(sequence), "color_file", lambda *_: None)
    write_colmap(tmp_path / "out", sequence, poses())
    written = nacre.io.images.read_color(tmp_path / "out" / "images" / "frame_000001.png")
    np.testing.assert_array_equal(written, sequence[1].color)


@pytest.mark.parametrize("write", WRITERS)
def test_illegal_arguments_write_nothing(tmp_path, sequence, write):
    out = tmp_path / "out"
    gray = sequence.without_color()
    sheared = poses()
    sheared[1, 0, 1] = 3
    for given, wrong, error, message in (
        (sequence, poses(3), ValueError, "poses must have one for each of 4 views, got 3"),
        (sequence, sheared, ValueError, r"poses\[1\] must be a rigid transform"),
        (sequence, np.full((4, 4, 4), np.nan), nacre.FileFormatError, "no view has both a colour image"),
        (gray, poses(), nacre.FileFormatError, "no view has both a colour image and a pose"),
    ):
        with pytest.raises(error, match=message):
            write(out, given, wrong)
        assert not out.exists()


@pytest.mark.parametrize("write", WRITERS)
def test_a_folder_with_something_in_it_is_left_as_it_is(tmp_path, sequence, write):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "mine.txt").write_text("mine")
    for out in (tmp_path / "out", tmp_path / "out" / "mine.txt"):
        with pytest.raises(FileExistsError, match="is not empty"):
            write(out, sequence, poses())
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["mine.txt"]


@pytest.mark.parametrize("write", WRITERS)
def test_orthographic_cameras_are_refused(tmp_path, write):
    camera = nacre.Camera.orthographic(32, 24, 0.01)
    depths, colors = np.ones((1, 24, 32)), np.zeros((1, 24, 32, 3), np.uint8)
    nacre.write_recording(tmp_path / "r", camera, depths, depth_scale=5000, colors=colors)
    with pytest.raises(nacre.FileFormatError, match="images need a pinhole camera, this one is orthographic"):
        write(tmp_path / "out", nacre.open_sequence(tmp_path / "r"), poses(1))
    assert not (tmp_path / "out").exists()
