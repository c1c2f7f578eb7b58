"""The systematic error of depth that overlapping views give away."""

import dataclasses
import json
import math

import numpy as np
import pytest
from boxes import boxes

import nacre

CAMERA = nacre.Camera(width=320, height=240, fx=260, fy=260, cx=159.5, cy=119.5)
CAMERA_SHAPE = (CAMERA.height, CAMERA.width)
SIDE = ((np.arange(320) - 159.5) / 260)[None, :]
DOWN = ((np.arange(240) - 119.5) / 260)[:, None]


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
    advice = found.camera_advice(camera)
    assert f"fx {camera.fx * found.focal_scale:.0f} " in advice


@pytest.mark.parametrize("factor", [0.97, 1.0, 1.03])
def test_a_focal_length_that_is_about_right_is_no_cause_for_advice(room, factor):
    depths, poses = room
    camera = nacre.Camera(width=320, height=240, fx=260 * factor, fy=260 * factor, cx=159.5, cy=119.5)
    found = nacre.calibrate_depth(zip(depths, poses, strict=True), camera)
    assert not found.has_wrong_focal_length
    assert found.camera_advice(camera) == ""


def test_a_wrong_focal_length_is_told_once_by_a_reconstruction(room, caplog):
    depths, _ = room
    camera = nacre.Camera(width=320, height=240, fx=234, fy=234, cx=159.5, cy=119.5)
    frames = [nacre.SequenceFrame(i, depth, camera, None, None, None) for i, depth in enumerate(depths)]
    with caplog.at_level("WARNING", logger="nacre"):
        done = nacre.reconstruct(frames)
    assert done.depth_calibration.focal_scale == pytest.approx(1 / 0.9, abs=0.01)
    assert len([record for record in caplog.records if "focal length is wrong" in record.message]) == 1


@pytest.mark.parametrize("factor", [0.9, 1.0, 1.1])
def test_depth_along_the_rays_that_is_given_as_depth_along_the_axis_is_told(room, factor):
    depths, poses = room
    camera = nacre.Camera(width=320, height=240, fx=260 * factor, fy=260 * factor, cx=159.5, cy=119.5)
    lengths = [depth * np.sqrt(1 + SIDE**2 + DOWN**2) for depth in depths]
    found = nacre.calibrate_depth(zip(lengths, poses, strict=True), camera)
    assert found.has_radial_depth
    assert found.radial == pytest.approx(1.0, abs=0.01 if factor == 1.0 else 0.2)
    assert found.focal_scale * factor == pytest.approx(1.0, abs=0.01)
    assert "depth='radial'" in found.camera_advice(camera)


@pytest.mark.parametrize("tilt", [0.0, 0.02])
def test_depth_along_the_axis_is_not_taken_for_depth_along_the_rays(room, tilt):
    depths, poses = room
    tilted = [depth / (1.0 + tilt * SIDE * depth) for depth in depths]
    found = nacre.calibrate_depth(zip(tilted, poses, strict=True), CAMERA)
    assert not found.has_radial_depth
    assert found.radial == pytest.approx(0.0, abs=0.02)
    assert found.camera_advice(CAMERA) == ""


def test_depth_that_is_wrong_by_a_factor_shows_in_nothing(room):
    """The whole scene is larger."""
    depths, poses = room
    larger = []
    for matrix in poses:
        larger.append(matrix.copy())
        larger[-1][:3, 3] *= 1.25
    right = nacre.calibrate_depth(zip(depths, poses, strict=True), CAMERA)
    found = nacre.calibrate_depth(zip((1.25 * d for d in depths), larger, strict=True), CAMERA)
    assert found.focal_scale == pytest.approx(right.focal_scale, abs=1e-3)
    assert not found.is_significant


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


@pytest.fixture(scope="module")
def wrong(room):
    """The same views, tilted."""
    return [(depth / (1.0 + 0.01 * SIDE * depth)).astype(np.float32) for depth in room[0]]


def grown(depths, poses=None, **changes):
    """A model of these frames; the first pose given, where poses are."""
    model = nacre.Model(CAMERA, **changes)
    for i, depth in enumerate(depths):
        first = poses is not None and i == 0
        model.add_frame(depth, guess=poses[0] if first else None, keep_guess=first)
    return model


@pytest.fixture(scope="module")
def corrected(room, wrong):
    return grown(wrong, room[1])


def test_a_model_corrects_what_it_finds(room, wrong, corrected):
    """Points and poses that were there are moved: the surface lies where that of right depth does."""
    depths, poses = room
    assert corrected.corrects_depth
    assert corrected.depth_calibration.tilt == pytest.approx(0.01, rel=0.1)
    left = grown(wrong, poses, calibrate_depth=False)
    assert left.depth_calibration is None
    assert not left.corrects_depth
    right = nacre.KdTree(grown(depths, poses).points)
    off = {name: np.median(right.query(m.points, 1)[0]) for name, m in (("left", left), ("moved", corrected))}
    assert off["moved"] < 0.5 * off["left"]
    errors = {
        name: np.linalg.norm(m.poses[:, :3, 3] - np.array(poses)[:, :3, 3], axis=1).max()
        for name, m in (("left", left), ("moved", corrected))
    }
    assert errors["moved"] < 0.5 * errors["left"]


def test_later_frames_say_that_they_corrected_earlier_ones(corrected):
    assert next(i for i, frame in enumerate(corrected.frames) if frame.corrects_earlier) == 5
    assert {frame.status for frame in corrected.frames} == {"TRACKED"}


def test_what_is_known_of_a_camera_can_be_given(room, wrong, corrected):
    """It is the same as right depth, and there is nothing left to correct."""
    known = grown(wrong, room[1], depth=nacre.DepthParameters(tilt=0.01))
    assert not known.corrects_depth
    assert known.depth_calibration.tilt == pytest.approx(0.01, rel=0.1)
    right = grown(room[0], room[1])
    assert len(known) == pytest.approx(len(right), rel=0.01)
    np.testing.assert_allclose(known.poses[:, :3, 3], right.poses[:, :3, 3], atol=2e-3)


def test_cleaning_takes_a_tilt_away(room, wrong):
    clean = nacre.preprocess_depth(wrong[0], CAMERA, tilt=0.01, noise="kinect")
    right = nacre.preprocess_depth(room[0][0], CAMERA, noise="kinect")
    both = np.isfinite(clean) & np.isfinite(right)
    assert both.sum() > 0.99 * np.isfinite(right).sum()
    np.testing.assert_allclose(clean[both], right[both], rtol=1e-5)
    labels = nacre.label_pixels(wrong[0], CAMERA, nacre.DepthParameters(tilt=0.01, noise="kinect"))
    np.testing.assert_array_equal(labels == 0, np.isfinite(clean))


def test_good_depth_is_left_alone(room):
    depths, poses = room
    model = grown(depths, poses)
    assert not model.depth_calibration.is_significant
    assert not model.corrects_depth
    same = grown(depths, poses, calibrate_depth=False)
    np.testing.assert_array_equal(model.points, same.points)


def test_any_number_of_threads_corrects_to_the_same_bits(room, wrong, corrected):
    other = grown(wrong, room[1], num_threads=3)
    np.testing.assert_array_equal(other.points, corrected.points)
    np.testing.assert_array_equal(other.poses, corrected.poses)


def test_noise_as_large_as_the_relief_is_no_tilt():
    """A thing that turns before a stereo camera: a tilt and turns that are too small would fit each other."""
    camera = nacre.Camera(width=320, height=240, fx=192, fy=192, cx=159.5, cy=119.5)
    thing = nacre.built_in_object()
    size = 1.7 / np.ptp(thing.vertices, axis=0).max()
    thing = nacre.Mesh(size * np.asarray(thing.vertices), thing.triangles)
    poses = nacre.turntable_poses(thing, 24, distance=2.2)[:12]
    views = [(thing.simulate_depth(camera, p, sensor="stereo", seed=i), p) for i, p in enumerate(poses)]
    assert nacre.calibrate_depth(views, camera).num_pairs == 0


@pytest.mark.parametrize("before", [3, 7])
def test_a_saved_model_goes_on_to_the_same_bits(room, wrong, corrected, tmp_path, before):
    """Before the first correction, and after it."""
    grown(wrong[:before], room[1]).save(tmp_path / "model")
    model = nacre.Model.load(tmp_path / "model")
    for depth in wrong[before:]:
        model.add_frame(depth)
    np.testing.assert_array_equal(model.points, corrected.points)
    assert model.depth_calibration == corrected.depth_calibration
    assert model.corrects_depth


def test_what_a_mask_leaves_out_does_not_count(room, wrong):
    """Something that moves with the camera, over a third of the image."""
    shown = np.ones(CAMERA_SHAPE, bool)
    shown[:, :100] = False
    model = nacre.Model(CAMERA)
    for i, (depth, matrix) in enumerate(zip(wrong, room[1], strict=True)):
        covered = np.where(shown, depth, np.float32(0.6))
        model.add_frame(covered, mask=shown, guess=matrix, keep_guess=i == 0)
    assert model.depth_calibration.is_significant
    assert model.depth_calibration.tilt == pytest.approx(0.01, rel=0.15)


def test_reconstruct_tells_what_it_corrected(wrong, tmp_path):
    nacre.write_recording(tmp_path / "recording", CAMERA, wrong, depth_scale=5000)
    report = reconstruct(tmp_path / "recording", tmp_path / "out")
    assert "its inverse is tilted by 0.0" in (tmp_path / "out" / "report.html").read_text()
    done = nacre.reconstruct(tmp_path / "recording")
    assert report["depth_calibration"] == {**dataclasses.asdict(done.depth_calibration), "used": True}
    assert done.depth_calibration.tilt == pytest.approx(0.01, rel=0.1)
    written = nacre.read_points(tmp_path / "out" / "model.ply")
    np.testing.assert_array_equal(written.points, done.cloud.points)
    assert reconstruct(tmp_path / "recording", tmp_path / "o", "--no-calibrate")["depth_calibration"] is None


@pytest.mark.parametrize(
    ("camera", "changes"),
    [
        (nacre.Camera.orthographic(320, 240, 0.01), {}),
        (nacre.Camera(320, 240, 260, 260, 159.5, 119.5, depth="radial"), {}),
        (CAMERA, {"region": {"object": True}}),
        (CAMERA, {"preset": "paper"}),
    ],
)
def test_a_model_that_does_not_see_one_scene_calibrates_nothing(camera, changes):
    assert nacre.Model(camera, **changes).depth_calibration is None


@pytest.mark.parametrize(
    "camera",
    [
        nacre.Camera.orthographic(320, 240, 0.01),
        nacre.Camera(320, 240, 260, 260, 159.5, 119.5, depth="radial"),
    ],
)
def test_other_cameras_have_no_tilt(camera):
    with pytest.raises(ValueError, match=r"tilt must be 0 unless the camera is a pinhole"):
        nacre.Model(camera, depth={"tilt": 0.01})
    with pytest.raises(ValueError, match="pinhole camera with depth along its axis"):
        nacre.preprocess_depth(np.ones((240, 320), np.float32), camera, tilt=0.01)


@pytest.mark.parametrize("tilt", [math.nan, math.inf])
def test_a_tilt_is_finite(tilt):
    with pytest.raises(ValueError, match="tilt must be a finite number"):
        nacre.Model(CAMERA, depth={"tilt": tilt})


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
    assert nacre.DepthCalibration(0.003, 0.0001, 20).is_significant
    assert not nacre.DepthCalibration(0.001, 0.0001, 20).is_significant
    assert not nacre.DepthCalibration(0.003, 0.001, 20).is_significant


@pytest.mark.parametrize(("num_pairs", "quantile"), [(9, 67.2), (21, 11.32), (45, 6.95), (10**6, 5.0)])
def test_few_pairs_must_be_surer(num_pairs, quantile):
    """Student's t of (pairs - 1) / 2 degrees of freedom, where a Gaussian's tail begins at five sigma."""
    assert nacre.DepthCalibration(1.02 * quantile, 1.0, num_pairs).is_significant
    assert not nacre.DepthCalibration(0.95 * quantile, 1.0, num_pairs).is_significant
    assert not nacre.DepthCalibration(1e3, 1e-3, 1).is_significant


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
