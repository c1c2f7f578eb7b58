"""What bends moves on the page along the time line, in a real browser."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np

from nacre.io.quantization import quantized
from nacre.viewer import Snapshot, export_html, read_timeline
from nacre.viewer.packing import morton_order

sys.path.insert(0, str(Path(__file__).parents[1]))
from browser import Browser
from shown_page import IN_A_BROWSER, LOADED

pytestmark = IN_A_BROWSER


def assert_is_where_it_was(browser: Browser, cloud: Snapshot, place: int) -> None:
    """Compare the points and normals on the page, which are in another order, with those of a place."""
    assert cloud.motion is not None
    browser.wait_for(f"page.clouds[0]?.moment === {cloud.motion.moments[place]:g}")
    rows = "[...Array(page.clouds[0].size).keys()]"
    shown = json.loads(browser.evaluate(f"JSON.stringify({rows}.map((i) => page.clouds[0].position(i)))"))
    normals = json.loads(browser.evaluate("JSON.stringify([...page.clouds[0].normals])"))
    order = morton_order(quantized(cloud.points)[0])
    shape = cloud.at(place)
    np.testing.assert_allclose(shown, shape.points[order], atol=0.51 * cloud.motion.step)
    np.testing.assert_allclose(np.reshape(normals, (-1, 4))[:, :3] / 127, shape.normals[order], atol=0.02)


def test_the_points_are_where_they_were_at_each_frame(browser: Browser, bent: Path, tmp_path: Path) -> None:
    timeline = read_timeline(bent)
    ((_, cloud),) = timeline.snapshots
    export_html(timeline, tmp_path / "view.html")
    browser.open((tmp_path / "view.html").as_uri() + "#frame=2")
    browser.wait_for(LOADED)
    assert "frame 2, TRACKED" in browser.text()
    assert_is_where_it_was(browser, cloud, 2)
    for place in (6, 3, 0):
        browser.choose("frame", place)
        assert_is_where_it_was(browser, cloud, place)
    browser.choose("surface", "mesh")
    browser.wait_for("page.clouds[0].triangles")
    assert browser.evaluate("document.getElementById('holes-row').hidden")


def test_an_address_without_a_frame_opens_with_the_last(browser: Browser, bent: Path, tmp_path: Path) -> None:
    export_html(read_timeline(bent), tmp_path / "view.html")
    for ending in ("", "#frame=99", "#other"):
        browser.open("about:blank")
        browser.open((tmp_path / "view.html").as_uri() + ending)
        browser.wait_for(LOADED)
        assert "frame 6, TRACKED" in browser.text()
