"""Noise models of sensors, and measuring them from images: white noise, noise that pixels share, labels."""

from __future__ import annotations

import numpy as np
import pytest

import nacre
from nacre import Camera, NoiseModel

PINHOLE = Camera(320, 240, 300.0, 300.0, 159.5, 119.5)
ORTHOGRAPHIC = Camera.orthographic(width=200, height=160, pixel_size=0.001)


def slanted_wall(camera: Camera, near: float, far: float) -> np.ndarray:
    """Return a plane from near at the left to far at the right: affine in inverse depth."""
    inverse = np.linspace(1 / near, 1 / far, camera.width)
    return np.tile(1 / inverse, (camera.height, 1)).astype(np.float64)


def smooth_noise(shape: tuple[int, int], rng: np.random.Generator, width: float) -> np.ndarray:
    """Return noise of variance 1 with the correlation exp(-(d / width)^2): blurred white noise."""
    from math import sqrt

    reach = np.arange(-12, 13)
    kernel = np.exp(-2 * (reach / width) ** 2)
    kernel /= sqrt((kernel**2).sum())
    noise = rng.standard_normal((shape[0] + 24, shape[1] + 24))
    for axis in (0, 1):
        noise = np.apply_along_axis(np.convolve, axis, noise, kernel, "valid")
    return noise


class TestModels:
    def test_stereo_grows_with_the_square_of_depth(self):
        noise = NoiseModel.stereo(600.0, baseline=0.1, disparity_sigma=0.25)
        assert noise.sigma(1.0) == pytest.approx(0.25 / 60)  # dz = z^2 / (f b) dd
        assert noise.sigma(3.0) == pytest.approx(9 * noise.sigma(1.0))

    def test_time_of_flight_is_the_published_curve(self):
        z = np.linspace(0.5, 4, 9)
        expected = 1e-3 * (1.5 - 0.5 * z + 0.3 * z**2)
        np.testing.assert_allclose(NoiseModel.time_of_flight().sigma(z), expected, rtol=1e-12)

    @pytest.mark.parametrize("name", ["kinect", "stereo", "tof"])
    def test_a_name_stands_for_the_model(self, name):
        model = {
            "kinect": NoiseModel.kinect(),
            "stereo": NoiseModel.stereo(PINHOLE.fx),
            "tof": NoiseModel.time_of_flight(),
        }[name]
        depth = slanted_wall(PINHOLE, 1.0, 2.0)
        depth += 0.002 * np.random.default_rng(1).standard_normal(depth.shape)
        named, given = (nacre.preprocess_depth(depth, PINHOLE, noise=noise) for noise in (name, model))
        np.testing.assert_array_equal(named, given)
        parameters = nacre.Model(PINHOLE, **{"depth.noise": name}).parameters
        assert parameters.depth.noise == model

    def test_auto_is_to_measure(self):
        assert nacre.Model(PINHOLE, **{"depth.noise": "auto"}).parameters.depth.noise is None

    def test_stereo_needs_a_focal_length(self):
        with pytest.raises(
            ValueError, match=r"noise='stereo' needs a pinhole camera, got Camera.orthographic"
        ):
            nacre.preprocess_depth(np.ones((160, 200)), ORTHOGRAPHIC, noise="stereo")
        with pytest.raises(ValueError, match="fx must be a focal length in pixels, got -1"):
            NoiseModel.stereo(-1.0)
        with pytest.raises(ValueError, match=r"noise\.shared must be a part from 0 to below 1, got 1"):
            nacre.preprocess_depth(np.ones((240, 320)), PINHOLE, noise=NoiseModel(0.001, shared=1.0))

    def test_what_is_shared_is_not_local(self):
        noise = NoiseModel(0.001, 0.002, 0.3, shared=0.8)
        assert noise.local().shared == 0
        assert 0.4 < noise.local().sigma(2.0) / noise.sigma(2.0) < 0.6
        assert NoiseModel(0.001).local() == NoiseModel(0.001)


class TestMeasuring:
    def test_independent_noise_shares_nothing(self):
        depth = np.full((160, 200), 0.5)
        depth += 0.0007 * np.random.default_rng(2).standard_normal(depth.shape)
        noise = nacre.estimate_noise(depth, ORTHOGRAPHIC)
        assert noise.shared < 0.1
        assert noise.sigma(0.5) == pytest.approx(0.0007, rel=0.08)

    def test_smooth_noise_is_not_missed(self):
        rng = np.random.default_rng(3)
        depth = np.full((160, 200), 0.5) + 0.0006 * smooth_noise((160, 200), rng, 3.3)
        depth += 0.0003 * rng.standard_normal(depth.shape)
        noise = nacre.estimate_noise(depth, ORTHOGRAPHIC)
        total = np.hypot(0.0006, 0.0003)
        assert 0.7 * total < noise.sigma(0.5) < 1.05 * total  # cautious: curvature looks alike
        assert noise.local().sigma(0.5) < 0.6 * total  # what fits to windows see
        assert noise.shared == pytest.approx(0.7, abs=0.15)

    def test_calibration_finds_the_curve_over_depth(self):
        # Six times as noisy at the far end by time of flight's curve as by one scale of the Kinect's.
        truth = NoiseModel.time_of_flight()
        rng = np.random.default_rng(4)
        wall = slanted_wall(PINHOLE, 0.8, 4.0)
        images = [wall + truth.sigma(wall) * rng.standard_normal(wall.shape) for _ in range(4)]
        found = nacre.calibrate_noise(images, PINHOLE)
        one_scale = nacre.estimate_noise(images[0], PINHOLE)
        z = np.linspace(0.9, 3.6, 7)
        error = np.abs(np.log(found.sigma(z) / truth.sigma(z))).max()
        assert error < 0.5 * np.abs(np.log(one_scale.sigma(z) / truth.sigma(z))).max()
        assert error < np.log(1.35)

    @pytest.mark.parametrize("near", [0.07, 0.2, 0.5])
    def test_calibration_finds_noise_that_grows_from_the_camera_on(self, near):
        truth = NoiseModel.stereo(300.0, baseline=0.018, disparity_sigma=0.05 * 0.07 / near)
        rng = np.random.default_rng(8)
        wall = slanted_wall(PINHOLE, near, 7 * near)
        images = [wall + truth.sigma(wall) * rng.standard_normal(wall.shape) for _ in range(4)]
        found = nacre.calibrate_noise(images, PINHOLE)
        z = np.linspace(1.5 * near, 6 * near, 7)
        assert found.offset == 0
        assert np.abs(np.log(found.sigma(z) / truth.sigma(z))).max() < np.log(1.35)

    def test_calibration_finds_the_kinects_law(self):
        truth = NoiseModel.kinect()
        rng = np.random.default_rng(9)
        wall = slanted_wall(PINHOLE, 0.8, 4.0)
        images = [wall + truth.sigma(wall) * rng.standard_normal(wall.shape) for _ in range(4)]
        assert nacre.calibrate_noise(images, PINHOLE).offset == truth.offset

    def test_calibration_of_nothing_is_the_prior(self):
        assert nacre.calibrate_noise([], PINHOLE) == NoiseModel.kinect()
        assert nacre.calibrate_noise([], ORTHOGRAPHIC).constant == pytest.approx(0.0001)

    def test_calibration_does_not_depend_on_threads(self):
        rng = np.random.default_rng(5)
        wall = slanted_wall(PINHOLE, 0.8, 3.0)
        images = [wall + 0.003 * rng.standard_normal(wall.shape) for _ in range(3)]
        one = nacre.calibrate_noise(images, PINHOLE, num_threads=1)
        assert nacre.calibrate_noise(images, PINHOLE, num_threads=3) == one

    def test_calibration_refuses_another_size(self):
        with pytest.raises(ValueError, match="depth must have the camera's size 320 x 240"):
            nacre.calibrate_noise([np.ones((10, 10))], PINHOLE)

    def test_a_model_pools_its_frames(self):
        rng = np.random.default_rng(6)
        u, v = np.meshgrid(np.arange(200), np.arange(160))
        shape = 0.5 + 0.01 * np.sin(u / 15) * np.cos(v / 11)
        images = [shape + 0.0005 * rng.standard_normal(shape.shape) for _ in range(3)]
        model = nacre.Model(ORTHOGRAPHIC)
        for image in images:
            model.add_frame(image)
        assert model.noise == nacre.calibrate_noise([np.float32(image) for image in images], ORTHOGRAPHIC)
        assert nacre.Model(ORTHOGRAPHIC, **{"depth.noise": 0.002}).noise == NoiseModel(0.002)


class TestLabels:
    @pytest.mark.parametrize("edge_test", ["inverse_depth", "gradient", "none"])
    def test_labels_count_up_to_the_report(self, edge_test):
        mesh = nacre.built_in_object()
        camera = nacre.default_camera(mesh)
        pose = nacre.turntable_poses(mesh, 1, camera=camera)[0]
        depth = mesh.simulate_depth(camera, pose, noise=0.001, edge_mixing=1.0, dropout=0.02)
        mask = np.ones(depth.shape, np.uint8)
        mask[:, : camera.width // 3] = 0
        far = float(np.nanquantile(depth, 0.9))
        clean, report = nacre.preprocess_depth(
            depth, camera, mask=mask, max_depth=far, edge_test=edge_test, return_report=True
        )
        parameters = nacre.DepthParameters(max_depth=far, edge_test=edge_test)
        labels = nacre.label_pixels(depth, camera, parameters, mask=mask)
        counts = dict(zip(nacre.PIXEL_LABELS, np.bincount(labels.ravel(), minlength=7).tolist(), strict=True))
        assert counts == {name: getattr(report, f"num_{name}") for name in nacre.PIXEL_LABELS}
        np.testing.assert_array_equal(labels == 0, np.isfinite(clean))
        assert counts["masked"] > 0
        assert counts["out_of_range"] > 0
        assert (counts["edge"] > 0) == (edge_test != "none")

    def test_labels_do_not_depend_on_threads(self):
        depth = slanted_wall(PINHOLE, 0.8, 3.0)
        depth[:, 100:] += 0.5
        one = nacre.label_pixels(depth, PINHOLE, num_threads=1)
        np.testing.assert_array_equal(nacre.label_pixels(depth, PINHOLE, num_threads=3), one)
