"""The page as a browser shows it: two screens, and the rest when it is asked for."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from nacre.report import DoubledSurfaces, ModelCloud, ReportData, ReportedFrame, write_report

sys.path.insert(0, str(Path(__file__).parents[1]))
from browser import CHROMIUM, Browser

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="no Chromium")
pytest.importorskip("websockets")

SCREEN = (1280, 800)


def page_of_a_bad_run(path: Path) -> Path:
    """Write the report of a run that much speaks against: the longest of pages."""
    random = np.random.default_rng(0)
    points = random.normal(size=(3000, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    frames = []
    for i in range(300):
        status = "LOST" if 40 < i < 90 else "WEAK" if 200 < i < 240 else "TRACKED"
        truth, pose = np.eye(4), np.eye(4)
        truth[0, 3], pose[0, 3] = 0.01 * i, 0.01 * i + (0.4 if i > 250 else 0)
        reason = "registration score 0.1 is below 0.3" if status == "LOST" else ""
        times = {"registration": 20.0, "total": 30.0}
        frames.append(
            ReportedFrame(
                i, status, reason=reason, world_from_camera=pose, truth=truth, overlap=0.8,
                consistency=0.99, score=2.0, rmse=0.001, num_inliers=900, num_points=3000, milliseconds=times,
            )
        )  # fmt: skip
    write_report(
        path,
        ReportData(
            "A recording with a long name",
            "300 of 300 frames, plain format, pinhole camera 640 x 480, fx 525, fy 525, with true poses",
            frames,
            ModelCloud(points, points, confidence=np.ones(3000), sigma=np.full(3000, 0.001)),
            doubled=DoubledSurfaces(0.02, 0.01, (0.0, 0.0, 1.0)),
            parameters={"spacing": 0.002},
        ),
    )
    return path


def test_two_screens_and_the_rest_is_folded(tmp_path: Path) -> None:
    path = page_of_a_bad_run(tmp_path / "report.html")
    with Browser(tmp_path / "profile") as browser:
        width, height = SCREEN
        browser.send(
            "Emulation.setDeviceMetricsOverride",
            width=width,
            height=height,
            deviceScaleFactor=1,
            mobile=False,
        )
        browser.open(path.as_uri())
        assert browser.evaluate("document.documentElement.scrollHeight") <= 2.1 * height
        assert browser.evaluate("document.querySelector('.verdict').getBoundingClientRect().bottom") < height
        assert "Wrong: the camera jumps by 410 mm" in browser.text()
        assert "Inlier RMSE" not in browser.text()
        browser.evaluate("for (const part of document.querySelectorAll('details')) part.open = true")
        assert "Inlier RMSE" in browser.text()
        # No word of a table is broken, and nothing is wider than the page.
        assert browser.evaluate("document.documentElement.scrollWidth") <= width
        tall = "[...document.querySelectorAll('td.status-TRACKED')].every(cell => cell.clientHeight < 40)"
        assert browser.evaluate(tall)
