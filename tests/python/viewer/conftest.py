"""The browser of the tests of the page."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from nacre.viewer import export_html

sys.path.insert(0, str(Path(__file__).parents[1]))
from browser import Browser
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
