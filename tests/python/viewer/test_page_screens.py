"""The page on a telephone, without WebGL, and without a model: what is around the picture."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from nacre.viewer import Controls, Timeline, Viewer, export_html

sys.path.insert(0, str(Path(__file__).parents[1]))
from browser import Browser
from shown_page import IN_A_BROWSER, LOADED
from viewer_scenes import plane, two_looks

pytestmark = IN_A_BROWSER


@pytest.fixture
def phone(browser: Browser) -> Iterator[Browser]:
    size = {"width": 412, "height": 800, "deviceScaleFactor": 1, "mobile": True}
    browser.send("Emulation.setDeviceMetricsOverride", **size)
    yield browser
    browser.send("Emulation.clearDeviceMetricsOverride")


def test_on_a_phone_the_panel_is_folded_away(phone: Browser, tmp_path: Path) -> None:
    export_html(two_looks(plane()), tmp_path / "view.html")
    phone.open((tmp_path / "view.html").as_uri())
    phone.wait_for(LOADED)
    assert phone.evaluate("page.canvas.clientWidth") == 412
    assert "Colour by" not in phone.text()
    phone.press_button("fold")
    assert "Colour by" in phone.text()
    assert phone.evaluate("page.canvas.clientWidth") == 412
    assert phone.evaluate("page.canvas.clientHeight") == pytest.approx(0.55 * 800, abs=1)
    phone.press_button("fold")
    assert phone.evaluate("page.canvas.clientHeight") == 800


def test_on_a_wide_page_the_panel_can_be_folded_away(exported: Browser) -> None:
    before = exported.evaluate("page.canvas.clientWidth")
    assert "Colour by" in exported.text()
    exported.press_button("fold")
    assert exported.evaluate("page.canvas.clientWidth") == before + 300
    assert exported.evaluate("document.getElementById('fold').ariaExpanded") == "false"


@pytest.fixture
def without_webgl(browser: Browser) -> Iterator[Browser]:
    script = """const get = HTMLCanvasElement.prototype.getContext;
        HTMLCanvasElement.prototype.getContext = function (kind) {
            return kind === "2d" ? get.call(this, kind) : null;
        };"""
    added = browser.send("Page.addScriptToEvaluateOnNewDocument", source=script)
    yield browser
    browser.send("Page.removeScriptToEvaluateOnNewDocument", identifier=added["identifier"])


def test_without_webgl_a_camera_s_buttons_work(without_webgl: Browser) -> None:
    viewer = Viewer(two_looks(plane()), port=0, controls=Controls())
    try:
        without_webgl.open(viewer.url)
        without_webgl.wait_for("document.body.innerText.includes('cannot draw the model')")
        without_webgl.wait_for("!document.getElementById('start').disabled")
        without_webgl.press_button("start")
        without_webgl.wait_for("page.live.now.state === 'recording'")
        assert without_webgl.evaluate("document.getElementById('stop').getBoundingClientRect().width") > 20
        without_webgl.wait_for("document.body.innerText.includes('441 points')")
        assert "cannot draw the model" in without_webgl.text()
    finally:
        viewer.close()


def test_on_a_phone_a_camera_s_buttons_are_in_sight(phone: Browser) -> None:
    viewer = Viewer(two_looks(plane()), port=0, controls=Controls())
    try:
        phone.open(viewer.url)
        phone.wait_for("!document.getElementById('start').disabled")
        assert phone.evaluate("document.getElementById('start').getBoundingClientRect().bottom") < 800
    finally:
        viewer.close()


def test_a_title_is_no_markup(browser: Browser, tmp_path: Path) -> None:
    title = "</script><b id='injected'>x</b> <!-- data -->"
    export_html(two_looks(plane(), title), tmp_path / "view.html", triangles=False)
    browser.open((tmp_path / "view.html").as_uri())
    browser.wait_for(LOADED)
    assert browser.evaluate("document.getElementById('injected')") is None
    assert browser.evaluate("document.title") == title


def test_an_empty_run_says_so(browser: Browser) -> None:
    viewer = Viewer(Timeline("nothing", None), port=0)
    try:
        browser.open(viewer.url)
        browser.wait_for("document.body.innerText.includes('There is no model yet')")
    finally:
        viewer.close()
