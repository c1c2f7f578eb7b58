"""Meshes on the page in a real browser, and what is painted on them."""

from __future__ import annotations

import sys
from dataclasses import replace
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest

import nacre
from nacre.io.painting import Painting
from nacre.meshing import Texture
from nacre.viewer import export_html, read_timeline

sys.path.insert(0, str(Path(__file__).parents[1]))
from browser import Browser
from shown_page import IN_A_BROWSER, LOADED, color_at, look_along_the_normal, on_plane
from viewer_scenes import plane, two_looks

pytestmark = IN_A_BROWSER


def test_a_mesh_file_is_shown_as_its_mesh(browser: Browser, tmp_path: Path) -> None:
    cloud, triangles = plane(), np.array([[0, 440, 20], [0, 420, 440]])  # two, over all of the plane
    nacre.write_mesh(tmp_path / "mesh.ply", cloud.points, triangles)
    export_html(read_timeline(tmp_path / "mesh.ply"), tmp_path / "view.html")
    browser.open((tmp_path / "view.html").as_uri())
    browser.wait_for(LOADED)
    assert browser.evaluate("document.getElementById('surface').value") == "mesh"
    corners = browser.evaluate("Array.from(page.clouds[0].triangles, (i) => page.clouds[0].position(i))")
    assert len(corners) == 6
    assert np.abs(np.array(corners)[:, :2]) == pytest.approx(0.1, abs=1e-5)
    assert browser.evaluate("document.getElementById('holes-row').hidden")


@pytest.mark.parametrize("ending", ["glb", "obj"])
def test_a_painted_mesh_shows_its_image(browser: Browser, tmp_path: Path, ending: str) -> None:
    image = np.zeros((64, 64, 3), np.uint8)
    image[:32, :32, 0] = image[:32, 32:, 1] = image[32:, :32, 2] = 255  # red, green; blue, black
    uv = np.array([[0, 0], [1, 0], [0, 1], [1, 1]], np.float32)
    vertices = np.column_stack([0.2 * uv - 0.1, np.full(4, 0.5)])
    triangles = np.array([[0, 2, 1], [1, 2, 3]], np.int32)
    nacre.write_mesh(tmp_path / f"a.{ending}", vertices, triangles, texture=Texture(image, uv, triangles))
    export_html(read_timeline(tmp_path / f"a.{ending}"), tmp_path / "view.html")
    browser.open((tmp_path / "view.html").as_uri())
    browser.wait_for(LOADED)
    assert browser.evaluate("page.kind") == "texture"
    look_along_the_normal(browser)
    for x, y, brightest in [(-0.05, -0.05, 0), (0.05, -0.05, 1), (-0.05, 0.05, 2)]:
        color = color_at(browser, *on_plane(browser, x, y))
        assert color[brightest] > 150
        assert np.delete(color, brightest).max() < 60
    assert color_at(browser, *on_plane(browser, 0.05, 0.05)).max() < 60
    browser.choose("kind", "shading")
    grey = color_at(browser, *on_plane(browser, -0.05, -0.05))
    assert np.ptp(grey) < 20
    assert browser.evaluate("page.renderer.gl.getError()") == 0


def test_a_painted_mesh_of_a_run_is_shown_on_demand(browser: Browser, tmp_path: Path) -> None:
    timeline = two_looks(plane())
    image = BytesIO()
    pytest.importorskip("PIL.Image").new("RGB", (8, 8), (0, 255, 0)).save(image, "PNG")
    corners = replace(plane(), triangles=np.array([[0, 440, 20], [0, 420, 440]], np.int32))
    timeline.painted = replace(corners, painting=Painting(image.getvalue(), np.zeros((441, 2), np.float32)))
    export_html(timeline, tmp_path / "view.html")
    browser.open((tmp_path / "view.html").as_uri())
    browser.wait_for(LOADED)
    assert browser.evaluate("page.kind") == "colour"
    look_along_the_normal(browser)
    browser.choose("surface", "painted")
    browser.wait_for("page.kind === 'texture' && Boolean(page.clouds[0].triangles)")
    red, green, _ = color_at(browser, *on_plane(browser, 0, 0))
    assert green > 150 > 60 > red
    assert browser.evaluate("document.getElementById('holes-row').hidden")
    browser.choose("surface", "points")
    browser.wait_for("page.kind === 'colour'")
    red, green, _ = color_at(browser, *on_plane(browser, 0, 0))
    assert red > 2 * green
