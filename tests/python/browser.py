"""A headless Chromium with software WebGL, driven by its DevTools protocol."""

from __future__ import annotations

import base64
import itertools
import json
import re
import shutil
import subprocess
import time
import urllib.request
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import Any

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")


def _page_of(address: str, seconds: float = 20.0) -> str:
    """Return where the first page listens, once there is one."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        with urllib.request.urlopen(f"http://{address}/json") as answer:
            pages = [target for target in json.load(answer) if target["type"] == "page"]
        if pages:
            return str(pages[0]["webSocketDebuggerUrl"])
        time.sleep(0.1)
    raise TimeoutError(f"Chromium opened no page in {seconds} s")


class Browser:
    """One page. Use as a context manager."""

    def __init__(self, profile: Path) -> None:
        assert CHROMIUM is not None
        options = [
            "--headless=new", "--no-sandbox", "--disable-gpu-sandbox", "--use-gl=angle",
            "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--window-size=1200,800",
            "--remote-debugging-port=0", f"--user-data-dir={profile}", "about:blank",
        ]  # fmt: skip
        self._process = subprocess.Popen(
            [CHROMIUM, *options], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
        )
        assert self._process.stderr is not None
        found = None
        for line in self._process.stderr:
            found = re.search(r"DevTools listening on ws://([^/]+)/", line)
            if found:
                break
        assert found is not None, "Chromium ended before it began"
        from websockets.sync.client import connect

        self._ends = ExitStack()
        self._socket = self._ends.enter_context(connect(_page_of(found[1]), max_size=None))
        self._ids = itertools.count(1)

    def __enter__(self) -> Browser:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._ends.close()
        self._process.terminate()
        self._process.wait(timeout=20)
        assert self._process.stderr is not None
        self._process.stderr.close()

    def send(self, method: str, **parameters: Any) -> Any:
        """Send a command and return its result."""
        number = next(self._ids)
        self._socket.send(json.dumps({"id": number, "method": method, "params": parameters}))
        while True:
            answer = json.loads(self._socket.recv(timeout=60))
            if answer.get("id") == number:
                assert "error" not in answer, answer
                return answer["result"]

    def open(self, url: str) -> None:
        """Go to a page."""
        self.send("Page.enable")
        self.send("Page.navigate", url=url)
        self.wait_for(f"document.readyState == 'complete' && location.href.startsWith({json.dumps(url)})")

    def evaluate(self, script: str) -> Any:
        """Return the value of a script."""
        return self.send("Runtime.evaluate", expression=script, returnByValue=True)["result"].get("value")

    def wait_for(self, script: str, seconds: float = 60.0) -> Any:
        """Return the value of a script once it is true."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            value = self.evaluate(script)
            if value:
                return value
            time.sleep(0.02)
        raise AssertionError(f"never true: {script}; the page says: {self.text()}")

    def text(self) -> str:
        """Return the words on the page."""
        return str(self.evaluate("document.body.innerText"))

    def press(self, key: str, code: int) -> None:
        """Press a key on what has the focus."""
        for kind in ("rawKeyDown", "keyUp"):
            self.send("Input.dispatchKeyEvent", type=kind, key=key, code=key, windowsVirtualKeyCode=code)

    def click(self, x: float, y: float) -> None:
        """Click with the left button at a place of the page."""
        for kind in ("mousePressed", "mouseReleased"):
            self.send("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", buttons=1, clickCount=1)

    def drag(self, *places: tuple[float, float]) -> None:
        """Move from place to place with the left button held."""
        events = [
            ("mousePressed", places[0]), *(("mouseMoved", place) for place in places[1:]),
            ("mouseReleased", places[-1]),
        ]  # fmt: skip
        for kind, (x, y) in events:
            self.send("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", buttons=1, clickCount=1)

    def choose(self, control: str, value: object) -> None:
        """Give the control of an id a value, as a hand does."""
        self.evaluate(
            f"{{ const c = document.getElementById({json.dumps(control)}); c.value = {json.dumps(value)};"
            "c.dispatchEvent(new Event('input')); c.dispatchEvent(new Event('change')); }"
        )

    def press_button(self, control: str) -> None:
        """Click on the control of an id."""
        self.evaluate(f"document.getElementById({json.dumps(control)}).click()")

    def download_to(self, folder: Path) -> None:
        """Save what the page offers in a folder."""
        self.send("Page.setDownloadBehavior", behavior="allow", downloadPath=str(folder))

    def screenshot(self) -> bytes:
        """Return the page as PNG."""
        return base64.b64decode(self.send("Page.captureScreenshot", format="png")["data"])
