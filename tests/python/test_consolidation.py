"""consolidate and project_samples against a plain double-precision WLOP, its invariances and its limits."""

import inspect
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import nacre
from nacre import _core

METHODS = ("wlop", "wlop+", "cgal")
DATA = Path(__file__).parents[3] / "shared" / "data"


def sphere(count, radius=0.03, noise=0.0005, seed=0):
    rng = np.random.default_rng(seed)
    directions = rng.normal(size=(count, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    return directions * (radius + noise * rng.normal(size=(count, 1))), directions


def unevenness(points):
    distances = np.linalg.norm(points[:, None] - points[None], axis=2)
    np.fill_diagonal(distances, np.inf)
    nearest = distances.min(axis=1)
    return nearest.std() / nearest.mean()


def plain_wlop(samples, points, h, iterations, mu, method, theta="huang", weights=None, normals=None):
    """The equations, one pair at a time, in double precision."""
    rate = {"huang": 16 / h**2, "printed": 4 / h}[theta] if method != "cgal" else 4 / h**2

    def kernel(r):
        return np.where(r < h, np.exp(-rate * r**2), 0.0)

    def divided(value, r, power, softening):
        return np.where(r > 1e-5 * h, value / np.sqrt(r**2 + softening**2 + (r == 0)) ** power, 0.0)

    def distances(a, b):
        return np.linalg.norm(a[:, None] - b[None], axis=2)

    def mean(w, rows):
        return w @ rows / w.sum()

    softening = 0.02 * h if method == "wlop+" else 0.0
    alone = 2 if method == "cgal" else 0
    count = np.ones(len(points)) if weights is None else weights
    density = kernel(distances(points, points)) @ count if method != "cgal" else np.ones(len(points))
    x = samples.copy()
    known_normals = None if normals is None else normals.copy()
    for iteration in range(iterations):
        r, s = distances(x, points), distances(x, x)
        alpha = kernel(r) * (count / density)
        if method == "cgal":
            alpha[r < 1e-5 * h] = 0
        elif iteration > 0:
            alpha /= np.sqrt(r**2 + max(softening, 1e-6 * h) ** 2)
        w = kernel(s).sum(axis=1) + (method == "cgal")
        beta = kernel(s) * w
        np.fill_diagonal(beta, 0)
        beta = divided(beta, s, 2 if method == "cgal" else 1, softening)
        if method == "wlop+" and known_normals is None:
            known_normals = np.empty_like(x)
            for i, a in enumerate(alpha):
                offsets = points - mean(a, points)
                known_normals[i] = np.linalg.eigh((offsets * a[:, None]).T @ offsets)[1][:, 0]
        moved = x.copy()
        for i in range(len(x)):
            if not (r[i] < h).any():
                continue
            step = mean(alpha[i], points) - x[i] if alpha[i].any() else np.zeros(3)
            if beta[i].sum() > 0 and (s[i] < h).sum() - 1 >= alone:
                floor = 0.1 / h if method == "wlop+" else 0.0
                away = beta[i] @ (x[i] - x) / max(beta[i].sum(), floor)
                if method == "wlop+":
                    away -= known_normals[i] * (known_normals[i] @ away)
                step += mu * away
            length = np.linalg.norm(step)
            if method == "wlop+" and length > 0.25 * h:
                step *= 0.25 * h / length
            moved[i] = x[i] + step
        x = moved
    return x


@pytest.mark.parametrize("iterations", [1, 2, 5])
@pytest.mark.parametrize(
    ("method", "theta"), [("wlop", "huang"), ("wlop+", "huang"), ("cgal", "huang"), ("wlop", "printed")]
)
def test_equals_the_equations(method, theta, iterations):
    h, mu = 0.008, 0.3
    points, _ = sphere(900)
    samples = points[:120].astype(np.float32).astype(float)
    truth = plain_wlop(samples, points, h, iterations, mu, method, theta)
    moved = nacre.project_samples(
        samples, points, radius=h, iterations=iterations, mu=mu, method=method, theta=theta
    )
    # Where theta is printed it ends in a step at h, which rounding may put on either side of a pair.
    tolerance = 2e-5 * h if theta == "huang" else 0.02 * h
    assert np.abs(moved - truth).max() < tolerance
    assert np.abs(moved - samples).max() > 0.05 * h


def test_equals_the_equations_with_weights_and_normals():
    h = 0.008
    points, _ = sphere(900)
    rng = np.random.default_rng(3)
    weights = rng.uniform(0.2, 5.0, len(points))
    normals = rng.normal(size=(100, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    truth = plain_wlop(points[:100], points, h, 4, 0.4, "wlop+", weights=weights, normals=normals)
    moved = nacre.project_samples(
        points[:100],
        points,
        radius=h,
        iterations=4,
        method="wlop+",
        point_weights=weights,
        sample_normals=5 * normals,
    )
    assert np.abs(moved - truth).max() < 2e-5 * h


def test_consolidate_is_projection_of_its_sources():
    points, _ = sphere(2000)
    thin = nacre.consolidate(points, num_points=300, iterations=4, seed=5)
    moved = nacre.project_samples(points[thin.sources], points, iterations=4)
    np.testing.assert_array_equal(thin.points, moved)
    assert len(thin) == 300
    assert (np.diff(thin.sources) > 0).all()


@pytest.mark.parametrize("method", ["wlop+", "cgal"])
def test_noise_falls_and_evenness_grows(method):
    points, _ = sphere(6000, radius=0.04)
    thin = nacre.consolidate(
        points, num_points=600, radius=0.016 if method == "wlop+" else 0.008, method=method
    )
    heights = np.linalg.norm(thin.points, axis=1) - 0.04
    assert np.sqrt((heights**2).mean()) < 0.0003
    assert abs(heights.mean()) < 0.00025
    assert unevenness(thin.points) < 0.25 < unevenness(points[thin.sources])


@pytest.mark.parametrize("method", METHODS)
def test_same_bits_for_any_number_of_threads(method):
    points, normals = sphere(3000)
    one, *others = (
        nacre.consolidate(
            points, num_points=400, method=method, attributes={"normals": normals}, num_threads=threads
        )
        for threads in (1, 2, 5, 0)
    )
    for other in others:
        assert other.points.tobytes() == one.points.tobytes()
        assert other.attributes["normals"].tobytes() == one.attributes["normals"].tobytes()
        np.testing.assert_array_equal(other.sources, one.sources)


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 10**6), st.sampled_from(METHODS))
def test_moves_with_the_points(seed, method):
    rng = np.random.default_rng(seed)
    points, _ = sphere(2000, seed=seed)
    rotation, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    shift = rng.uniform(-1, 1, 3)
    order = rng.permutation(len(points))
    options = {"radius": 0.02, "iterations": 2, "method": method}
    moved = nacre.project_samples(points[:50], points, **options)
    turned = nacre.project_samples(
        points[:50] @ rotation.T + shift, points[order] @ rotation.T + shift, **options
    )
    np.testing.assert_allclose(turned, moved @ rotation.T + shift, atol=5e-5 * 0.02)


@settings(max_examples=50, deadline=None)
@given(
    st.integers(0, 40),
    st.sampled_from(METHODS),
    st.integers(0, 10**6),
    st.sampled_from([1e-6, 1e-3, 1.0, 1e6]),
    st.booleans(),
)
def test_any_input_gives_finite_points(count, method, seed, unit, coarse):
    rng = np.random.default_rng(seed)
    points = rng.uniform(-2, 2, (count, 3))
    if coarse:
        points = np.round(points)
    if count > 3:
        points[0] = np.nan
        points[1, 1] = np.inf
    thin = nacre.consolidate(points * unit, radius=unit, num_points=10, method=method, num_threads=1)
    assert len(thin.points) == min(10, np.isfinite(points).all(axis=1).sum())
    assert np.isfinite(thin.points).all()
    assert np.isfinite(points[thin.sources]).all()


@pytest.mark.parametrize("dtype", [np.float16, np.float32, np.float64, np.int32, np.uint8])
def test_any_dtype_and_layout(dtype):
    rng = np.random.default_rng(1)
    points = rng.integers(0, 60, (400, 3)).astype(dtype)
    options = {"radius": 15.0, "num_points": 50, "method": "wlop+"}
    thin = nacre.consolidate(points, **options)
    assert thin.points.dtype == (np.float32 if dtype == np.float32 else np.float64)
    padded = np.full((800, 6), 7, dtype=dtype)
    padded[::2, ::2] = points
    for same in (np.asfortranarray(points), padded[::2, ::2], points.tolist()):
        np.testing.assert_allclose(nacre.consolidate(same, **options).points, thin.points, atol=1e-4)


@pytest.mark.parametrize("theta", ["huang", "printed"])
@pytest.mark.parametrize("method", ["wlop", "wlop+", "cgal"])
def test_finite_points_stay_finite_or_are_refused(method, theta):
    points = np.random.default_rng(4).uniform(-1, 1, (60, 3))
    refused = []
    for size in 10.0 ** np.arange(0, 271, 15):
        for radius in (1e-12, 1.0, 1e12):
            options = {"radius": radius, "method": method, "theta": theta, "iterations": 3}
            try:
                assert np.isfinite(nacre.consolidate(size * points, **options).points).all()
                assert np.isfinite(nacre.project_samples(size * points[:9], size * points, **options)).all()
            except ValueError:
                refused.append(size / radius)
    assert min(refused) > 1e29


def test_far_away_coordinates_keep_their_digits():
    points, _ = sphere(2000)
    shift = np.array([4.4e6, -1.2e6, 3.3e3])
    near = nacre.consolidate(points, num_points=200, iterations=2)
    far = nacre.consolidate(points + shift, num_points=200, iterations=2)
    np.testing.assert_allclose(far.points - shift, near.points, atol=1e-7)
    moved = nacre.project_samples(points[:9] + shift, points + shift, iterations=2)
    np.testing.assert_allclose(
        moved - shift, nacre.project_samples(points[:9], points, iterations=2), atol=1e-7
    )


def test_the_callers_arrays_are_untouched():
    points, normals = sphere(500)
    points[3] = np.nan
    arrays = {
        "points": points.astype(np.float32),
        "normals": normals,
        "color": np.arange(500, dtype=np.uint8),
    }
    before = {name: array.tobytes() for name, array in arrays.items()}
    for array in arrays.values():
        array.flags.writeable = False
    thin = nacre.consolidate(
        arrays["points"],
        num_points=500,
        attributes={"normals": arrays["normals"], "color": arrays["color"]},
        iterations=0,
    )
    nacre.project_samples(arrays["points"], arrays["points"], method="wlop+", sample_normals=normals)
    assert {name: array.tobytes() for name, array in arrays.items()} == before
    assert not np.shares_memory(thin.points, arrays["points"])
    assert not np.shares_memory(thin.attributes["normals"], normals)


def test_attributes_keep_dtype_and_shape():
    points, normals = sphere(3000)
    rng = np.random.default_rng(0)
    attributes = {
        "normals": normals.astype(np.float32),
        "color": rng.integers(0, 256, (3000, 3), dtype=np.uint8),
        "time": 1.7e9 + points[:, 0],
        "ring": rng.integers(0, 5, 3000),
        "edge": points[:, 2] > 0,
        "half": rng.uniform(size=(3000, 1)).astype(np.float16),
        "nothing": np.zeros((3000, 0)),
    }
    thin = nacre.consolidate(points, num_points=300, attributes=attributes, iterations=5)
    for name, value in attributes.items():
        assert thin.attributes[name].dtype == value.dtype
        assert thin.attributes[name].shape == (300, *value.shape[1:])
    np.testing.assert_allclose(np.linalg.norm(thin.attributes["normals"], axis=1), 1, atol=1e-6)
    radial = thin.points / np.linalg.norm(thin.points, axis=1, keepdims=True)
    assert (radial * thin.attributes["normals"]).sum(axis=1).min() > 0.99
    np.testing.assert_allclose(thin.attributes["time"] - 1.7e9, thin.points[:, 0], atol=0.004)
    assert (thin.attributes["edge"] == (thin.points[:, 2] > 0)).mean() > 0.95
    assert repr(thin).startswith(
        "Consolidated(300 points float64, normals float32[300, 3], color uint8[300, 3]"
    )


def test_attributes_are_means_with_the_weights_of_the_positions():
    points, _ = sphere(1500)
    thin = nacre.consolidate(points, num_points=100, mu=0.0, attributes=points)
    np.testing.assert_allclose(thin.attributes["attributes"], thin.points, atol=1e-7)
    constant = nacre.consolidate(points, num_points=100, attributes={"a": np.full(1500, 0.1)})
    np.testing.assert_allclose(constant.attributes["a"], 0.1, rtol=1e-12)


def test_attributes_leave_out_what_is_not_finite():
    points = np.array([[0.0, 0, 0], [0.001, 0, 0], [0, 0.001, 0], [1, 1, 1]])
    values = np.array([np.nan, 4.0, np.inf, np.nan])
    thin = nacre.consolidate(points, radius=0.008, attributes={"a": values})
    np.testing.assert_array_equal(thin.attributes["a"], [4, 4, 4, np.nan])


def test_integers_are_rounded_and_stay_in_range():
    points, _ = sphere(500)
    attributes = {
        "high": np.full(500, np.iinfo(np.uint64).max, dtype=np.uint64),
        "low": np.full(500, np.iinfo(np.int64).min, dtype=np.int64),
        "mixed": np.arange(500, dtype=np.int16) % 2 * 3,
    }
    thin = nacre.consolidate(points, num_points=50, attributes=attributes)
    assert (thin.attributes["high"] >= np.uint64(2**64 - 2**12)).all()
    assert (thin.attributes["low"] == np.iinfo(np.int64).min).all()
    assert set(thin.attributes["mixed"].tolist()) <= {0, 1, 2, 3}


def test_normals_that_cancel_stay_those_of_the_source():
    points = np.array([[0.0, 0, 0], [0.001, 0, 0]])
    normals = np.array([[0.0, 0, 1], [0, 0, -1]])
    thin = nacre.consolidate(np.repeat(points, 1, axis=0), attributes={"normals": normals}, iterations=0)
    np.testing.assert_array_equal(thin.attributes["normals"], normals)
    middle = nacre.consolidate(points, attributes={"normals": normals}, iterations=1)
    np.testing.assert_allclose(np.linalg.norm(middle.attributes["normals"], axis=1), 1)


def test_num_points_none_takes_every_finite_point():
    points, _ = sphere(100)
    points[4] = np.nan
    thin = nacre.consolidate(points, num_points=None)
    np.testing.assert_array_equal(thin.sources, np.delete(np.arange(100), 4))


@pytest.mark.parametrize("points", [np.zeros((0, 3)), np.full((5, 3), np.nan)])
@pytest.mark.parametrize("method", METHODS)
def test_nothing_gives_nothing(points, method):
    rows = len(points)
    attributes = {
        "normals": np.zeros((rows, 3)),
        "color": np.zeros((rows, 3), dtype=np.uint8),
        "t": np.zeros(rows),
    }
    thin = nacre.consolidate(points, method=method, attributes=attributes, num_points=None)
    assert thin.points.shape == (0, 3)
    assert thin.attributes["color"].shape == (0, 3)
    assert thin.attributes["t"].shape == (0,)
    assert nacre.project_samples(points, points, method=method).shape == points.shape


def test_frozen_samples_stay():
    points, _ = sphere(800)
    frozen = np.arange(80) % 2 == 0
    moved = nacre.project_samples(
        points[:80].astype(np.float32), points, method="wlop+", iterations=3, frozen=frozen
    )
    stays = (moved == points[:80].astype(np.float32)).all(axis=1)
    np.testing.assert_array_equal(stays, frozen)


def test_defaults_equal_the_cores():
    core = _core.ConsolidateOptions()
    for function in (nacre.consolidate, nacre.project_samples):
        for name, parameter in inspect.signature(function).parameters.items():
            if hasattr(core, name) and name != "radius":  # by default from the points
                default = getattr(core, name)
                assert parameter.default == getattr(default, "name", default), name
    named = set(inspect.signature(nacre.consolidate).parameters) - {"points", "attributes", "progress"}
    assert named == {name for name in dir(core) if not name.startswith("_")} - {"check"}


@pytest.mark.parametrize(
    ("change", "error", "message"),
    [
        ({"radius": 0.0}, ValueError, "radius must be .* got 0"),
        ({"radius": float("nan")}, ValueError, "radius must be .* got nan"),
        ({"radius": "8 mm"}, TypeError, "radius must be a number"),
        ({"num_points": 0}, ValueError, "num_points must be .*at least 1, got 0"),
        ({"num_points": 2.5}, TypeError, "num_points must be an integer, got 2.5"),
        ({"iterations": -1}, ValueError, "iterations must be .*at least 0, got -1"),
        ({"iterations": 10.0}, TypeError, "iterations must be an integer, got 10.0"),
        ({"mu": 0.51}, ValueError, "mu must be from 0 to 0.5, got 0.51"),
        ({"mu": -0.1}, ValueError, "mu must be"),
        ({"method": "lop"}, ValueError, r"method must be one of 'wlop', 'wlop\+', 'cgal', got 'lop'"),
        ({"theta": None}, ValueError, "theta must be one of 'huang', 'printed', got None"),
        ({"seed": -1}, ValueError, "seed must be .*at least 0, got -1"),
        ({"seed": 1.0}, TypeError, "seed must be an integer"),
        ({"num_threads": -2}, ValueError, "num_threads must be .*at least 0, got -2"),
        ({"points": np.zeros((4, 2))}, ValueError, r"points must have shape \(N, 3\), got \(4, 2\)"),
        ({"points": np.zeros((4, 3), dtype=complex)}, TypeError, "points must be an array of real numbers"),
        ({"attributes": {"a": np.zeros(3)}}, ValueError, r"attributes\['a'\] must have one row per point"),
        ({"attributes": np.zeros((4, 3, 3))}, ValueError, "attributes.* must have one row per point"),
        ({"attributes": {"a": ["x"] * 4}}, TypeError, r"attributes\['a'\] must be an array of real"),
        (
            {"attributes": {"normals": np.zeros((4, 2))}},
            ValueError,
            r"attributes\['normals'\] must be floating",
        ),
        ({"attributes": {"normals": np.zeros((4, 3), dtype=int)}}, ValueError, "must be floating"),
    ],
)
def test_misuse_of_consolidate(change, error, message):
    arguments = {"points": np.zeros((4, 3)), "radius": 0.008} | change
    with pytest.raises(error, match=message):
        nacre.consolidate(arguments.pop("points"), **arguments)


@pytest.mark.parametrize(
    ("change", "error", "message"),
    [
        ({"samples": np.zeros(3)}, ValueError, r"samples must have shape \(N, 3\)"),
        ({"point_weights": np.ones(3)}, ValueError, r"point_weights must have shape \(4,\), got \(3,\)"),
        ({"point_weights": np.full(4, -1.0)}, ValueError, "point_weights must be finite and not negative"),
        ({"point_weights": np.full(4, np.nan)}, ValueError, "point_weights must be finite and not negative"),
        (
            {"sample_normals": np.ones((3, 3))},
            ValueError,
            "sample_normals must have one row per point of samples",
        ),
        ({"frozen": np.ones(5)}, ValueError, r"frozen must have shape \(2,\), got \(5,\)"),
        ({"frozen": np.ones(2), "method": "wlop"}, ValueError, "hints must be empty unless"),
    ],
)
def test_misuse_of_project_samples(change, error, message):
    arguments = {"samples": np.zeros((2, 3)), "points": np.zeros((4, 3)), "radius": 1.0, "method": "wlop+"}
    arguments |= change
    with pytest.raises(error, match=message):
        nacre.project_samples(arguments.pop("samples"), arguments.pop("points"), **arguments)


def test_the_default_radius_is_that_of_the_documented_equation():
    points, _ = sphere(3000)
    r = np.median(nacre.KdTree(points).query(points, 17)[0][:, -1])
    expected = 2.5 * r * np.sqrt(np.pi * 3000 / (17 * 500))
    thin = nacre.consolidate(points, num_points=500)
    assert thin.radius == pytest.approx(expected, rel=1e-12)
    given = nacre.consolidate(points, num_points=500, radius=thin.radius)
    np.testing.assert_array_equal(thin.points, given.points)
    assert thin == given


@pytest.mark.parametrize("unit", [1e-3, 1.0, 1e3])
def test_the_default_radius_follows_the_unit(unit):
    points, _ = sphere(2000)
    radius = nacre.consolidate(points, num_points=300, iterations=0).radius
    assert nacre.consolidate(unit * points, num_points=300, iterations=0).radius == pytest.approx(
        unit * radius
    )


@pytest.mark.parametrize("method", METHODS)
def test_the_default_spreads_and_denoises_a_box_of_any_size(method):
    rng = np.random.default_rng(0)
    box = np.column_stack([rng.uniform(size=(6000, 2)), 0.01 * rng.normal(size=6000)])  # a noisy side
    thin = nacre.consolidate(box, num_points=400, method=method)
    left = np.abs(thin.points[:, 2]).mean() / np.abs(box[:, 2]).mean()
    assert left < (0.9 if method == "wlop" else 0.5)  # which draws a sample to the point that it starts on
    assert unevenness(thin.points) < 0.6 * unevenness(box[thin.sources])
    moved = nacre.project_samples(box[thin.sources], box, method=method)
    np.testing.assert_allclose(moved, thin.points, atol=1e-6)


@pytest.mark.parametrize(
    ("points", "where"), [(np.ones((50, 3)), "on top of each other"), (1e300 * np.eye(3), "too far from")]
)
def test_where_no_radius_can_be_told_it_must_be_given(points, where):
    with pytest.raises(ValueError, match=f"radius must be given, got None: the points lie {where}"):
        nacre.consolidate(points)
    with pytest.raises(ValueError, match=f"radius must be given, got None: the points lie {where}"):
        nacre.project_samples(points, points)


def test_a_single_point_stays_without_a_radius():
    np.testing.assert_array_equal(nacre.consolidate([[1.0, 2, 3]]).points, [[1, 2, 3]])


def test_the_result_is_taken_for_its_points(tmp_path):
    points, normals = sphere(500)
    thin = nacre.consolidate(points, num_points=50, attributes={"normals": normals, "height": points[:, 2]})
    np.testing.assert_array_equal(np.asarray(thin), thin.points)
    nacre.write_points(tmp_path / "thin.ply", thin)
    written = nacre.read_points(tmp_path / "thin.ply")
    np.testing.assert_array_equal(written.normals, thin.attributes["normals"])
    np.testing.assert_array_equal(written.attributes["height"], thin.attributes["height"])


@pytest.mark.data
@pytest.mark.parametrize("method", ["wlop+", "cgal"])
def test_real_cloud_becomes_even(method):
    path = DATA / "cgal" / "points_3" / "kitten.xyz"
    if not path.exists():
        pytest.skip("the recordings in ../shared/data are not here")
    data = np.loadtxt(path)
    points, normals = data[:, :3], data[:, 3:6]
    spacing = np.sqrt(1.2 / 800)
    thin = nacre.consolidate(
        points, radius=3 * spacing, num_points=800, method=method, attributes={"normals": normals}
    )
    assert unevenness(thin.points) < 0.6 * unevenness(points[thin.sources])
    nearest = np.linalg.norm(thin.points[:, None] - points[None], axis=2).min(axis=1)
    assert np.median(nearest) < 0.3 * spacing
