"""Reports of runs as they come: what each says, and that its numbers are those that were written."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from html import unescape
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import nacre
from nacre.cli import main
from nacre.report import pictures
from nacre.run_data.text import count, quantity

NUM_FRAMES = 6


@dataclass(frozen=True)
class Run:
    """What a run wrote."""

    page: str
    figures: dict[str, Any]

    @property
    def text(self) -> str:
        """The words of the page."""
        body = self.page[self.page.index("<body>") :]
        return re.sub(r"[ \n]+", " ", unescape(re.sub(r"<[^>]+>", " ", body)))

    @property
    def verdict(self) -> tuple[str, str]:
        """Its level and its sentence."""
        found = re.search(r'class="verdict (\w+)"><p class="word">([^<]+)<', self.page)
        assert found is not None
        return found[1], unescape(found[2])

    def tile(self, name: str) -> str:
        """Return the value of a main figure."""
        found = re.search(rf"<dt>{name}</dt><dd>([^<]+)<", self.page)
        assert found is not None, name
        return unescape(found[1])


@pytest.fixture(scope="module")
def small_pictures() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        for name in ("_SIZE", "_MAIN_SIZE", "_CAMERA_SIZE"):
            patch.setattr(pictures, name, (120, 120))
        yield


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory, small_pictures: None) -> dict[str, Run]:
    """Return the runs of recordings that are whole, half blank, of one frame, blank, and without truth."""
    mesh = nacre.built_in_object()
    camera = nacre.Camera(160, 120, 131, 131, 79.5, 59.5)
    poses = nacre.turntable_poses(mesh, NUM_FRAMES, math.radians(8), camera=camera, distance=0.45)
    seen = [mesh.simulate_depth(camera, pose, noise=0.0005, seed=i) for i, pose in enumerate(poses)]
    blank = np.full_like(seen[0], np.nan)
    recordings = {
        "whole": (seen, poses),
        "half": ([seen[0], blank, blank, seen[1], blank, seen[2]], poses[[0, 0, 0, 1, 1, 2]]),
        "one": (seen[:1], poses[:1]),
        "blank": ([blank] * 3, poses[:3]),
        "without-truth": (seen[:3], None),
    }
    done = {}
    for name, (depths, truth) in recordings.items():
        folder = tmp_path_factory.mktemp(name)
        nacre.write_recording(folder / "ball", camera, depths, depth_scale=5000, poses=truth)
        with pytest.raises(SystemExit) as end:
            main(["reconstruct", str(folder / "ball"), "-o", str(folder / "out"), "--quiet"])
        assert bool(end.value.code) == (name == "blank")
        done[name] = _read(folder / "out")
    return done


def _read(out: Path) -> Run:
    return Run((out / "report.html").read_text(), json.loads((out / "report.json").read_text()))


@pytest.mark.parametrize("name", ["whole", "half", "one", "blank", "without-truth"])
def test_the_page_and_the_written_figures_agree(runs: dict[str, Run], name: str) -> None:
    run = runs[name]
    figures = run.figures
    assert run.tile("Frames tracked") == f"{figures['num_tracked']} / {figures['num_frames']}"
    if figures["num_points"]:
        assert run.tile("Model points") == count(figures["num_points"])
    assert run.tile("Time per frame") == quantity(figures["milliseconds"]["median"], "ms")
    depth = [frame["depth"] for frame in figures["frames"]]
    pixels, invalid = (sum(d[key] for d in depth) for key in ("num_pixels", "num_invalid"))
    assert f"Pixels of all frames 100 % {count(pixels)}" in run.text
    assert f"{quantity(1 - invalid / pixels, 'fraction')} {count(pixels - invalid)}" in run.text
    folded = [f for f in figures["frames"] if f["status"] in ("TRACKED", "RELOCALISED")]
    used = sum(f["region"]["num_inside"] for f in folded)
    assert f"in frames that were fused {quantity(used / pixels, 'fraction')} {count(used)}" in run.text
    assert len(run.page) < 1_000_000
    assert "https://" not in run.page


def test_a_good_run_is_called_good(runs: dict[str, Run]) -> None:
    run = runs["whole"]
    error = quantity(run.figures["absolute_trajectory_error"]["rmse"], "m")
    sentence = f"Good: all 6 frames were tracked, with a trajectory error of {error}."
    assert run.verdict == ("ok", sentence)
    assert run.figures["verdict"] == {
        "level": "ok", "sentence": run.verdict[1], "next_step": "", "findings": [],
    }  # fmt: skip
    error = run.figures["absolute_trajectory_error"]["rmse"]
    assert run.tile(r"Trajectory error \(ATE\)") == quantity(error, "m")
    assert "RMSE over 6 of 6 frames" in run.text
    spread = run.figures["point_sigma"]
    assert run.tile("Point standard deviation") == quantity(spread["median"], "m")
    assert f"for 95 % at most {quantity(spread['p95'], 'm')}" in run.text
    for section in ("model", "depth", "funnel", "trajectory", "frames", "time", "figures"):
        assert f'<div id="{section}"' in run.page
    assert '<div id="look"' not in run.page
    for title in ("Point spacing", "Distance to the nearest point [mm]", "Frontal observations"):
        assert title in run.text


def test_lost_frames_are_named(runs: dict[str, Run]) -> None:
    run = runs["half"]
    assert run.figures["num_lost"] == 3
    told = "Incomplete: 3 of 6 frames were lost: no usable pixel (frames 1 to 2, 4)."
    assert run.verdict == ("weak", told)
    assert run.figures["verdict"]["findings"][0]["frames"] == [1, 2, 4]
    assert "1 to 2 2 LOST no usable pixel" in run.text
    assert "4 1 LOST no usable pixel" in run.text
    assert "Frame 1, the first that is LOST" in run.text
    assert "The depth images hold no measurement" in run.text


def test_a_single_frame(runs: dict[str, Run]) -> None:
    run = runs["one"]
    assert run.verdict == ("weak", "One view: there was nothing to register it to.")
    assert "1 of 1 frames have a pose and a true one, at least 3 must" in run.text
    assert '<div id="trajectory"' not in run.page
    assert '<div id="model"' in run.page


def test_a_failure_says_why_and_what_to_try(runs: dict[str, Run]) -> None:
    run = runs["blank"]
    assert run.verdict == ("lost", "Failed: none of the 3 frames could be registered: no usable pixel.")
    assert "is it the right folder or topic" in run.text
    assert '<div id="model"' not in run.page
    assert '<div id="figures"' not in run.page
    assert "Nothing came into the model" in run.text


def test_without_truth_no_error_is_told(runs: dict[str, Run]) -> None:
    run = runs["without-truth"]
    assert run.verdict[0] == "ok"
    assert "has no true poses to compare with" in run.text
    assert "Trajectory error" not in run.text
