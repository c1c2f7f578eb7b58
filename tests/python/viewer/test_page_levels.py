"""Levels of detail in a real browser: coarse points from afar, all near, and the tools that use them."""

from __future__ import annotations

import io
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import nacre
from nacre.run_data.text import count
from nacre.viewer import Viewer, export_html, read_timeline

sys.path.insert(0, str(Path(__file__).parents[1]))
from browser import Browser
from hills import ORIGIN, hills
from shown_page import IN_A_BROWSER, LOADED
from viewer_scenes import two_looks

pytestmark = IN_A_BROWSER

CLOUD = hills()
SETTLED = "!page.clouds[0].requests && !page.pending"


@pytest.fixture
def shown(browser: Browser, hill: Path, tmp_path: Path) -> Iterator[Browser]:
    """Return the browser with the hills, seen from so far that the root is fine enough."""
    viewer = Viewer(read_timeline(hill), port=0)
    browser.open(viewer.url)
    browser.wait_for(LOADED)
    look_from(browser, 1000.0)
    browser.download_to(tmp_path)
    yield browser
    viewer.close()


def look_from(browser: Browser, distance: float) -> None:
    browser.evaluate(f"page.orbit.distance = {distance}; page.orbit.touched = true; page.draw()")
    browser.wait_for(SETTLED)
    browser.evaluate("page.draw()")
    browser.wait_for(SETTLED)


def num_drawn(browser: Browser) -> int:
    return int(browser.evaluate("page.clouds[0].parts.reduce((sum, cloud) => sum + cloud.size, 0)"))


def picture(browser: Browser) -> np.ndarray:
    image = pytest.importorskip("PIL.Image")
    browser.evaluate("page.draw()")
    return np.asarray(image.open(io.BytesIO(browser.screenshot())).convert("RGB"), dtype=int)


def test_near_there_are_all_points_and_from_afar_few(shown: Browser) -> None:
    assert 0 < num_drawn(shown) < len(CLOUD)
    look_from(shown, 4.0)
    near = num_drawn(shown)
    assert f"of {count(len(CLOUD))} points" in shown.text()
    look_from(shown, 1000.0)
    assert num_drawn(shown) < near
    look_from(shown, 20.0)
    assert shown.evaluate("page.clouds[0].failed") == 0


def test_the_surface_is_closed_and_its_disks_are_as_fine_as_the_points(shown: Browser) -> None:
    look_from(shown, 12.0)
    pixels = picture(shown)
    middle = pixels[200:450, 250:650].reshape(-1, 3)
    background = np.abs(middle - pixels[10, 10]).max(axis=1) < 30  # grey
    grey = np.ptp(middle, axis=1) < 12
    assert np.mean(background & grey) < 0.02
    sizes = shown.evaluate(
        "page.clouds[0].parts.map((cloud) => cloud.sizeUnit * 2 ** (cloud.sizes.at(-1) / 18 - 2))"
    )
    assert max(sizes) < 1.0


def test_what_is_behind_the_eye_is_not_asked_for(shown: Browser) -> None:
    shown.evaluate("page.orbit.turnAbout([0, 0, 5000]); page.orbit.backward = [0, 0, -1]; page.draw()")
    shown.wait_for(SETTLED)
    assert num_drawn(shown) == shown.evaluate("page.clouds[0].root.count")  # the root is never left out


def test_distances_are_those_between_points_of_a_survey(shown: Browser) -> None:
    look_from(shown, 6.0)
    shown.press_button("measure")
    for x in (350, 550):
        shown.click(x, 330)
    (distance,) = shown.evaluate("page.measure.distances")
    ends = np.array(shown.evaluate("page.measure.pairs[0]"))
    origin = np.array(shown.evaluate("page.document.runs[0].origin"))
    found, _ = nacre.KdTree(CLOUD.points - ORIGIN).query(ends + origin - ORIGIN)
    assert found.max() < 1e-5
    assert distance == pytest.approx(np.linalg.norm(ends[0] - ends[1]), abs=1e-9)


def test_a_box_saves_every_point_in_it_with_all_digits(shown: Browser, tmp_path: Path) -> None:
    shown.press_button("crop")
    shown.choose("box-left", 0.0)
    axis = np.array(shown.evaluate("page.crop.box.axes[0]"))
    origin = np.array(shown.evaluate("page.document.runs[0].origin"))
    expected = CLOUD.points[(CLOUD.points - origin) @ axis >= shown.evaluate("page.crop.box.limits[0][0]")]
    assert 0 < len(expected) < len(CLOUD)
    shown.press_button("save")
    end = time.monotonic() + 20
    while not (tmp_path / "hill-copc.ply").exists() and time.monotonic() < end:
        time.sleep(0.05)
    saved = nacre.read_points(tmp_path / "hill-copc.ply")
    assert abs(len(saved) - len(expected)) <= 2  # beside its side, by rounding
    distances, _ = nacre.KdTree(expected - ORIGIN).query(saved.points - ORIGIN)
    assert np.sort(distances)[-3] < 1e-5
    assert saved.colors is not None


def test_parts_that_cannot_be_read_are_told(browser: Browser, hill: Path) -> None:
    viewer = Viewer(read_timeline(hill), port=0)
    levels = viewer.timeline.levels
    assert levels is not None
    read = levels.read

    def damaged(key: tuple[int, int, int, int]) -> object:
        if key[0] > 0:
            raise OSError("gone")
        return read(key)

    levels.read = damaged  # type: ignore[method-assign, assignment]
    try:
        browser.open(viewer.url)
        browser.wait_for(LOADED)
        browser.evaluate("page.orbit.distance = 3; page.orbit.touched = true; page.draw()")
        browser.wait_for("document.body.innerText.includes('cannot be read')")
        assert num_drawn(browser) == browser.evaluate("page.clouds[0].root.count")
    finally:
        viewer.close()


def test_points_that_were_not_needed_for_the_longest_time_are_dropped(shown: Browser) -> None:
    look_from(shown, 4.0)
    near, held = num_drawn(shown), shown.evaluate("page.clouds[0].size")
    look_from(shown, 1000.0)
    shown.evaluate("page.clouds[0].drop(1)")
    assert shown.evaluate("page.clouds[0].size") < held
    look_from(shown, 4.0)
    assert num_drawn(shown) == near


def test_a_model_in_memory_has_its_frames_and_its_mesh(
    browser: Browser, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("nacre.viewer.page_data.MAX_POINTS", 10_000)
    monkeypatch.setattr("nacre.io.octree._LEAF", 1000)
    steps = np.linspace(-0.4, 0.4, 200)
    x, y = np.meshgrid(steps, steps)
    points = np.column_stack([x.ravel(), y.ravel(), np.full(x.size, 1.0)]).astype(np.float32)
    normals = np.broadcast_to(np.float32([0, 0, -1]), points.shape)
    cloud = nacre.viewer.Snapshot(points, normals, 0.004, confidence=np.ones(len(points), np.float32))
    viewer = Viewer(two_looks(cloud), port=0)
    try:
        browser.open(viewer.url)
        browser.wait_for("Boolean(page.clouds[0]?.root) && page.clouds[0].version > 1")
        look_from(browser, 0.5)
        assert f"{count(40_000)} points" in browser.text()
        browser.choose("frame", 0)
        browser.wait_for("!page.clouds[0].root && page.clouds[0].size === 10000")
        browser.choose("frame", 1)
        browser.wait_for("Boolean(page.clouds[0].root)")
        browser.choose("surface", "mesh")
        browser.wait_for("Boolean(page.clouds[0].triangles)")
        browser.choose("surface", "points")
        browser.wait_for("Boolean(page.clouds[0].root)")
    finally:
        viewer.close()


def test_the_exported_page_tells_how_many_points_it_lacks(
    browser: Browser, hill: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("nacre.viewer.saved_timeline._COARSE_POINTS", 10_000)
    export_html(read_timeline(hill), tmp_path / "view.html", triangles=False)
    browser.open((tmp_path / "view.html").as_uri())
    browser.wait_for(LOADED)
    assert f"of {count(len(CLOUD))} points" in browser.text()
    assert browser.evaluate("performance.getEntriesByType('resource').length") == 0
