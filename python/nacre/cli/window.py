"""The window of a run: the viewer's page, in a browser."""

from __future__ import annotations

import os
import sys
import webbrowser
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from nacre.viewer import Controls


@dataclass
class Window:
    """Where a run is shown, and the buttons that it has where frames come by themselves."""

    port: int
    controls: Controls
    opens: bool = False  # a browser, and does not wait to be looked at
    stays: bool = True  # until Ctrl-C, when the run has ended


def has_browser() -> bool:
    """Say whether there is a browser that opens a window here, and not one of the terminal."""
    if os.environ.get("BROWSER"):
        return True
    is_unix = os.name == "posix" and sys.platform != "darwin"
    if is_unix and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        return False
    try:
        browser = webbrowser.get()
    except webbrowser.Error:
        return False
    waits = isinstance(browser, webbrowser.GenericBrowser)
    return not waits or isinstance(browser, webbrowser.BackgroundBrowser)
