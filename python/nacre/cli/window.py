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


def has_browser() -> bool:
    """Say whether there is a browser that opens a window here."""
    is_unix = os.name == "posix" and sys.platform != "darwin"
    if is_unix and not any(os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER")):
        return False
    try:
        webbrowser.get()
    except webbrowser.Error:
        return False
    return True
