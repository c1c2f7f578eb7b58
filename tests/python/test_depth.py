"""Depth images: brute-force oracles, simulated edges and noise, illegal input, real sensors."""

import dataclasses
import inspect
import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

import nacre
from nacre import Camera, DepthParameters, NoiseModel, _core
from nacre.io.images import read_depth

WIDTH, HEIGHT = 96, 72
PINHOLE = Camera(width=WIDTH, height=HEIGHT, fx=90, fy=92, cx=47.5, cy=35.5)
RADIAL = Camera(width=WIDTH, height=HEIGHT, fx=90, fy=92, cx=47.5, cy=35.5, depth="radial")
ORTHOGRAPHIC = Camera.orthographic(width=WIDTH, height=HEIGHT, pixel_size=0.002)


def rays(camera):
    """Return origins and directions of all pixels, from the definition of the cameras."""
    v, u = np.mgrid[: camera.height, : camera.width].astype(float)
    zero = np.zeros_like(u)
    if camera.model == "orthographic":
        centre_u, centre_v = (camera.width - 1) / 2, (camera.height - 1) / 2
        x, y = (u - centre_u) * camera.pixel_size, (v - centre_v) * camera.pixel_size
        return np.stack([x, y, zero], axis=-1), np.broadcast_to([0.0, 0.0, 1.0], (*u.shape, 3))
    directions = np.stack([(u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, zero + 1], axis=-1)
    if camera.depth == "radial":
        directions /= np.linalg.norm(directions, axis=-1, keepdims=True)
    return np.zeros_like(directions), directions


def plane_depth(camera, normal, point):
    origins, directions = rays(camera)
    depth = ((np.asarray(point) - origins) @ normal) / (directions @ normal)
    depth[(depth <= 0) | (depth > 20)] = np.nan
    return depth


def ball_before_wall(camera, wall=2.0, subdivision=5):
    """
    Return depth averaged over each pixel's area, as a sensor mixes it, and how far off any surface that is.

    The scene is a ball of 0.2 m radius at 1.2 m before a wall.
    """
    size = (camera.height * subdivision, camera.width * subdivision)
    fine = Camera(
        width=size[1],
        height=size[0],
        fx=camera.fx * subdivision,
        fy=camera.fy * subdivision,
        cx=(camera.cx + 0.5) * subdivision - 0.5,
        cy=(camera.cy + 0.5) * subdivision - 0.5,
    )
    _, directions = rays(fine)
    along, square = directions @ [0.0, 0.0, 1.2], (directions**2).sum(axis=-1)
    discriminant = along**2 - square * (1.2**2 - 0.2**2)
    ball = np.where(discriminant > 0, (along - np.sqrt(np.maximum(discriminant, 0))) / square, np.nan)
    blocks = (camera.height, subdivision, camera.width, subdivision)
    ball = ball.reshape(blocks).swapaxes(1, 2).reshape(camera.height, camera.width, -1)
    depth = np.where(np.isnan(ball), wall, ball).mean(axis=-1)
    on_wall, on_ball = np.isnan(ball).any(axis=-1), ~np.isnan(ball).all(axis=-1)
    nearest, farthest = (
        f(ball, axis=-1, where=~np.isnan(ball), initial=i) for f, i in ((np.min, 9), (np.max, 0))
    )
    off_ball = np.maximum(np.maximum(nearest - depth, depth - farthest), 0)
    off = np.minimum(np.where(on_wall, np.abs(wall - depth), np.inf), np.where(on_ball, off_ball, np.inf))
    return depth, off


# Defaults and parameters


def test_defaults_are_those_of_the_core():
    core = _core.DepthOptions()
    signature = inspect.signature(nacre.preprocess_depth).parameters
    for field in dataclasses.fields(DepthParameters):
        expected = getattr(core, field.name)
        if field.name == "edge_test":
            expected = expected.name
        assert getattr(DepthParameters(), field.name) == expected
        assert signature[field.name].default == expected
    assert {name for name in dir(core) if not name.startswith("_")} == {
        field.name for field in dataclasses.fields(DepthParameters)
    }


def test_noise_model():
    kinect = NoiseModel.kinect()
    assert kinect.sigma(1.4) == pytest.approx(0.0012 + 0.0019)
    np.testing.assert_allclose(kinect.sigma(np.array([0.4, 2.4])), [0.0012, 0.0012 + 4 * 0.0019])
    assert pickle.loads(pickle.dumps(kinect)) == kinect
    assert kinect.to_core().sigma(1.7) == kinect.sigma(1.7)
    assert "constant=0.0012" in repr(kinect)
    with pytest.raises(dataclasses.FrozenInstanceError):
        kinect.constant = 1.0


def test_every_form_of_noise():
    depth = plane_depth(PINHOLE, (0, 0, 1), (0, 0, 1.5))
    depth += np.random.default_rng(0).normal(scale=0.002, size=depth.shape)
    kept = {}
    for noise in (None, 1e-5, np.float32(0.002), "kinect", NoiseModel(0.002)):
        kept[noise] = np.isfinite(nacre.preprocess_depth(depth, PINHOLE, noise=noise, edge_dilation=0)).mean()
    assert kept[NoiseModel(0.002)] == 1
    assert kept["kinect"] == 1
    assert kept[None] > 0.999
    with pytest.raises(
        ValueError, match=r"noise must be a NoiseModel, .*'kinect', 'stereo', 'tof' or None, got 'x'"
    ):
        nacre.preprocess_depth(depth, PINHOLE, noise="x")
    with pytest.raises(TypeError, match="noise must be a NoiseModel"):
        nacre.preprocess_depth(depth, PINHOLE, noise=[1.0])
    with pytest.raises(ValueError, match=r"noise\.constant must be"):
        nacre.preprocess_depth(depth, PINHOLE, noise=-1.0)


# Cleaning

depths = hnp.arrays(
    np.float32,
    hnp.array_shapes(min_dims=2, max_dims=2, max_side=12),
    elements=st.one_of(st.floats(0.5, 3, width=32), st.sampled_from([np.nan, 0, -1, np.inf, -np.inf])),
)


@settings(max_examples=100)
@given(depths, st.sampled_from(["inverse_depth", "gradient", "none"]), st.booleans(), st.integers(0, 2))
def test_what_is_kept_is_untouched_and_counted(depth, edge_test, orthographic, dilation):
    height, width = depth.shape
    if orthographic:
        camera = Camera.orthographic(width=width, height=height, pixel_size=0.01)
    else:
        camera = Camera(width=width, height=height, fx=20, fy=20, cx=width / 2, cy=height / 2)
    before = depth.copy()
    clean, report = nacre.preprocess_depth(
        depth, camera, edge_test=edge_test, edge_dilation=dilation, min_component=3, return_report=True
    )
    np.testing.assert_array_equal(depth, before)
    kept = np.isfinite(clean)
    np.testing.assert_array_equal(clean[kept], depth[kept])
    assert report.num_kept == kept.sum()
    assert report.num_invalid == (~(np.isfinite(depth) & (depth > 0))).sum()
    removed = dataclasses.asdict(report)
    assert removed.pop("num_pixels") == depth.size == sum(removed.values())
    other = nacre.preprocess_depth(
        depth, camera, edge_test=edge_test, edge_dilation=dilation, min_component=3, num_threads=3
    )
    np.testing.assert_array_equal(other, clean)


@settings(max_examples=50)
@given(depths, st.floats(0.001, 0.5), st.integers(0, 2))
def test_gradient_test_against_brute_force(depth, threshold, dilation):
    height, width = depth.shape
    camera = Camera(width=width, height=height, fx=20, fy=20, cx=width / 2, cy=height / 2)
    clean = nacre.preprocess_depth(
        depth,
        camera,
        edge_test="gradient",
        gradient_threshold=threshold,
        edge_dilation=dilation,
        min_component=0,
        max_missing=1.0,
    )
    valid = np.isfinite(depth) & (depth > 0)
    padded = np.pad(np.where(valid, depth.astype(float), np.nan), 1, mode="edge")
    edge = np.zeros(depth.shape, dtype=bool)
    close = np.zeros(depth.shape, dtype=bool)
    kernel = np.array([[-1, 0, 1], [-2, 0, 2], [-1, 0, 1]]) / 8
    for v in range(height):
        for u in range(width):
            window = padded[v : v + 3, u : u + 3]
            gradient = np.hypot((window * kernel).sum(), (window * kernel.T).sum())
            edge[v, u] = not gradient <= threshold
            close[v, u] = abs(gradient - threshold) < 1e-5
    if close.any():
        return
    v, u = np.mgrid[:height, :width]
    for edge_v, edge_u in np.argwhere(edge):
        valid &= np.abs(v - edge_v) + np.abs(u - edge_u) > dilation
    np.testing.assert_array_equal(np.isfinite(clean), valid)


@settings(max_examples=50)
@given(hnp.arrays(bool, (9, 11), elements=st.booleans()), st.integers(1, 30))
def test_speckles_against_brute_force(mask, min_component):
    camera = Camera(width=11, height=9, fx=20, fy=20, cx=5, cy=4)
    depth = np.where(mask, np.float32(1), np.nan)
    clean = nacre.preprocess_depth(
        depth, camera, edge_test="none", max_missing=1.0, min_component=min_component
    )
    expected = np.zeros_like(mask)
    left = {tuple(pixel) for pixel in np.argwhere(mask)}
    while left:
        component, front = set(), [left.pop()]
        while front:
            v, u = front.pop()
            component.add((v, u))
            for neighbour in ((v - 1, u), (v + 1, u), (v, u - 1), (v, u + 1)):
                if neighbour in left:
                    left.remove(neighbour)
                    front.append(neighbour)
        for pixel in component:
            expected[pixel] = len(component) >= min_component
    np.testing.assert_array_equal(np.isfinite(clean), expected)


@settings(max_examples=50)
@given(hnp.arrays(bool, (8, 9), elements=st.booleans()), st.floats(0, 1))
def test_isolated_pixels_against_brute_force(mask, max_missing):
    camera = Camera(width=9, height=8, fx=20, fy=20, cx=4, cy=4)
    depth = np.where(mask, np.float32(1), np.nan)
    clean = nacre.preprocess_depth(depth, camera, edge_test="none", max_missing=max_missing, min_component=0)
    for v, u in np.argwhere(mask):
        window = mask[max(v - 2, 0) : v + 3, max(u - 2, 0) : u + 3]
        missing = (~window).sum()
        assert np.isfinite(clean[v, u]) == (not missing > max_missing * (window.size - 1))


def test_mixed_pixels_go_and_true_ones_stay():
    camera = Camera(width=320, height=240, fx=262, fy=262, cx=159.5, cy=119.5)
    depth, off = ball_before_wall(camera)
    rng = np.random.default_rng(1)
    for sigma in (0.0, 0.0005, 0.003):
        noisy = depth + rng.normal(scale=sigma, size=depth.shape)
        mixed = off > max(3 * sigma, 0.005)
        assert mixed.sum() > 100
        clean, report = nacre.preprocess_depth(noisy, camera, return_report=True)
        assert np.isnan(clean[mixed]).mean() > 0.99
        assert np.isnan(clean[off == 0]).mean() < 0.03
        assert report.num_edge + report.num_slanted > mixed.sum()


def test_mixtures_with_an_unmeasured_background_go():
    camera = Camera(width=320, height=240, fx=262, fy=262, cx=159.5, cy=119.5)
    depth, off = ball_before_wall(camera, wall=8.0)
    depth[depth > 7.9] = np.nan
    mixed = np.isfinite(depth) & (off > 0.005)
    clean = nacre.preprocess_depth(depth, camera)
    assert mixed.sum() > 50
    assert np.isnan(clean[mixed]).mean() > 0.99
    ball = np.isfinite(depth) & (off == 0)
    assert np.isnan(clean[ball]).mean() < 0.2  # the rim is steep; the slope cap takes some of it


def test_a_slight_mixture_at_the_rim_of_a_slanted_surface_goes():
    """It is as far off as if the last pixel looked six pixels aside; at the image's border it may do so."""
    slant = np.radians(52)
    exact = plane_depth(PINHOLE, (-np.sin(slant), 0, -np.cos(slant)), (0, 0, 0.6))
    depth = exact + 0.001 * np.random.default_rng(3).standard_normal(exact.shape)
    rim = slice(10, 60), 60
    depth[rim] += 6 * np.abs(np.diff(exact, axis=1))[rim]
    depth[:, 61:] = np.nan
    clean = nacre.preprocess_depth(depth, PINHOLE)
    assert np.isfinite(clean[rim]).mean() < 0.1
    assert np.isfinite(clean[10:60, 50:60]).mean() > 0.95
    narrow = Camera(width=61, height=HEIGHT, fx=90, fy=92, cx=47.5, cy=35.5)
    assert np.isfinite(nacre.preprocess_depth(depth[:, :61], narrow)[rim]).mean() > 0.9


@pytest.mark.parametrize("camera", [PINHOLE, RADIAL, ORTHOGRAPHIC], ids=["pinhole", "radial", "orthographic"])
def test_slanted_planes_stay_and_the_gradient_test_loses_them(camera):
    slant = np.radians(75 if camera is ORTHOGRAPHIC else 60)
    depth = plane_depth(camera, (0, -np.sin(slant), np.cos(slant)), (0, 0, 1.5))
    noise = NoiseModel(0.0005, 0.0005, 0.4)
    depth += noise.sigma(depth) * np.random.default_rng(2).standard_normal(depth.shape)
    assert np.isfinite(nacre.preprocess_depth(depth, camera)).mean() > 0.99
    assert np.isfinite(nacre.preprocess_depth(depth, camera, edge_test="gradient")).mean() < 0.6


def test_mask_range_and_their_report():
    depth = np.tile(np.linspace(1, 2, WIDTH, dtype=np.float32), (HEIGHT, 1))
    mask = np.zeros((HEIGHT, WIDTH))
    mask[10:60, 20:80] = 0.5
    clean, report = nacre.preprocess_depth(
        depth, PINHOLE, mask=mask, min_depth=1.3, max_depth=1.7, max_missing=1.0, return_report=True
    )
    inside = (depth >= np.float32(1.3)) & (depth <= np.float32(1.7))
    assert report.num_out_of_range == (~inside).sum()
    assert report.num_masked == (inside & (mask == 0)).sum()
    np.testing.assert_array_equal(np.isfinite(clean), inside & (mask > 0))


@pytest.mark.parametrize("dtype", [np.uint16, np.int32, np.uint32, np.float32, np.float64, np.float16])
def test_any_type_and_layout(dtype):
    millimetres = np.round(1000 * plane_depth(PINHOLE, (0, 0.3, 1), (0, 0, 1.5)) / 8) * 8
    millimetres[3:9, 4:12] = 0
    stored = millimetres.astype(dtype)
    reference = nacre.preprocess_depth(stored.astype(np.float32) / 1000, PINHOLE, noise=0.01)
    for image in (stored, np.asfortranarray(stored), np.repeat(stored, 2, axis=1)[:, ::2]):
        clean = nacre.preprocess_depth(image, PINHOLE, depth_scale=1000, noise=0.01)
        assert clean.dtype == np.float32
        assert clean.flags.c_contiguous
        np.testing.assert_allclose(clean, reference, rtol=1e-6)
    swapped = stored.astype(stored.dtype.newbyteorder())
    np.testing.assert_array_equal(
        nacre.preprocess_depth(swapped, PINHOLE, depth_scale=1000, noise=0.01), clean
    )


def test_invalid_codes_of_integer_images():
    stored = np.full((HEIGHT, WIDTH), 1500, dtype=np.uint16)
    stored[:10] = 0
    stored[10:20] = 65535
    _, report = nacre.preprocess_depth(stored, PINHOLE, depth_scale=1000, return_report=True)
    assert report.num_invalid == 20 * WIDTH


@pytest.mark.parametrize("largest", [4.095, 10.0, 1e10])
def test_the_value_for_what_is_too_far_is_no_measurement(largest):
    thing, camera = nacre.built_in_object(), nacre.Camera(160, 120, 190, 190, 79.5, 59.5)
    measured, filled = nacre.Model(camera), nacre.Model(camera)
    for seed, pose in enumerate(nacre.turntable_poses(thing, 3, 0.05, camera=camera, distance=0.3)):
        depth = np.array(thing.simulate_depth(camera, pose, noise=0.0005, seed=seed))
        assert np.isnan(depth).sum() > 1000
        measured.add_frame(depth)
        report = filled.add_frame(np.where(np.isnan(depth), np.float32(largest), depth))
        assert report.status == "TRACKED"
    np.testing.assert_array_equal(filled.points, measured.points)


def test_nothing_in_nothing_out():
    clean, report = nacre.preprocess_depth(np.zeros((HEIGHT, WIDTH)), PINHOLE, return_report=True)
    assert np.isnan(clean).all()
    assert report.num_invalid == report.num_pixels
    assert nacre.back_project(clean, PINHOLE).shape == (0, 3)
    assert np.isnan(nacre.depth_normals(clean, PINHOLE)).all()
    assert nacre.estimate_noise(clean, PINHOLE) == NoiseModel.kinect()


# Illegal input

GOOD = np.ones((HEIGHT, WIDTH))


@pytest.mark.parametrize(
    ("depth", "options", "message"),
    [
        (
            GOOD * 1500,
            {},
            r"got a median of 1500 m: check depth_scale, the stored units per metre \(1000 for mill",
        ),
        (GOOD, {"depth_scale": 5000}, "median of 0.0002 m: check depth_scale"),
        (GOOD, {"depth_scale": 0}, "depth_scale must be a positive number of stored units per metre, got 0"),
        (GOOD, {"depth_scale": np.nan}, "depth_scale must be"),
        (GOOD.T, {}, r"depth must have the camera's size 96 x 72 \(width x height\), got 72 x 96"),
        (GOOD[0], {}, r"depth must have shape \(H, W\), got \(96,\)"),
        (GOOD, {"mask": GOOD[1:]}, r"mask must have the depth image's shape \(72, 96\), got \(71, 96\)"),
        (GOOD, {"edge_test": "sobel"}, "edge_test must be one of .*'inverse_depth'.*, got 'sobel'"),
        (GOOD, {"min_depth": -1}, "min_depth must be a finite number of metres, at least 0, got -1"),
        (GOOD, {"min_depth": 2, "max_depth": 1}, "max_depth must be greater than min_depth, got 1"),
        (GOOD, {"max_depth": np.nan}, "max_depth must be"),
        (
            GOOD,
            {"gradient_threshold": 0},
            "gradient_threshold must be a positive depth step in metres, got 0",
        ),
        (GOOD, {"edge_dilation": -1}, "edge_dilation must be 0 to 100 pixels, got -1"),
        (GOOD, {"edge_sigmas": 0}, "edge_sigmas must be"),
        (GOOD, {"planar_keep_sigmas": -1}, "planar_keep_sigmas must be"),
        (GOOD, {"max_slant": 2}, "max_slant must be an angle between 0 and pi / 2, got 2"),
        (GOOD, {"max_missing": 2}, "max_missing must be a part between 0 and 1, got 2"),
        (GOOD, {"min_component": -1}, "min_component must be a number of pixels, at least 0, got -1"),
    ],
)
def test_wrong_values_are_named(depth, options, message):
    with pytest.raises(ValueError, match=message):
        nacre.preprocess_depth(depth, PINHOLE, **options)


def test_wrong_types_are_named():
    with pytest.raises(TypeError, match="depth must be an array of real numbers"):
        nacre.preprocess_depth(GOOD + 1j, PINHOLE)
    with pytest.raises(TypeError, match=r"edge_dilation must be of type int, got 1\.5"):
        nacre.preprocess_depth(GOOD, PINHOLE, edge_dilation=1.5)
    with pytest.raises(TypeError):
        nacre.preprocess_depth(GOOD, "camera")
    for function in (nacre.back_project, nacre.depth_normals, nacre.estimate_noise):
        with pytest.raises(ValueError, match="depth must have the camera's size 96 x 72"):
            function(GOOD.T, PINHOLE)


# Points and normals


@settings(max_examples=50)
@given(depths, st.booleans(), st.sampled_from(["z", "radial"]))
def test_back_project_against_the_definition(depth, orthographic, kind):
    height, width = depth.shape
    if orthographic:
        camera = Camera.orthographic(width=width, height=height, pixel_size=0.01)
    else:
        camera = Camera(width=width, height=height, fx=20, fy=21, cx=width / 2, cy=height / 3, depth=kind)
    origins, directions = rays(camera)
    valid = np.isfinite(depth) & (depth > 0)
    expected = origins[valid] + depth[valid, np.newaxis].astype(float) * directions[valid]
    points = nacre.back_project(depth, camera)
    assert points.dtype == np.float32
    np.testing.assert_allclose(points, expected, rtol=1e-5, atol=1e-6)
    np.testing.assert_allclose(nacre.back_project(depth * 7, camera, depth_scale=7), points, rtol=1e-5)


@settings(max_examples=40)
@given(
    st.sampled_from([PINHOLE, RADIAL, ORTHOGRAPHIC]),
    st.floats(0, np.radians(40)),
    st.floats(0, 2 * np.pi),
    st.floats(0.3, 3),
)
def test_normals_of_planes(camera, slant, axis, distance):
    normal = np.array([np.sin(slant) * np.cos(axis), np.sin(slant) * np.sin(axis), -np.cos(slant)])
    depth = plane_depth(camera, normal, (0, 0, distance))
    normals = nacre.depth_normals(depth, camera, noise=1e-4)
    assert normals.shape == (HEIGHT, WIDTH, 3)
    assert normals.dtype == np.float32
    found = np.isfinite(normals).all(axis=-1)
    assert found[1:-1, 1:-1].all()
    np.testing.assert_allclose(normals[found] @ normal, 1, atol=1e-4)


def test_normals_against_least_squares():
    rng = np.random.default_rng(3)
    depth = plane_depth(ORTHOGRAPHIC, (0.3, -0.2, -1), (0, 0, 1)) + rng.normal(
        scale=2e-4, size=(HEIGHT, WIDTH)
    )
    depth[rng.random(depth.shape) < 0.2] = np.nan
    normals = nacre.depth_normals(depth, ORTHOGRAPHIC, noise=2e-4)  # 5 x 5 windows, wide gates
    v, u = np.mgrid[-2:3, -2:3] * 0.002
    for y in range(2, HEIGHT - 2, 7):
        for x in range(2, WIDTH - 2, 5):
            window = depth[y - 2 : y + 3, x - 2 : x + 3]
            use = np.isfinite(window)
            if not use[2, 2] or use.sum() < 10:
                continue
            design = np.stack([u[use], v[use], np.ones(use.sum())], axis=1)
            a, b, _ = np.linalg.lstsq(design, window[use], rcond=None)[0]
            expected = np.array([a, b, -1]) / np.sqrt(a * a + b * b + 1)
            np.testing.assert_allclose(normals[y, x], expected, atol=2e-4)


def test_normals_of_a_ball_and_its_edge():
    camera = Camera(width=320, height=240, fx=262, fy=262, cx=159.5, cy=119.5)
    depth, _ = ball_before_wall(camera)
    depth += np.random.default_rng(4).normal(scale=5e-4, size=depth.shape)
    clean = nacre.preprocess_depth(depth, camera)
    normals = nacre.depth_normals(clean, camera)
    points = nacre.back_project(clean, camera)
    valid = np.isfinite(clean)
    assert np.isfinite(normals[valid]).all(axis=-1).mean() > 0.995
    on_ball = points[:, 2] < 1.5
    expected = np.where(on_ball[:, np.newaxis], (points - [0, 0, 1.2]) / 0.2, [0, 0, -1])
    expected /= np.linalg.norm(expected, axis=1, keepdims=True)
    errors = np.degrees(np.arccos(np.clip(np.nansum(normals[valid] * expected, axis=1), -1, 1)))
    errors = errors[np.isfinite(normals[valid]).all(axis=-1)]
    assert np.median(errors) < 2
    assert np.percentile(errors, 99) < 10


def test_results_do_not_depend_on_the_number_of_threads():
    camera = Camera(width=320, height=240, fx=262, fy=262, cx=159.5, cy=119.5)
    depth, _ = ball_before_wall(camera)
    depth += NoiseModel.kinect().sigma(depth) * np.random.default_rng(5).standard_normal(depth.shape)
    for function in (nacre.preprocess_depth, nacre.depth_normals):
        one = function(depth, camera, num_threads=1)
        for num_threads in (2, 5):
            assert function(depth, camera, num_threads=num_threads).tobytes() == one.tobytes()
    one = nacre.estimate_noise(depth, camera, num_threads=1)
    assert nacre.estimate_noise(depth, camera, num_threads=3) == one


# Noise


@pytest.mark.parametrize("scale", [0.1, 0.5, 1.0, 3.0])
def test_noise_of_a_scene_is_found(scale):
    camera = Camera(width=320, height=240, fx=262, fy=262, cx=159.5, cy=119.5)
    depth, _ = ball_before_wall(camera)
    kinect = NoiseModel.kinect()
    depth += scale * kinect.sigma(depth) * np.random.default_rng(6).standard_normal(depth.shape)
    found = nacre.estimate_noise(depth, camera)
    assert found.constant == pytest.approx(scale * kinect.constant, rel=0.15)
    assert found.quadratic == pytest.approx(scale * kinect.quadratic, rel=0.15)
    assert found.offset == kinect.offset


# Real sensors


@pytest.mark.data
@pytest.mark.parametrize(
    ("pattern", "depth_scale", "focal", "sigma", "least"),
    [
        ("tum-fr3-teddy/depth/*.png", 5000, 537, (0.0005, 0.002), 0.92),
        ("tum-fr1-rpy/depth/*.png", 5000, 517, (0.0005, 0.002), 0.92),
        ("redwood-livingroom1/depth/*.png", 1000, 525, (0.00005, 0.001), 0.88),
        ("realsense-turntable-dog/data*/depth_*.png", 1000, 617, (0.0002, 0.001), 0.94),
        ("depth-singles/realsense-felix/*.png", 1000, 617, (0.0002, 0.002), 0.96),
    ],
)
def test_real_frames_keep_their_surfaces(recordings, pattern, depth_scale, focal, sigma, least):
    """Most of a real image is surface: it must stay, with normals, and the noise must be plausible."""
    image = read_depth(sorted(recordings.glob(pattern))[0])
    height, width = image.shape
    camera = Camera(width=width, height=height, fx=focal, fy=focal, cx=width / 2, cy=height / 2)
    clean, report = nacre.preprocess_depth(image, camera, depth_scale=depth_scale, return_report=True)
    assert sigma[0] < nacre.estimate_noise(image, camera, depth_scale=depth_scale).sigma(1.0) < sigma[1]
    assert report.num_kept > least * (report.num_pixels - report.num_invalid)
    normals = nacre.depth_normals(clean, camera)
    assert np.isfinite(normals).all(axis=-1).sum() > 0.99 * report.num_kept
