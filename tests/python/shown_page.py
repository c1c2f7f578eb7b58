"""What tests ask of the page that a browser shows: when it is there, and what is where on its picture."""

from __future__ import annotations

import io
import json

import numpy as np
import pytest
from browser import CHROMIUM, Browser

IN_A_BROWSER = [
    pytest.mark.slow,
    pytest.mark.skipif(CHROMIUM is None, reason="no Chromium"),
]
LOADED = "page.clouds.length > 0 && page.clouds[0].version > 1"
# Pixels per metre at the target: half the height by the tangent of half the field of view, 0.7 rad.
PIXEL = "(page.canvas.clientHeight / 2) / Math.tan(0.35) / page.orbit.distance"


def on_plane(browser: Browser, x: float, y: float) -> tuple[float, float]:
    """Return the pixel of a point of the plane, which the first view looks at along its normal."""
    target, width, height, pixels = json.loads(
        browser.evaluate(
            f"JSON.stringify([page.orbit.target, page.canvas.clientWidth, page.canvas.clientHeight, {PIXEL}])"
        )
    )
    return width / 2 + pixels * (x - target[0]), height / 2 + pixels * (y - target[1])


def look_along_the_normal(browser: Browser) -> None:
    browser.evaluate(
        "page.orbit.touched = true; page.orbit.backward = [0, 0, -1]; page.orbit.up = [0, -1, 0]; page.draw()"
    )


def color_at(browser: Browser, x: float, y: float) -> np.ndarray:
    image = pytest.importorskip("PIL.Image")
    browser.evaluate("page.draw()")
    pixels = np.asarray(image.open(io.BytesIO(browser.screenshot())).convert("RGB"), dtype=int)
    return pixels[round(y), round(x)]
