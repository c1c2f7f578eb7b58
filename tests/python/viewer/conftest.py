"""The browser of the tests of the page."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import nacre
from nacre.datasets import write_recording
from nacre.io import octree
from nacre.viewer import export_html

sys.path.insert(0, str(Path(__file__).parents[1]))
from bending_sheet import CAMERA, CURVATURES, sheet
from browser import Browser
from command_line import run
from hills import hills
from shown_page import LOADED
from viewer_scenes import plane, two_looks


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    pytest.importorskip("websockets")
    with Browser(tmp_path_factory.mktemp("profile")) as browser:
        yield browser


@pytest.fixture
def exported(browser: Browser, tmp_path: Path) -> Browser:
    """Return the browser with the page of the plane, opened from disk."""
    export_html(two_looks(plane()), tmp_path / "view.html")
    browser.open((tmp_path / "view.html").as_uri())
    browser.wait_for(LOADED)
    browser.download_to(tmp_path)
    return browser


@pytest.fixture(scope="session")
def bent(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of a run of a sheet that is rolled up, whose fourth image is of nothing."""
    folder = tmp_path_factory.mktemp("sheet")
    depths = [sheet(curvature).simulate_depth(CAMERA, np.eye(4)) for curvature in CURVATURES]
    depths.insert(3, np.full_like(depths[0], np.nan))
    write_recording(folder / "recording", CAMERA, depths, depth_scale=10_000)
    run("reconstruct", folder / "recording", "--deform", "-o", folder / "out", "--no-report")
    return folder / "out"


@pytest.fixture(scope="session")
def hill(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a COPC file of hills with several levels."""
    pytest.importorskip("laspy")
    pytest.importorskip("lazrs")
    path = tmp_path_factory.mktemp("hill") / "hill.copc.laz"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(octree, "_LEAF", 1000)
        nacre.write_points(path, hills())
    return path
