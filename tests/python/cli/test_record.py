"""``nacre record``: with a window, without one, and where there is no camera, no browser, no frame."""

from __future__ import annotations

import json
import signal
import sys
import time
import urllib.request
import webbrowser
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import nacre

sys.path.insert(0, str(Path(__file__).parents[1]))
import fake_realsense as fake
from browser import CHROMIUM, Browser
from command_line import run

from nacre.cli.window import has_browser
from nacre.datasets import realsense
from nacre.viewer import Viewer

pytest.importorskip("PIL")


@pytest.fixture
def plug(monkeypatch: pytest.MonkeyPatch) -> Callable[..., fake.Library]:
    """Return what plugs a camera in."""

    def plug(**options: Any) -> fake.Library:
        library = fake.Library(**options)
        monkeypatch.setattr(realsense, "_library", lambda: library)
        return library

    return plug


@pytest.fixture
def no_browser(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER"):
        monkeypatch.delenv(name, raising=False)


@pytest.mark.parametrize("options", [["--no-window"], []])
@pytest.mark.usefixtures("no_browser")
def test_in_a_terminal_alone_it_begins_at_once(
    options: list[str], plug: Callable[..., fake.Library], tmp_path: Path
) -> None:
    library = plug(seconds=0.005)
    out = tmp_path / "out"
    done = run("record", "realsense", "-o", out, "--last", 4, "--no-report", *options)
    assert done.code == 0, done.err
    assert library.stopped
    assert ("no window: there is no browser, or no display" in done.out) == (not options)
    assert ("the model is at http://127.0.0.1:" in done.out) == (not options)
    report = json.loads((out / "report.json").read_text())
    assert report["num_frames"] == 5
    again = nacre.open_sequence(out / "recording")
    assert len(again) == 5
    assert len(nacre.read_points(out / "model.ply")) > 100


@pytest.mark.usefixtures("no_browser")
def test_without_a_display_the_page_is_there_and_ctrl_c_writes_everything(tmp_path: Path) -> None:
    out = tmp_path / "out"
    arguments = ("record", "realsense", "-o", str(out), "--port", "0", "--no-report")
    running = fake.start("seconds=0.02", *arguments)
    assert running.stdout is not None
    url = next(line for line in running.stdout if "the model is at http" in line).split()[-1]
    while True:
        with urllib.request.urlopen(f"{url}/data/live") as answer:
            live = json.load(answer)
        assert live["state"] == "recording"
        if live["numFrames"] > 3:
            break
        time.sleep(0.02)
    for _ in range(2):  # a terminal's, and that of what started the command
        running.send_signal(signal.SIGINT)
    told, errors = running.communicate(timeout=60)
    assert running.returncode == 0, errors
    assert "Ctrl-C ends it" not in told  # nobody may be there
    assert len(nacre.open_sequence(out / "recording")) > 3
    assert len(nacre.read_points(out / "model.ply")) > 100
    assert not (out / "unfinished").exists()


def test_a_browser_that_opens_no_window(
    plug: Callable[..., fake.Library], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("BROWSER", "firefox")
    monkeypatch.setattr(webbrowser, "open", lambda url: False)
    plug(seconds=0.005)
    done = run("record", "realsense", "-o", tmp_path / "out", "--port", 0, "--last", 4, "--no-report")
    assert done.code == 0, done.err
    assert "no window: the browser opened none; recording begins" in done.out
    assert json.loads((tmp_path / "out" / "report.json").read_text())["num_frames"] == 5


@pytest.mark.usefixtures("no_browser")
def test_a_recording_is_played_as_a_camera(recording: Path, tmp_path: Path) -> None:
    done = run("record", recording, "-o", tmp_path / "out", "--no-report", "--json")
    assert done.code == 0, done.err
    assert done.json["live"]["camera"] is False
    assert done.json["num_frames"] + done.json["live"]["num_dropped"] == 4
    assert not (tmp_path / "out" / "recording").exists()  # it is where it was


@pytest.mark.usefixtures("no_browser")
def test_what_bends_is_recorded_as_it_is(plug: Callable[..., fake.Library], tmp_path: Path) -> None:
    plug(seconds=0.005)
    done = run("record", "realsense", "-o", tmp_path, "--last", 2, "--no-report", "--deform", "--json")
    assert done.code == 0, done.err
    assert done.json["parameters"]["deform"] is True
    assert done.json["deformation"]["num_nodes"] > 0
    refused = run("record", "realsense", "-o", tmp_path, "--deform", "--set", "loop_closure=true")
    assert refused.code == 2
    assert "loop_closure (--loop-closure) must be off" in refused.err


def test_without_a_frame_nothing_is_left(plug: Callable[..., fake.Library], tmp_path: Path) -> None:
    plug(frames=0, unplugged=True)
    done = run("record", "realsense", "-o", tmp_path / "out", "--no-window")
    assert done.code == 1
    assert done.err == "error: Fake D435 0815 was unplugged\n"
    assert not (tmp_path / "out" / "recording").exists()


def test_unplugged_before_the_start(
    plug: Callable[..., fake.Library], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("BROWSER", "firefox")
    opened: list[str] = []
    monkeypatch.setattr(webbrowser, "open", lambda url: opened.append(url) is None)
    plug(frames=3, unplugged=True, seconds=0.005)
    done = run("record", "realsense", "-o", tmp_path / "out", "--port", 0)
    assert done.code == 1
    assert done.err == "error: Fake D435 0815 was unplugged: nothing was recorded\n"
    assert f"the model is at {opened[0]}\nrecording begins with the button Start there\n" in done.out
    assert not (tmp_path / "out" / "recording").exists()
    assert not (tmp_path / "out" / "unfinished").exists()


def test_unplugged_in_the_middle(
    plug: Callable[..., fake.Library], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    shown: list[dict[str, Any]] = []

    def press_start(url: str) -> bool:
        own = urllib.request.Request(f"{url}/press/start", headers={"Origin": url}, method="POST")
        urllib.request.urlopen(own).close()
        return True

    def keep(viewer: Viewer) -> None:
        shown.append(json.loads(viewer.read("live")[1]))

    monkeypatch.setenv("BROWSER", "firefox")
    monkeypatch.setattr(webbrowser, "open", press_start)
    monkeypatch.setattr(Viewer, "wait", keep)
    plug(frames=9, unplugged=True, seconds=0.02)
    out = tmp_path / "out"
    done = run("record", "realsense", "-o", out, "--port", 0, "--no-report")
    assert done.code == 1
    assert "error: Fake D435 0815 was unplugged; what there is was written" in done.err
    (window,) = shown
    assert window["state"] == "finished"
    assert window["message"] == f"Fake D435 0815 was unplugged; what there is was written to {out}"
    kept = nacre.open_sequence(out / "recording")
    assert 1 <= len(kept) == json.loads((out / "report.json").read_text())["num_frames"] <= 9
    assert len(nacre.read_points(out / "model.ply")) > 100


def test_what_is_no_camera(tmp_path: Path) -> None:
    done = run("record", "realsens", "-o", tmp_path / "out")
    assert done.code == 2
    assert "there is no camera or recording realsens; cameras are realsense, " in done.err
    assert not (tmp_path / "out").exists()


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    pytest.importorskip("websockets")
    with Browser(tmp_path_factory.mktemp("profile")) as browser:
        yield browser


class TestBrowser:
    @pytest.mark.parametrize(
        ("found", "opens"),
        [
            (webbrowser.BackgroundBrowser("firefox"), True),
            (webbrowser.Chrome("chromium"), True),
            (webbrowser.GenericBrowser("lynx"), False),  # it would take the terminal
            (webbrowser.Error("none"), False),
        ],
    )
    def test_one_that_opens_a_window(
        self, found: Any, opens: bool, no_browser: None, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        def get() -> Any:
            if isinstance(found, Exception):
                raise found
            return found

        monkeypatch.setattr(webbrowser, "get", get)
        monkeypatch.setenv("DISPLAY", ":0")
        assert has_browser() == opens

    def test_the_users_own(self, no_browser: None, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setenv("BROWSER", "firefox")
        assert has_browser()


@pytest.mark.slow
@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium")
class TestWindow:
    @pytest.fixture(autouse=True)
    def window_is_ours(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setenv("BROWSER", f"{sys.executable} -c 1 %s")

    def opened(self, browser: Browser, options: str, out: Path) -> Any:
        """Start recording, and return the process once the browser shows its window."""
        arguments = (
            "record",
            "realsense",
            "-o",
            str(out),
            "--port",
            "0",
            "--no-report",
            "--set",
            "binning=1",
        )
        running = fake.start(options, *arguments)
        assert running.stdout is not None
        for line in running.stdout:
            if "the model is at http" in line:
                browser.open(line.split()[-1])
                break
        browser.wait_for("document.getElementById('picture-depth').naturalWidth > 50")
        return running

    def say(self, browser: Browser, words: str) -> None:
        browser.wait_for(f"document.getElementById('live-state').textContent.startsWith('{words}')")

    def test_start_pause_and_stop(self, browser: Browser, tmp_path: Path) -> None:
        out = tmp_path / "out"
        running = self.opened(browser, "hole=slice(20, 60)", out)
        self.say(browser, "Ready, ")
        assert not list(out.glob("recording/depth/*"))
        browser.press_button("start")
        self.say(browser, "Recording, ")
        browser.wait_for("page.live.now.numFrames > 2 && page.clouds.length")
        browser.wait_for("document.getElementById('badge').textContent.startsWith('TRACKED')")
        browser.wait_for("page.holes.runs[0]?.sizes.length === 1")
        assert "1 hole, the largest" in browser.text()
        # The hole is 40 pixels wide, at a distance of 0.7 m.
        assert browser.evaluate("page.holes.runs[0].sizes[0]") == pytest.approx(40 * 0.7 / 90, rel=0.15)

        browser.press_button("pause")
        self.say(browser, "Paused")
        time.sleep(0.3)  # for the frame that is being registered
        before, seen = browser.evaluate("page.live.now.numFrames"), browser.evaluate("page.live.now.numSeen")
        browser.wait_for(f"page.live.now.numSeen > {seen} + 10")
        assert browser.evaluate("page.live.now.numFrames") <= before + 1
        browser.press_button("start")
        browser.wait_for(f"page.live.now.numFrames > {before} + 2")

        browser.press_button("stop")
        self.say(browser, "Finished")
        assert f"The results are in {out}" in browser.text()
        running.send_signal(signal.SIGINT)
        told, errors = running.communicate(timeout=60)
        assert running.returncode == 0, errors
        assert "model.ply" in told
        report = json.loads((out / "report.json").read_text())
        again = nacre.open_sequence(out / "recording")
        assert len(again) == report["num_frames"] > before
        assert report["live"]["stopped"] is None
        assert (
            report["live"]["num_received"] < 1.5 * report["num_frames"] + 30
        )  # not those before and between
        np.testing.assert_array_equal(np.isnan(again[0].depth[25:55, 25:55]), True)
