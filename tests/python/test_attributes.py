"""Attributes: whatever pixels have besides depth and colour, fused along with the points."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import nacre

Array = npt.NDArray[Any]

FLAT = nacre.Camera.orthographic(width=100, height=80, pixel_size=0.001)
V, U = np.indices((80, 100))
X, Y = (U - 49.5) * 0.001, (V - 39.5) * 0.001


def relief() -> Array:
    waves = np.sin(140 * X + 1) * np.cos(110 * Y) + 0.6 * np.sin(90 * Y + 60 * X)
    return 0.3 + 0.006 * waves + 0.1 * X


def grown(frames: list[dict[str, Any]], colors: list[Array] | None = None, **options: Any) -> nacre.Model:
    """Return a model of frames from one place, each with its attributes."""
    model = nacre.Model(FLAT, **options)
    for i, attributes in enumerate(frames):
        color = None if colors is None else colors[i]
        model.add_frame(relief(), color, attributes=attributes, guess=np.eye(4), keep_guess=True)
    return model


def test_a_linear_attribute_is_found_where_it_is() -> None:
    """Measured: within 0.4 % of its range; a symmetric window averages a linear field to itself."""
    model = grown([{"temperature": 20 + 100 * X}] * 3)
    values = model.attributes["temperature"]
    assert values.dtype == np.float32
    assert values.shape == (len(model),)
    x = model.points[:, 0]
    inside = np.abs(x) < 0.045
    assert np.abs(values - (20 + 100 * x))[inside].max() < 0.05


def test_channels_are_fused_as_colours_are() -> None:
    rng = np.random.default_rng(0)
    colors = [rng.integers(0, 256, (80, 100, 3), dtype=np.uint8) for _ in range(4)]
    model = grown([{"same": color, "one": color[..., 1]} for color in colors], colors)
    assert model.attributes["same"].shape == (len(model), 3)
    assert model.colors is not None
    # Colours are rounded; those of a new point are averaged before its normal is.
    difference = np.abs(model.attributes["same"] - model.colors)
    assert difference.max() < 1
    assert np.mean(difference > 0.51) < 0.02  # colours are rounded
    np.testing.assert_allclose(model.attributes["one"], model.attributes["same"][:, 1], rtol=1e-5)


def test_five_channels() -> None:
    images = np.stack([100 * X + i for i in range(5)], axis=-1)
    values = grown([{"classes": images}]).attributes["classes"]
    assert values.shape[1] == 5
    np.testing.assert_allclose(np.diff(values, axis=1), 1, atol=1e-4)


def test_noise_is_averaged() -> None:
    rng = np.random.default_rng(1)
    one = grown([{"noisy": rng.normal(5, 1, (80, 100))}]).attributes["noisy"]
    many = grown([{"noisy": rng.normal(5, 1, (80, 100))} for _ in range(9)]).attributes["noisy"]
    assert many.mean() == pytest.approx(5, abs=0.05)
    assert many.std() < 0.5 * one.std()


def test_pixels_without_a_value_do_not_count() -> None:
    image = np.where(X < 0, np.nan, 7.0)
    model = grown([{"partial": image}] * 2)
    values, x = model.attributes["partial"], model.points[:, 0]
    assert np.isnan(values[x < -0.005]).all()
    np.testing.assert_allclose(values[x > 0.005], 7, rtol=1e-5)
    np.testing.assert_allclose(values[np.isfinite(values)], 7, rtol=1e-5)


def test_an_attribute_that_comes_late_or_seldom() -> None:
    model = grown([{}, {"late": np.full((80, 100), 3.0)}, {}, {"other": X}])
    assert set(model.attributes) == {"late", "other"}
    np.testing.assert_allclose(model.attributes["late"], 3, rtol=1e-6)


def test_attributes_do_not_change_the_points() -> None:
    plain, with_more = grown([{}] * 3), grown([{"a": X, "b": np.dstack([X, Y])}] * 3)
    np.testing.assert_array_equal(plain.points, with_more.points)
    np.testing.assert_array_equal(plain.confidence, with_more.confidence)
    assert plain.attributes == {}


def test_attributes_stay_with_their_points_when_the_model_is_thinned() -> None:
    model = grown([{"x": X, "xy": np.dstack([X, Y])}] * 2, max_points=500)
    assert len(model) <= 500
    inside = (np.abs(model.points[:, 0]) < 0.045) & (np.abs(model.points[:, 1]) < 0.035)
    np.testing.assert_allclose(model.attributes["x"][inside], model.points[inside, 0], atol=3e-4)
    np.testing.assert_allclose(model.attributes["xy"][inside], model.points[inside, :2], atol=3e-4)


def test_the_number_of_threads_changes_nothing() -> None:
    rng = np.random.default_rng(2)
    frames = [{"a": rng.normal(size=(80, 100)), "b": rng.normal(size=(80, 100, 2))} for _ in range(3)]
    one, many = grown(frames, num_threads=1), grown(frames, num_threads=4)
    for name in ("a", "b"):
        np.testing.assert_array_equal(one.attributes[name], many.attributes[name])


@pytest.mark.parametrize(
    ("attributes", "error", "message"),
    [
        (
            {"a": np.zeros((3, 4))},
            ValueError,
            r"attributes\['a'\] must have the depth image's shape \(80, 100\)",
        ),
        ({"a": np.zeros((80, 100, 0))}, ValueError, r"attributes\['a'\] must have"),
        ({"a": np.zeros((80, 100, 1, 1))}, ValueError, r"attributes\['a'\] must have"),
        ({"a": np.full((80, 100), "x")}, TypeError, r"attributes\['a'\] must be an array of real numbers"),
        ({3: np.zeros((80, 100))}, TypeError, "attributes must be named by words, got 3"),
        ({"known": np.zeros((80, 100, 2))}, ValueError, r"attributes\['known'\] must be of as many channels"),
    ],
)
def test_illegal_attributes(attributes: Any, error: type[Exception], message: str) -> None:
    model = grown([{"known": X}])
    with pytest.raises(error, match=message):
        model.add_frame(relief(), attributes=attributes)
    assert len(model.frames) == 1


def test_attributes_of_a_recording_end_in_the_point_file(tmp_path: Path) -> None:
    pytest.importorskip("typer")
    pytest.importorskip("PIL")
    from nacre.cli import main

    folder, heat, out = tmp_path / "recording", tmp_path / "heat", tmp_path / "out"
    nacre.write_recording(folder, FLAT, [relief()] * 2, depth_scale=10000)
    infrared = folder / "attributes" / "infrared"
    for place in (infrared, heat):
        place.mkdir(parents=True)
    for i in range(2):
        np.save(infrared / f"{i:06d}.npy", (1000 + 1e4 * X).astype(np.uint16))
        np.save(heat / f"{i:06d}.npy", np.dstack([X, Y]).astype(np.float32))
    frame = nacre.open_sequence(folder)[0]
    assert frame.attributes["infrared"].shape == (80, 100)
    with pytest.raises(SystemExit) as stopped:
        main(["reconstruct", str(folder), "-o", str(out), "--quiet", "--attribute", f"heat={heat}"])
    assert stopped.value.code == 0
    assert json.loads((out / "report.json").read_text())["num_tracked"] == 2
    cloud = nacre.read_points(out / "model.ply")
    inside = np.abs(cloud.points[:, 0]) < 0.04
    np.testing.assert_allclose(
        cloud.attributes["infrared"][inside], 1000 + 1e4 * cloud.points[inside, 0], atol=5
    )
    np.testing.assert_allclose(cloud.attributes["heat"][inside, 0], cloud.points[inside, 0], atol=3e-4)


def test_a_folder_of_other_images_is_refused(tmp_path: Path) -> None:
    nacre.write_recording(tmp_path / "recording", FLAT, [relief()], depth_scale=10000)
    with pytest.raises(nacre.FileFormatError, match="no image here is named as a depth image"):
        nacre.open_sequence(tmp_path / "recording").with_attribute("heat", tmp_path)
