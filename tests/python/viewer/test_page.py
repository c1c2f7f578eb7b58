"""The page in a real browser: its tools find what is known of the scene, with a server and without."""

from __future__ import annotations

import math
import re
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import nacre
import nacre.viewer
from nacre.report import ReportedFrame
from nacre.run_data.text import count, quantity
from nacre.viewer import Timeline, Viewer, export_html

sys.path.insert(0, str(Path(__file__).parents[1]))
from browser import Browser
from shown_page import IN_A_BROWSER, LOADED, color_at, look_along_the_normal, on_plane
from viewer_scenes import CAMERA, SPACING, plane, two_looks

pytestmark = IN_A_BROWSER


def num_shown(browser: Browser) -> int:
    return int(browser.evaluate("page.clouds[0].numShown"))


def saved_points(browser: Browser, folder: Path) -> nacre.Cloud:
    """Save the points of the plane that are shown, and read them."""
    browser.press_button("save")
    end = time.monotonic() + 10
    while not (folder / "plane.ply").exists() and time.monotonic() < end:
        time.sleep(0.05)
    return nacre.read_points(folder / "plane.ply")


def test_it_begins_with_the_colored_model_in_the_middle(exported: Browser) -> None:
    assert exported.evaluate("page.kind") == "colour"
    assert "2 frames: 2 tracked" in exported.text()
    width, height = (
        exported.evaluate("page.canvas.clientWidth"),
        exported.evaluate("page.canvas.clientHeight"),
    )
    red, green, blue = color_at(exported, width / 2, height / 2)
    assert red > 2 * max(green, blue)
    assert max(np.ptp(color_at(exported, 20, 20)), 0) < 60  # the background is grey
    assert exported.evaluate("performance.getEntriesByType('resource').length") == 0  # no network


def test_numbers_are_as_in_the_report(exported: Browser) -> None:
    script = Path(nacre.viewer.__file__).with_name("web").joinpath("linear.js").read_text(encoding="utf-8")
    for value in (0, 999, 1000, 12345, 1234567):
        assert exported.evaluate(f"(() => {{ {script}; return countText({value}) }})()") == count(value)
    for metres in (0.0123, 0.999, 1.0, 4.25):
        text = exported.evaluate(f"(() => {{ {script}; return lengthText({metres}) }})()")
        assert text.split()[1] == quantity(metres, "m").split()[1]


def test_the_distance_between_two_points_that_were_picked(exported: Browser) -> None:
    look_along_the_normal(exported)
    exported.press_button("measure")
    for x in (-0.03, 0.05):
        exported.click(*on_plane(exported, x + 0.002, 0.002))  # a little beside the point
    assert exported.evaluate("page.measure.distances.length") == 1
    assert exported.evaluate("page.measure.distances[0]") == pytest.approx(0.08, abs=1e-5)
    exported.wait_for("document.getElementById('overlay').textContent === '80.0 mm'")
    assert exported.evaluate("document.getElementById('distances').textContent") == "80.0 mm"
    exported.press_button("clear")
    exported.wait_for("!document.body.innerText.includes('80.0 mm')")


def test_a_click_beside_the_model_picks_nothing(exported: Browser) -> None:
    look_along_the_normal(exported)
    exported.press_button("measure")
    exported.click(*on_plane(exported, 0.15, 0))
    assert exported.evaluate("page.measure.pairs.length") == 0


def test_a_drag_turns_the_model_and_is_no_click(exported: Browser) -> None:
    look_along_the_normal(exported)
    exported.press_button("measure")
    point = on_plane(exported, 0.02, 0.03)
    exported.drag(point, (point[0] + 100, point[1]), point)  # and back, to where a click would pick
    assert exported.evaluate("page.measure.pairs.length") == 0
    exported.drag((300, 300), (400, 320))
    assert abs(exported.evaluate("page.orbit.backward[0]")) > 0.1
    exported.press_button("reset")
    assert exported.evaluate("page.orbit.touched") is False


def test_surfaces_are_seen_from_behind_on_demand(exported: Browser) -> None:
    exported.evaluate(
        "page.orbit.touched = true; page.orbit.backward = [0, 0, 1]; page.orbit.up = [0, -1, 0]; page.draw()"
    )
    middle = [exported.evaluate(f"page.canvas.client{side} / 2") for side in ("Width", "Height")]
    assert np.ptp(color_at(exported, *middle)) < 60
    assert exported.evaluate(f"page.pointAt({middle[0]}, {middle[1]})") is None
    exported.press_button("reverse")
    red, green, _ = color_at(exported, *middle)
    assert red > 2 * green
    assert exported.evaluate(f"page.pointAt({middle[0]}, {middle[1]})") is not None


def test_a_box_keeps_what_is_in_it_and_saves_it(exported: Browser, tmp_path: Path) -> None:
    exported.press_button("crop")
    assert num_shown(exported) == 441
    axis = np.array(exported.evaluate("page.crop.box.axes[0]"))
    exported.choose("box-left", 0.0)
    limit = exported.evaluate("page.crop.box.limits[0][0]")
    expected = int((plane().points @ axis >= limit).sum())
    assert 0 < expected < 441
    assert num_shown(exported) == expected
    assert f"{expected} of 441 points" in exported.text()
    saved = saved_points(exported, tmp_path)
    assert len(saved.points) == expected
    assert np.min(saved.points @ axis) >= limit - 1e-5
    np.testing.assert_allclose(saved.normals, plane().normals[:expected], atol=0.01)
    assert saved.comments == ("metres; the world is the first camera's frame",)
    assert saved.colors is not None
    assert saved.colors.tolist() == [[200, 40, 40]] * expected
    rows = np.rint((saved.points[:, :2] / SPACING) + 10).astype(int)
    np.testing.assert_allclose(saved.attributes["confidence"], 1 + rows[:, 0] + 21 * rows[:, 1])


def test_the_box_is_upright_where_the_first_view_is_from_above(browser: Browser, tmp_path: Path) -> None:
    floor = plane()
    floor = replace(
        floor,
        points=np.ascontiguousarray(floor.points[:, [0, 2, 1]]),  # 1 m below who looks
        normals=np.broadcast_to(np.array([0, -1, 0], np.float32), floor.points.shape),
    )
    timeline = Timeline("floor", None)
    timeline.set_snapshot(floor)
    export_html(timeline, tmp_path / "view.html")
    browser.open((tmp_path / "view.html").as_uri())
    browser.wait_for(LOADED)
    np.testing.assert_allclose(browser.evaluate("page.orbit.backward"), [0, -(0.75**0.5), -0.5], atol=1e-5)
    browser.press_button("crop")
    np.testing.assert_allclose(
        browser.evaluate("page.crop.box.axes"), [[1, 0, 0], [0, -1, 0], [0, 0, -1]], atol=1e-5
    )
    browser.choose("box-bottom", -0.999)
    assert num_shown(browser) == 0  # the floor goes at once
    browser.choose("box-bottom", -1.001)
    assert num_shown(browser) == 441
    browser.choose("box-front", 0.0)
    assert num_shown(browser) == 231


def test_points_of_large_uncertainty_are_hidden(browser: Browser, tmp_path: Path) -> None:
    sigma = np.arange(1, 442) / 10_000
    export_html(two_looks(replace(plane(), sigma=sigma)), tmp_path / "view.html")
    browser.open((tmp_path / "view.html").as_uri())
    browser.wait_for(LOADED)
    for share, told in ((5, "2.30 mm"), (30, "13.3 mm"), (90, "39.7 mm")):
        browser.choose("uncertainty", share)
        assert num_shown(browser) == 1 + 440 * share // 100
        assert browser.evaluate("document.getElementById('uncertainty-value').textContent") == told
    browser.download_to(tmp_path)
    np.testing.assert_allclose(
        np.sort(saved_points(browser, tmp_path).attributes["sigma"]), sigma[:397], rtol=3e-4
    )
    browser.choose("uncertainty", 100)
    assert num_shown(browser) == 441
    browser.choose("kind", "uncertainty")
    assert re.search(r"standard deviation .*\s+0\.98\d mm\s+43\.\d mm", browser.text())


def test_without_uncertainties_there_is_no_such_tool(exported: Browser) -> None:
    assert exported.evaluate("document.getElementById('uncertainty-row').hidden")
    assert not exported.evaluate("page.clouds[0].kinds.includes('uncertainty')")


def test_the_mesh_closes_the_gaps_between_points(exported: Browser) -> None:
    look_along_the_normal(exported)
    exported.choose("size", 0.3)
    exported.evaluate("document.getElementById('path').click()")
    gap = on_plane(exported, 0.045, 0.045)
    assert np.ptp(color_at(exported, *gap)) < 60
    exported.choose("surface", "mesh")
    exported.wait_for("page.clouds[0].triangles")
    cloud = plane()
    assert exported.evaluate("page.clouds[0].triangles.length") == 3 * len(
        nacre.meshing.triangulate(cloud.points, cloud.normals)
    )
    red, green, _ = color_at(exported, *gap)
    assert red > 2 * green


def test_holes_are_outlined(browser: Browser, tmp_path: Path) -> None:
    whole = plane()
    cloud = whole.rows(np.flatnonzero(np.abs(whole.points[:, :2]).max(axis=1) > 4.5 * SPACING), SPACING)
    export_html(two_looks(cloud), tmp_path / "view.html")
    browser.open((tmp_path / "view.html").as_uri())
    browser.wait_for(LOADED)
    look_along_the_normal(browser)
    for control in ("reverse", "holes"):  # so that nothing hides the lines
        browser.press_button(control)
    browser.wait_for("page.holes.lines(0)")
    assert "1 hole, the largest 100.0 mm" in browser.text()
    x, y = on_plane(browser, 0.05, 0.0)
    browser.evaluate("page.draw()")
    beside = [color_at(browser, x + i, y) for i in range(-4, 5)]
    assert any(red > 200 and green < 120 and blue > 150 for red, green, blue in beside)
    browser.press_button("holes")
    assert browser.evaluate("page.holes.lines(0)") is None


def test_the_model_grows_frame_by_frame(exported: Browser) -> None:
    exported.choose("frame", 0)
    exported.wait_for("page.clouds[0].numShown === 126")
    assert "frame 0, TRACKED" in exported.text()
    exported.press_button("play")
    exported.wait_for("page.player.place === 1 && page.clouds[0].numShown === 441", 12)


@pytest.mark.parametrize("has_frames", [True, False])
def test_two_runs_2_mm_apart(browser: Browser, tmp_path: Path, has_frames: bool) -> None:
    first, second = two_looks(plane(), "first"), two_looks(plane(1.002), "second")
    if not has_frames:  # a file of points
        second.frames.clear()
    export_html(first, tmp_path / "view.html", other=second)
    browser.open((tmp_path / "view.html").as_uri())
    browser.wait_for(LOADED)
    assert browser.evaluate("page.kind") == "deviation"
    assert browser.evaluate("page.parts.length") == 2
    text = browser.text()
    for run in ("first", "second"):
        assert f"{run}: median 2.00 mm, 95 % below 2.00 mm" in text
    counts = browser.evaluate("page.deviation.figures(page.clouds[0]).counts")
    assert sum(counts) == max(counts) == 441
    browser.choose("layout", "1")
    assert browser.evaluate("page.parts.length") == 1
    assert browser.evaluate("page.activeRun") == 1


def test_runs_that_are_nearly_equal_do_not_deviate(browser: Browser, tmp_path: Path) -> None:
    first, second = two_looks(plane(), "first"), two_looks(plane(1 + 2e-7), "second")
    export_html(first, tmp_path / "view.html", other=second)
    browser.open((tmp_path / "view.html").as_uri())
    browser.wait_for(LOADED)
    assert browser.evaluate("document.getElementById('scale-value').textContent") == "1.00 mm"
    assert "first: median 0.000 mm, 95 % below 0.000 mm" in browser.text()
    counts = browser.evaluate("page.deviation.figures(page.clouds[0]).counts")
    assert counts[0] == sum(counts) == 441


def test_halves_show_all_that_the_whole_shows(browser: Browser, tmp_path: Path) -> None:
    export_html(two_looks(plane(), "first"), tmp_path / "view.html", other=two_looks(plane(), "second"))
    browser.open((tmp_path / "view.html").as_uri())
    browser.wait_for(LOADED)
    half = browser.evaluate("page.orbit.distance")
    aspect = browser.evaluate("page.canvas.clientWidth / page.canvas.clientHeight / 2")
    radius = browser.evaluate("page.document.view.radius")
    assert half * math.sin(math.atan(aspect * math.tan(0.35))) == pytest.approx(radius)
    browser.choose("layout", "0")
    assert browser.evaluate("page.orbit.distance") < half
    browser.evaluate("page.orbit.turn(20, 0)")
    turned = browser.evaluate("page.orbit.distance")
    browser.choose("layout", "both")
    assert browser.evaluate("page.orbit.distance") == turned  # where a hand has put it


def test_no_word_of_holes_while_they_are_off(browser: Browser, tmp_path: Path) -> None:
    export_html(two_looks(plane(), "first"), tmp_path / "view.html", other=two_looks(plane(), "second"))
    browser.open((tmp_path / "view.html").as_uri())
    browser.wait_for(LOADED)
    words = "document.getElementById('holes-count').textContent"
    assert browser.evaluate(words) == ""
    browser.press_button("holes")
    browser.wait_for(f"{words} === 'no holes and no holes'")
    browser.choose("layout", "0")
    browser.wait_for(f"{words} === 'no holes'")


def test_points_are_where_they_were_to_half_a_step(exported: Browser) -> None:
    found = np.array(exported.evaluate("Array.from({length: 441}, (_, i) => page.clouds[0].position(i))"))
    expected = plane().points
    order = np.lexsort(np.round(found, 4).T)
    np.testing.assert_allclose(found[order], expected[np.lexsort(np.round(expected, 4).T)], atol=2e-6)
    normals = np.array(exported.evaluate("Array.from(page.clouds[0].normals)")).reshape(-1, 4)
    np.testing.assert_array_equal(normals[:, :3], np.broadcast_to((0, 0, -127), (441, 3)))


def test_a_served_page_follows_the_run(browser: Browser) -> None:
    timeline = two_looks(plane())
    timeline.depth_of = lambda index: np.full((100, 100), 1.0, np.float32)
    viewer = Viewer(timeline, port=0)
    try:
        browser.open(viewer.url)
        browser.wait_for(LOADED)
        assert "frame 1, TRACKED" in browser.text()
        browser.wait_for("document.getElementById('depth').naturalWidth > 50")
        timeline.add(ReportedFrame(2, "LOST", reason="no overlap"))
        grown = plane()
        timeline.set_snapshot(grown.rows(slice(0, 400), SPACING))
        viewer.refresh()
        browser.wait_for("document.body.innerText.includes('frame 2, LOST: no overlap')")
        browser.wait_for("page.clouds[0].size === 400")
        browser.choose("frame", 1)
        browser.wait_for("page.clouds[0].size === 441")
        viewer.refresh()
        time.sleep(1.2)
        assert browser.evaluate("page.player.place") == 1  # where a hand has put it
    finally:
        viewer.close()


@pytest.mark.parametrize("goes_on", [True, False])
def test_a_path_is_drawn_where_the_camera_goes_on(browser: Browser, tmp_path: Path, goes_on: bool) -> None:
    timeline = Timeline("plane", CAMERA)
    for index in range(20):
        pose = np.eye(4)
        pose[0, 3] = 0.01 * (index if goes_on else index % 2)
        timeline.add(ReportedFrame(index, "TRACKED", world_from_camera=pose))
    timeline.set_snapshot(plane())
    export_html(timeline, tmp_path / "view.html")
    browser.open((tmp_path / "view.html").as_uri())
    browser.wait_for(LOADED)
    browser.evaluate("page.renderer.drawLines = (positions) => { page.numLines = positions.length / 6; }")
    browser.evaluate("page.draw()")
    assert browser.evaluate("page.numLines") == (19 if goes_on else 0)
    assert browser.evaluate("document.getElementById('path-row').hidden") is not goes_on


def test_a_lost_frame_is_told_plainly(browser: Browser, tmp_path: Path) -> None:
    timeline = two_looks(plane())
    reason = "registration score 0.03 is below 0.36: overlap 0.5, consistency 0.7 and 0.9"
    timeline.add(ReportedFrame(2, "LOST", reason=reason))
    export_html(timeline, tmp_path / "view.html")
    browser.open((tmp_path / "view.html").as_uri())
    browser.wait_for(LOADED)
    told = [
        browser.evaluate(f"document.getElementById('frame-{x}').textContent") for x in ("status", "details")
    ]
    assert told == ["frame 2, LOST: it does not fit the model well enough", reason]
    browser.choose("frame", 1)
    assert browser.evaluate("document.getElementById('frame-details').textContent") == ""
