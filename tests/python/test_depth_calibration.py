"""The systematic error of depth that overlapping views give away."""

import dataclasses
import json
import math

import numpy as np
import pytest

import nacre
from nacre.datasets.corrected import with_corrected_depth
from nacre.reconstruction import Reconstruction
from nacre.reconstruction.calibration import DepthViews

CAMERA = nacre.Camera(width=320, height=240, fx=260, fy=260, cx=159.5, cy=119.5)
SIDE = ((np.arange(320) - 159.5) / 260)[None, :]
DOWN = ((np.arange(240) - 119.5) / 260)[:, None]


def boxes(*corners):
    """A mesh of axis-aligned boxes."""
    faces = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    vertices, triangles = [], []
    for low, high in corners:
        first = len(vertices)
        vertices += [[(low, high)[i >> k & 1][k] for k in range(3)] for i in range(8)]
        for a, b, c, d in faces:
            triangles += [(first + a, first + b, first + c), (first + a, first + c, first + d)]
    return nacre.Mesh(np.array(vertices, float), np.array(triangles))


def pose(yaw, pitch):
    """A camera near the middle of the room."""
    c, s = math.cos(yaw), math.sin(yaw)
    d, t = math.cos(pitch), math.sin(pitch)
    matrix = np.eye(4)
    turn = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
    matrix[:3, :3] = turn @ np.array([[1, 0, 0], [0, d, -t], [0, t, d]])
    matrix[:3, 3] = 0.05 * np.array([s, 0, c])
    return matrix


@pytest.fixture(scope="module")
def room():
    """Views of a furnished room, 6 degrees apart, with the noise of structured light; and their poses."""
    rng = np.random.default_rng(0)
    furniture = []
    for _ in range(30):  # which leave enough of the floor to be seen
        angle, distance = rng.uniform(-math.pi, math.pi), rng.uniform(1.0, 2.6)
        x, z = distance * math.sin(angle), distance * math.cos(angle)
        a, b = rng.uniform(0.08, 0.3, 2)
        furniture.append(((x - a, rng.uniform(-0.9, 0.9), z - b), (x + a, 1.2, z + b)))
    mesh = boxes(((-3.0, -1.4, -3.2), (3.2, 1.2, 3.0)), *furniture)
    poses = [pose(math.radians(6 * i), -0.35 + 0.05 * math.sin(i)) for i in range(12)]
    noise = nacre.NoiseModel.kinect()
    depths = [
        mesh.simulate_depth(CAMERA, matrix, noise=noise, edge_mixing=1.0, seed=i)
        for i, matrix in enumerate(poses)
    ]
    return depths, poses


@pytest.mark.parametrize("tilt", [-0.02, 0.01, 0.03])
def test_it_finds_the_error_that_was_made(room, tilt):
    depths, poses = room
    wrong = [depth / (1.0 + tilt * SIDE * depth) for depth in depths]
    found = nacre.calibrate_depth(zip(wrong, poses, strict=True), CAMERA)
    assert found.is_significant
    assert found.num_pairs == 21
    assert abs(found.tilt - tilt) < max(5 * found.sigma, 0.05 * abs(tilt))
    for depth, image in zip(depths, wrong, strict=True):
        off = np.nanmax(np.abs(found.correct(image, CAMERA) - depth))
        assert off < 0.2 * np.nanmax(np.abs(image - depth))


def test_it_does_not_need_exact_poses(room):
    depths, poses = room
    rng = np.random.default_rng(1)
    near = []
    for matrix in poses:
        shaken = matrix @ pose(*rng.normal(0.0, 0.01, 2))
        shaken[:3, 3] += rng.normal(0.0, 0.02, 3)
        near.append(shaken)
    wrong = [depth / (1.0 + 0.02 * SIDE * depth) for depth in depths]
    found = nacre.calibrate_depth(zip(wrong, near, strict=True), CAMERA)
    assert found.is_significant
    assert found.tilt == pytest.approx(0.02, rel=0.1)


@pytest.mark.parametrize(
    "distort",
    [
        lambda z: z,
        lambda z: z + 0.01 * z**2,
        lambda z: z * (1 + 0.03 * (SIDE**2 + DOWN**2)),
        lambda z: z / (1 + 0.01 * DOWN * z),
    ],
    ids=["none", "grows with depth", "radial", "tilted down the image"],
)
def test_other_errors_are_not_taken_for_it(room, distort):
    depths, poses = room
    found = nacre.calibrate_depth(zip(map(distort, depths), poses, strict=True), CAMERA)
    assert not found.is_significant


def test_a_wrong_focal_length_is_not_taken_for_it(room):
    depths, poses = room
    camera = nacre.Camera(width=320, height=240, fx=252, fy=252, cx=159.5, cy=119.5)
    assert not nacre.calibrate_depth(zip(depths, poses, strict=True), camera).is_significant


@pytest.mark.parametrize("factor", [0.8, 0.93, 1.07, 1.25])
@pytest.mark.parametrize("tilt", [0.0, 0.02])
def test_it_finds_the_focal_length(room, factor, tilt):
    depths, poses = room
    camera = nacre.Camera(width=320, height=240, fx=260 * factor, fy=260 * factor, cx=159.5, cy=119.5)
    tilted = [depth / (1.0 + tilt * SIDE * depth) for depth in depths]
    found = nacre.calibrate_depth(zip(tilted, poses, strict=True), camera)
    assert found.has_wrong_focal_length
    assert found.focal_scale * factor == pytest.approx(1.0, abs=0.005)
    advice = found.focal_length_advice(camera)
    assert f"fx {camera.fx * found.focal_scale:.0f} " in advice


@pytest.mark.parametrize("factor", [0.97, 1.0, 1.03])
def test_a_focal_length_that_is_about_right_is_no_cause_for_advice(room, factor):
    depths, poses = room
    camera = nacre.Camera(width=320, height=240, fx=260 * factor, fy=260 * factor, cx=159.5, cy=119.5)
    found = nacre.calibrate_depth(zip(depths, poses, strict=True), camera)
    assert not found.has_wrong_focal_length
    assert found.focal_length_advice(camera) == ""


def test_a_wrong_focal_length_is_told_once_by_a_reconstruction(room, caplog):
    depths, _ = room
    camera = nacre.Camera(width=320, height=240, fx=234, fy=234, cx=159.5, cy=119.5)
    frames = [nacre.SequenceFrame(i, depth, camera, None, None, None) for i, depth in enumerate(depths)]
    with caplog.at_level("WARNING", logger="nacre"):
        done = nacre.reconstruct(frames, calibrate=True)
    assert done.depth_calibration.focal_scale == pytest.approx(1 / 0.9, abs=0.01)
    assert len([record for record in caplog.records if "focal length is wrong" in record.message]) == 1


def test_a_recording_that_can_be_read_only_once_is_enough(room):
    depths, poses = room
    once = ((depth, matrix) for depth, matrix in zip(depths, poses, strict=True))
    assert nacre.calibrate_depth(once, CAMERA) == nacre.calibrate_depth(
        zip(depths, poses, strict=True), CAMERA
    )


def reconstruct(recording, out, *more):
    """Run the command; return its report."""
    pytest.importorskip("typer")
    from nacre.cli import main

    with pytest.raises(SystemExit) as stopped:
        main(["reconstruct", str(recording), "-o", str(out), "--quiet", *more])
    assert stopped.value.code == 0
    return json.loads((out / "report.json").read_text())


def test_reconstruct_corrects_what_it_finds(room, tmp_path):
    depths, poses = room
    wrong = [depth / (1.0 + 0.01 * SIDE * depth) for depth in depths]
    nacre.write_recording(tmp_path / "recording", CAMERA, wrong, depth_scale=5000, poses=poses)
    report = reconstruct(tmp_path / "recording", tmp_path / "out")
    found = report["depth_calibration"]
    assert found.pop("used")
    assert found["tilt"] == pytest.approx(0.01, rel=0.1)
    assert reconstruct(tmp_path / "recording", tmp_path / "o", "--no-calibrate")["depth_calibration"] is None

    corrected = nacre.open_sequence(tmp_path / "recording").with_depth_calibration(
        nacre.DepthCalibration(**found)
    )
    model = nacre.Model(CAMERA)
    for frame in corrected:
        model.add_frame(frame.depth)
    assert [frame["status"] for frame in report["frames"]] == [frame.status for frame in model.frames]
    assert report["num_points"] == len(model)


def test_reconstruct_leaves_good_depth_alone(room, tmp_path):
    depths, poses = room
    nacre.write_recording(tmp_path / "recording", CAMERA, depths, depth_scale=5000, poses=poses)
    report = reconstruct(tmp_path / "recording", tmp_path / "out")
    assert report["depth_calibration"] is None or not report["depth_calibration"]["used"]
    same = reconstruct(tmp_path / "recording", tmp_path / "same", "--no-calibrate")
    assert (tmp_path / "same" / "trajectory.txt").read_text() == (
        tmp_path / "out" / "trajectory.txt"
    ).read_text()
    assert report["num_tracked"] == same["num_tracked"]


@pytest.fixture(scope="module")
def wrong(room):
    """The same views as frames, with depth that is wrong."""
    depths, poses = room
    return [
        nacre.SequenceFrame(
            i, (depth / (1.0 + 0.01 * SIDE * depth)).astype(np.float32), CAMERA, None, None, pose
        )
        for i, (depth, pose) in enumerate(zip(depths, poses, strict=True))
    ]


@pytest.fixture(scope="module")
def corrected(wrong):
    return nacre.reconstruct(wrong, calibrate=True)


def test_one_call_corrects_what_it_finds(wrong, corrected):
    assert corrected.depth_calibration.is_significant
    assert corrected.depth_calibration.tilt == pytest.approx(0.01, rel=0.1)
    right = corrected.depth_calibration.correct(wrong[5].depth, CAMERA)
    np.testing.assert_array_equal(corrected.sequence[5].depth, right)
    np.testing.assert_array_equal(corrected.sequence[4:6][1].depth, right)
    assert len(corrected.frames) == len(wrong)
    left = nacre.reconstruct(wrong)
    assert left.depth_calibration is None
    errors = [done.evaluation["absolute_trajectory_error"].rotation_rmse for done in (corrected, left)]
    assert errors[0] < 0.5 * errors[1]


def test_what_a_mask_leaves_out_does_not_count(wrong):
    """Something that moves with the camera, over a third of the image."""
    shown = np.ones(wrong[0].depth.shape, bool)
    shown[:, :100] = False
    covered = [
        dataclasses.replace(frame, depth=np.where(shown, frame.depth, np.float32(0.6)), mask=shown)
        for frame in wrong
    ]
    views = DepthViews([(frame.index, frame.truth.ravel().tolist()) for frame in wrong])
    found = views.calibrate(Reconstruction(covered, nacre.Model(CAMERA))).depth_calibration
    seen = ((np.where(shown, frame.depth, np.float32(np.nan)), frame.truth) for frame in wrong)
    assert found.is_significant
    assert found == nacre.calibrate_depth(seen, CAMERA)


def test_one_call_does_what_the_command_does(wrong, tmp_path):
    nacre.write_recording(tmp_path / "recording", CAMERA, (frame.depth for frame in wrong), depth_scale=5000)
    report = reconstruct(tmp_path / "recording", tmp_path / "out")
    done = nacre.reconstruct(tmp_path / "recording", calibrate=True)
    assert report["depth_calibration"] == {**dataclasses.asdict(done.depth_calibration), "used": True}
    np.testing.assert_array_equal(nacre.read_points(tmp_path / "out" / "model.ply").points, done.model.points)


def test_a_run_with_corrected_depth_goes_on_from_a_file(wrong, corrected, tmp_path):
    told = []

    def progress(frame):
        told.append(frame.index)
        return len(told) < len(wrong) + 3

    done = nacre.reconstruct(wrong, calibrate=True, progress=progress)
    assert done.cancelled
    assert told == [*range(len(wrong)), 0, 1, 2]
    done.save(tmp_path / "run")
    other = Reconstruction.load(tmp_path / "run", wrong).complete()
    assert other.depth_calibration == corrected.depth_calibration
    np.testing.assert_array_equal(other.model.points, corrected.model.points)


def test_a_run_that_is_cancelled_before_has_no_calibration(wrong):
    done = nacre.reconstruct(wrong, calibrate=True, progress=lambda frame: frame.index < 5)
    assert done.cancelled
    assert len(done.frames) == 6
    assert done.depth_calibration is None
    assert "absolute_trajectory_error" in done.evaluation


def test_a_frame_of_another_size_is_lost_after_a_correction(wrong, corrected):
    small = dataclasses.replace(wrong[0], depth=wrong[0].depth[::2])
    frames = with_corrected_depth([wrong[0], small], corrected.depth_calibration)
    done = Reconstruction(frames, nacre.Model(CAMERA)).complete()
    assert [frame.status for frame in done.frames] == ["TRACKED", "LOST"]
    assert done.frames[1].refused


@pytest.mark.parametrize(
    ("camera", "changes"),
    [
        (nacre.Camera.orthographic(320, 240, 0.01), {}),
        (nacre.Camera(320, 240, 260, 260, 159.5, 119.5, depth="radial"), {}),
        (CAMERA, {"region": {"object": True}}),
    ],
)
def test_one_call_says_where_depth_cannot_be_calibrated(camera, changes):
    frame = nacre.SequenceFrame(0, np.ones((240, 320), np.float32), camera, None, None, None)
    with pytest.raises(ValueError, match="calibrate must be False for a region, or a camera"):
        nacre.reconstruct([frame], calibrate=True, **changes)


def test_a_camera_that_does_not_turn_says_nothing(room):
    depths, poses = room
    found = nacre.calibrate_depth([(depths[0], poses[0])] * 5, CAMERA)
    assert (found.tilt, found.sigma, found.num_pairs) == (0.0, math.inf, 0)
    assert not found.is_significant


def test_a_wall_says_nothing():
    wall = np.full((240, 320), 2.0, np.float32)
    found = nacre.calibrate_depth([(wall, pose(0.2 * i, 0.0)) for i in range(6)], CAMERA)
    assert not found.is_significant


def test_an_error_that_does_not_matter_is_left_alone():
    assert nacre.DepthCalibration(0.003, 0.0001, 6).is_significant
    assert not nacre.DepthCalibration(0.001, 0.0001, 6).is_significant
    assert not nacre.DepthCalibration(0.003, 0.001, 6).is_significant
    assert not nacre.DepthCalibration(0.003, 0.0001, 5).is_significant


def test_correction_is_of_inverse_depth():
    depth = np.full((240, 320), 2.0, np.float32)
    depth[0, 0] = np.nan
    inverse = 1.0 / nacre.DepthCalibration(0.02, 0.001, 9).correct(depth, CAMERA)
    expected = np.broadcast_to(0.5 - 0.02 * SIDE, depth.shape)
    np.testing.assert_allclose(inverse.ravel()[1:], expected.ravel()[1:], rtol=1e-6)
    assert np.isnan(inverse[0, 0])


def test_what_is_too_far_for_a_correction_is_dropped():
    depth = np.full((240, 320), 200.0, np.float32)
    corrected = nacre.DepthCalibration(0.02, 0.001, 9).correct(depth, CAMERA)
    assert np.isnan(corrected[:, [0, -1]]).all()
    assert np.isfinite(corrected[:, 159]).all()


def test_pixels_without_a_ray_have_no_depth():
    ends = nacre.Camera(
        width=320, height=240, fx=160, fy=160, cx=159.5, cy=119.5, distortion=(-0.3, 0.0, 0.0, 0.0, 0.0)
    )
    depth = np.full((240, 320), 2.0, np.float32)
    corrected = nacre.DepthCalibration(0.01, 0.001, 9).correct(depth, ends)
    assert np.isfinite(corrected).sum() == len(nacre.back_project(depth, ends)) < depth.size


@pytest.mark.parametrize(
    "camera",
    [
        nacre.Camera.orthographic(width=320, height=240, pixel_size=0.001),
        nacre.Camera(width=320, height=240, fx=260, fy=260, cx=159.5, cy=119.5, depth="radial"),
    ],
    ids=["orthographic", "radial"],
)
def test_other_cameras_are_refused(camera):
    with pytest.raises(ValueError, match="camera: expected a pinhole camera"):
        nacre.calibrate_depth([], camera)
    with pytest.raises(ValueError, match="camera: expected a pinhole camera"):
        nacre.DepthCalibration(0.01, 0.001, 9).correct(np.ones((240, 320), np.float32), camera)


def test_an_image_of_another_size_is_refused():
    with pytest.raises(ValueError, match="depth: expected 240 x 320 pixels"):
        nacre.calibrate_depth([(np.ones((4, 5), np.float32), np.eye(4))], CAMERA)


def test_a_pose_that_is_none_is_refused():
    with pytest.raises(ValueError, match="world_from_camera"):
        nacre.calibrate_depth([(np.ones((240, 320), np.float32), np.eye(3))], CAMERA)
